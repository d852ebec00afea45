"""What every movement does from every attitude that chains of movements reach, worked out once.

Motion depends on roll and pitch, not on position or yaw, so a whole reach set is made of few
pieces: one path per (attitude, movement), turned by the yaw at its start and laid end to end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats4, Floats5, Int32s2
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, compute_rotation
from clearway.base.grid import AvoidanceGrid
from clearway.reach.expand.curves import DEGREE, PathAt, curve_parts
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.class_table import ClassTable

MOVEMENT_SAMPLES = 4
"""Samples kept per movement; paths are traced through cells at a multiple of them."""
MOST_ATTITUDES = 5000
MOST_MOVEMENTS = 100
"""Movements of a trajectory: grids that need more are wrong by a unit, most likely."""
APART_RAD = 1e-12
"""Start pitches by which reach sets of classes of motion are distinguished; all begin level."""
FEWEST_STANDING = 3
MOST_STANDING = 12
"""Movements that a trajectory may stand for."""


class LatticePieces(NamedTuple):
    """The lattice as compiled loops take it."""

    following: Int32s2
    """[attitudes, movements] attitude at the movement's end; -1 where it is not allowed."""
    path: Floats4
    """[attitudes, movements, steps, 3] displacement at equal times, yaw 0 at the start, z up."""
    curve: Floats5
    """[attitudes, movements, parts, degree + 1, 3] the same way as polynomials, see `curves`."""
    turn_rad: Floats2
    """[attitudes, movements] change of yaw."""
    length_m: Floats2
    """[attitudes, movements] length flown."""
    sagitta_m: Floats2
    """[attitudes, movements] how far the path may lie from chords between its samples."""
    attitude_rad: Floats2
    """[attitudes, 2] roll and pitch."""
    duration_s: Floats
    """[movements]"""


@dataclass(frozen=True, eq=False)
class Lattice:
    """LatticePieces of an automaton, and where each start pitch lies among the attitudes."""

    automaton: MovementAutomaton
    pieces: LatticePieces
    start: dict[float, int]
    """Attitude index by start pitch."""

    @property
    def mirror(self) -> tuple[int, ...] | None:
        return self.automaton.mirror


def movements_deep(automaton: MovementAutomaton, grid: AvoidanceGrid) -> int:
    """How many movements a trajectory may have: as many as layers, or as straight flight needs.

    What can stop may stand for some more of them. Raises ClearwayError where that is none or
    absurdly many.
    """
    step = automaton.step_m
    if step <= 0.0:
        raise ClearwayError("no movement of the automaton leads anywhere")
    deep = max(float(grid.layers), float(np.ceil(grid.range_m / step - 1e-6)))
    if deep > MOST_MOVEMENTS:
        raise ClearwayError(
            f"a trajectory through {grid.layers} layers to {grid.range_m:g} m takes {deep:.4g} "
            f"movements of {step:g} m, more than {MOST_MOVEMENTS}; take fewer layers, less range, "
            "or longer or faster movements"
        )
    return int(deep) + standing_deep(automaton)


def standing_deep(automaton: MovementAutomaton) -> int:
    """Movements of a trajectory that may stand: those of half a turn on the spot, or a few."""
    if not automaton.can_stop:
        return 0
    rate = automaton.fastest_mps / automaton.spot_turn_m_per_rad
    turn = rate * max(movement.duration_s for movement in automaton.movements)
    half = int(np.ceil(np.pi / turn - 1e-6)) if turn > 0.0 else 0
    return min(max(half, FEWEST_STANDING), MOST_STANDING)


def build_lattice(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    start_pitches_rad: tuple[float, ...],
    deep: int,
) -> Lattice:
    """Every attitude within `deep` movements of the starts, and what each movement does there.

    Raises ClearwayError when turn steps make more attitudes than a table should hold.
    """
    thinnest = float(np.min(np.diff(grid.range_edges_m)))
    steps = MOVEMENT_SAMPLES * max(4, int(np.ceil(4.0 * automaton.step_m / thinnest)))
    classes = automaton.classes
    if automaton.has_inertia and classes is not None:
        start = {at * APART_RAD: at for at in range(len(classes.classes))}
        return Lattice(automaton, _pieces_of(classes, automaton, steps), start)
    attitudes: list[tuple[float, float, Movement | None]] = []
    known: dict[tuple[int, int, str], int] = {}

    def index_of(roll: float, pitch: float, last: Movement | None) -> int:
        memory = last.name if last is not None and automaton.forbidden else ""
        key = (round(roll * 1e9), round(pitch * 1e9), memory)
        if key not in known:
            known[key] = len(attitudes)
            attitudes.append((roll, pitch, last))
        return known[key]

    start = {pitch: index_of(0.0, pitch, None) for pitch in start_pitches_rad}
    rows: list[list[tuple[int, FloatArray]]] = []
    generation_end, generation = len(attitudes), 0
    while len(rows) < len(attitudes) and generation < deep:
        roll, pitch, last = attitudes[len(rows)]
        row = []
        for movement in automaton.movements:
            path = _path(automaton, movement, roll, pitch, steps)
            reached = -1
            if automaton.is_allowed([0.0, 0.0, 0.0, roll, pitch, 0.0], movement, last):
                reached = index_of(float(path[-1, 3]), float(path[-1, 4]), movement)
            row.append((reached, path))
        rows.append(row)
        if len(rows) == generation_end:
            generation_end, generation = len(attitudes), generation + 1
        if len(attitudes) > MOST_ATTITUDES:
            raise ClearwayError(
                f"movements reach more than {MOST_ATTITUDES} different attitudes; "
                "give the automaton a pitch limit, or turn steps that are multiples of each other"
            )
    return Lattice(automaton, _pieces(automaton, rows, attitudes), start)


def _pieces_of(classes: ClassTable, automaton: MovementAutomaton, steps: int) -> LatticePieces:
    """Of classes of motion: each is an attitude, and ways between known positions are straight."""
    along = classes.along_each(np.arange(1, steps + 1) / steps)
    position, turned = np.ascontiguousarray(along[..., :3]), along[..., -1, 3]
    rows = np.insert(classes.paths[..., :3], 0, 0.0, axis=2)
    share = (np.arange(DEGREE + 1) / DEGREE)[:, None]
    curve = rows[:, :, :-1, None] + share * np.diff(rows, axis=2)[:, :, :, None]
    flown = np.linalg.norm(np.diff(rows, axis=2), axis=-1).sum(axis=-1)
    labels = [(classes.label_of(at), 0.0) for at in range(len(classes.classes))]
    return LatticePieces(
        following=classes.following.astype(np.int32),
        path=position,
        curve=np.ascontiguousarray(curve),
        turn_rad=np.ascontiguousarray(turned),
        length_m=flown,
        sagitta_m=flown * np.abs(turned) / (8.0 * MOVEMENT_SAMPLES**2),
        attitude_rad=np.array(labels),
        duration_s=np.array([movement.duration_s for movement in automaton.movements]),
    )


def _path(
    automaton: MovementAutomaton, movement: Movement, roll: float, pitch: float, steps: int
) -> FloatArray:
    """[steps, 6] states along a movement from the origin, at equal times."""
    state = np.array([0.0, 0.0, 0.0, roll, pitch, 0.0])
    times = movement.duration_s * np.arange(1, steps + 1) / steps
    return np.array([automaton.predict(state, movement, float(time)) for time in times])


def _pieces(
    automaton: MovementAutomaton,
    rows: list[list[tuple[int, FloatArray]]],
    attitudes: list[tuple[float, float, Movement | None]],
) -> LatticePieces:
    following = np.array([[reached for reached, _ in row] for row in rows], dtype=np.int32)
    paths = np.array([[path for _, path in row] for row in rows])
    position = np.ascontiguousarray(paths[..., :3])
    curve = _curves(automaton, position, attitudes[: len(rows)])
    chords = np.diff(position, axis=2, prepend=0.0)
    flown = np.linalg.norm(chords, axis=-1).sum(axis=-1)
    durations = np.array([movement.duration_s for movement in automaton.movements])
    if automaton.table is None:
        speeds = np.array([movement.pace_mps for movement in automaton.movements])
        flown = np.maximum(flown, speeds * durations)
    pitches = np.array([pitch for _, pitch, _ in attitudes])
    turned = paths[:, :, -1, 5]
    bend = np.hypot(turned, paths[:, :, -1, 4] - pitches[: len(rows), None])
    return LatticePieces(
        following=following,
        path=position,
        curve=curve,
        turn_rad=np.ascontiguousarray(turned),
        length_m=np.ascontiguousarray(flown),
        # A path of length s and curvature k lies within k s^2 / 8 of its chord.
        sagitta_m=np.ascontiguousarray(flown * bend / (8.0 * MOVEMENT_SAMPLES**2)),
        attitude_rad=np.array([[roll, pitch] for roll, pitch, _ in attitudes]),
        duration_s=durations,
    )


def _curves(
    automaton: MovementAutomaton,
    position: FloatArray,
    attitudes: list[tuple[float, float, Movement | None]],
) -> FloatArray:
    """[attitudes, movements, parts, degree + 1, 3]; positions that are known are not asked for."""
    steps = position.shape[2]

    def path_of(at: int, index: int) -> PathAt:
        movement, (roll, pitch, _) = automaton.movements[index], attitudes[at]
        state = np.array([0.0, 0.0, 0.0, roll, pitch, 0.0])

        def path(shares: FloatArray) -> FloatArray:
            if len(shares) == steps + 1:
                return np.concatenate([np.zeros((1, 3)), position[at, index]])
            times = movement.duration_s * shares[1:]
            ends = [automaton.predict(state, movement, float(time))[:3] for time in times]
            return np.array([np.zeros(3), *ends])

        return path

    paths = [path_of(*at) for at in np.ndindex(position.shape[:2])]
    curves = curve_parts(paths)
    return curves.reshape(*position.shape[:2], *curves.shape[1:])


def grid_from_level(start_pitch_rad: float) -> FloatArray:
    """[3, 3] from level axes at yaw 0 into the grid, the body frame at the start pitch."""
    rotation: FloatArray = np.ascontiguousarray(compute_rotation(0.0, start_pitch_rad, 0.0).T)
    return rotation


def in_grid(vectors_level: FloatArray, rotation: FloatArray) -> FloatArray:
    """[n, 3] of the level frame in the grid frame, column by column.

    A matrix product may round rows differently, and mirror images must stay mirror images.
    """
    x, y, z = (vectors_level[:, axis, None] for axis in range(3))
    rotated: FloatArray = x * rotation[:, 0] + y * rotation[:, 1] + z * rotation[:, 2]
    return rotated
