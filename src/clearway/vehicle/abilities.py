"""What the movements of an automaton amount to: whether they stop, turn, climb, and how steeply.

Told by what is predicted of them from level flight, or as measured. `MovementAutomaton` has each of
these as a property, worked out once.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.movement import Movement

PITCH_TOLERANCE_RAD = 1e-9
"""Four times Up lands on a limit of four steps in spite of rounding."""
MOST_START_PITCHES = 25
_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])


class Moving(Protocol):
    """What is asked of an automaton; what each means, `MovementAutomaton` says."""

    @property
    def movements(self) -> tuple[Movement, ...]: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def classes(self) -> ClassTable | None: ...
    @property
    def pitch_limit_rad(self) -> float | None: ...
    @property
    def forbidden(self) -> frozenset[tuple[str, str]]: ...
    @property
    def fastest_mps(self) -> float: ...
    @property
    def stands(self) -> tuple[bool, ...]: ...
    @property
    def keeps_attitude(self) -> bool: ...
    @property
    def level_ends(self) -> FloatArray: ...
    @property
    def step_m(self) -> float: ...
    def predict(self, state: npt.ArrayLike, movement: Movement) -> FloatArray: ...
    def is_allowed(self, state: npt.ArrayLike, movement: Movement) -> bool: ...


def level_ends(automaton: Moving) -> FloatArray:
    """[n, 6] where the movements end that may be flown from level flight; as measured, those that
    are flown on and on."""
    level, classes, movements = np.zeros(6), automaton.classes, automaton.movements
    if classes is not None:
        steady = [(classes.label_of(at), movements[m]) for at, m in classes.steady.tolist()]
        measured = [automaton.predict([0.0, 0.0, 0.0, roll, 0.0, 0.0], m) for roll, m in steady]
        return np.array(measured) * [1.0, 1.0, 1.0, 0.0, 1.0, 1.0]
    ends = [automaton.predict(level, m) for m in movements if automaton.is_allowed(level, m)]
    return np.array(ends).reshape(-1, 6)


def mirror_images(automaton: Moving) -> tuple[int, ...] | None:
    """Per movement the index of its mirror image left to right; None if one has none."""
    if automaton.classes is not None:
        return None
    level, movements = np.zeros(6), automaton.movements
    ends = np.array([automaton.predict(level, movement) for movement in movements])
    durations = np.array([movement.duration_s for movement in movements])
    farthest = float(np.abs(ends[:, :3]).max()) or 1.0
    near = 1e-9 * np.array([farthest] * 3 + [1.0] * 3)
    images = []
    for end, duration in zip(ends, durations, strict=True):
        same = np.all(np.abs(ends - end * _MIRROR) < near, axis=1) & (durations == duration)
        if not np.any(same):
            return None
        images.append(int(np.argmax(same)))
    return tuple(images)


def find_standing(automaton: Moving) -> tuple[bool, ...]:
    """Per movement whether neither place nor roll and pitch change, and it may follow itself."""
    forbidden = automaton.forbidden
    if automaton.classes is not None:
        return tuple(np.any(automaton.classes.stands, axis=0).tolist())
    level = np.zeros(6)
    return tuple(
        not np.any(automaton.predict(level, movement)[:5])
        and automaton.is_allowed(level, movement)
        and (movement.name, movement.name) not in forbidden
        for movement in automaton.movements
    )


def keeps_attitude(automaton: Moving) -> bool:
    """Whether no movement changes roll and pitch, nor goes elsewhere for them."""
    if automaton.classes is not None:
        return False
    level, tilted = np.zeros(6), np.array([0.0, 0.0, 0.0, 0.3, -0.2, 0.0])
    return all(
        bool(
            np.array_equal(
                automaton.predict(tilted, movement) - tilted, automaton.predict(level, movement)
            )
        )
        for movement in automaton.movements
    )


def spot_turn_m_per_rad(automaton: Moving) -> float:
    """Way that could have been flown at full speed in the time of a turn on the spot; inf without
    any."""
    rates = [
        abs(movement.yaw_rate_rps)
        for movement, stands in zip(automaton.movements, automaton.stands, strict=True)
        if stands and movement.yaw_rate_rps
    ]
    return automaton.fastest_mps / max(rates) if rates else float("inf")


def turning_radius_m(automaton: Moving) -> float:
    """Smallest v / omega of the level turns, or as measured; inf when nothing turns in flight."""
    if automaton.classes is not None:
        return automaton.classes.turning_radius_m
    radii = [
        movement.speed_mps / movement.turn_rate_rps
        for movement in automaton.movements
        if movement.speed_mps > 0.0 and movement.pitch_rate_rps == 0.0 and movement.yaw_rate_rps
    ]
    return min(radii, default=float("inf"))


def stopping_m(automaton: Moving) -> float:
    """Way to a stop from the greatest speed, of classes of speed, after one movement at it; else
    0."""
    classes = automaton.classes
    if classes is None or not classes.has_speeds:
        return 0.0
    then = classes.speed_mps[np.maximum(classes.following, 0)]
    lost = np.where(classes.following >= 0, classes.speed_mps[:, None] - then, 0.0)
    lasts_s, fastest = automaton.movements[0].duration_s, automaton.fastest_mps
    brakes_mps2 = float(lost.max()) / lasts_s
    return fastest * lasts_s + 0.5 * fastest**2 / brakes_mps2


def stays_level(automaton: Moving) -> bool:
    """Whether no movement leads out of level flight."""
    return bool(np.all(np.abs(automaton.level_ends[:, 2:5]) <= PITCH_TOLERANCE_RAD))


def climbs_ahead(automaton: Moving) -> bool:
    """Whether some movement climbs by itself, and each that does leads ahead."""
    if not automaton.keeps_attitude and automaton.classes is None:
        return False
    ends = automaton.level_ends
    climbing = np.abs(ends[:, 2]) > 0.02 * automaton.step_m
    ahead_m = np.hypot(ends[climbing, 0], ends[climbing, 1])
    return bool(climbing.any() and np.all(ahead_m > 0.1 * automaton.step_m))


def steepest_rad(automaton: Moving) -> float | None:
    """Steepest way up or down: the pitch limit, or a movement that climbs steeper by itself; None
    without a limit."""
    if automaton.pitch_limit_rad is None:
        return None
    ends = automaton.level_ends
    level_m = np.hypot(ends[:, 0], ends[:, 1])
    # Straight up takes the time of a way so steep that it climbs as fast at full speed.
    beside = np.sqrt(np.maximum(automaton.step_m**2 - ends[:, 2] ** 2, 0.0))
    level_m = np.where(level_m > 0.0, level_m, beside)
    climbs = np.arctan2(np.abs(ends[:, 2]), level_m)
    return max(automaton.pitch_limit_rad, float(climbs.max(initial=0.0)))


def step_m(automaton: Moving) -> float:
    """Longest way from start to end of a movement in level flight, whatever came before it."""
    level, classes = np.zeros(6), automaton.classes
    if classes is not None:
        ways = np.linalg.norm(classes.paths[..., -1, :3], axis=-1)
        return float(np.where(classes.following >= 0, ways, 0.0).max())
    return max(
        float(np.linalg.norm(automaton.predict(level, movement)[:3]))
        for movement in automaton.movements
    )


def start_pitches_rad(automaton: Moving) -> tuple[float, ...]:
    """Pitches that chains of movements reach from level flight, ascending; 25 that spread over the
    limits where there are more."""
    if automaton.pitch_limit_rad is None:
        return (0.0,)
    level = np.zeros(6)
    steps = [float(automaton.predict(level, movement)[4]) for movement in automaton.movements]
    limit = automaton.pitch_limit_rad + PITCH_TOLERANCE_RAD
    found, fresh = {0: 0.0}, [0.0]
    while fresh and len(found) <= MOST_START_PITCHES:
        reached = {_key(pitch + step): pitch + step for pitch in fresh for step in steps}
        reached = {key: at for key, at in reached.items() if abs(at) <= limit}
        fresh = [at for key, at in reached.items() if key not in found]
        found = reached | found
    if len(found) > MOST_START_PITCHES:
        spread = np.linspace(
            -automaton.pitch_limit_rad, automaton.pitch_limit_rad, MOST_START_PITCHES
        )
        return tuple(float(pitch) for pitch in spread)
    return tuple(sorted(found.values()))


def _key(angle_rad: float) -> int:
    """Equal for angles that differ by rounding only."""
    return round(angle_rad * 1e9)
