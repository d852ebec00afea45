"""Measuring a copter with inertia: how far it strays from its plan, class by class.

A flight is a random round that flies every movement in every class of motion. The plant is led by
the references of the plan, which go on without a break from movement to movement; what it is off by
is looked at in equal parts of each movement. The tube of a speed holds nearly all that was seen
from it on (split conformal); flights held out tell how much of them it holds.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.sim.plants.air import Air
from clearway.sim.plants.measuring import STEP_S, MeasureSettings, Progress
from clearway.sim.plants.plant import LedPlant, PlantKind, leading
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.reference import Reference

TUBE = 0.99
"""Share of own state estimates that lie within the tube."""
Edge = tuple[int, int]
"""Class and movement."""


@dataclass(frozen=True, eq=False)
class MeasuredCopter:
    """What measuring a copter gave: its automaton with the tube, and how well that holds."""

    automaton: MovementAutomaton
    speeds_mps: FloatArray
    """[speeds] of the classes, ascending."""
    tube_m: FloatArray
    """[speeds] that holds nearly all states of movements that begin at a speed."""
    inside: FloatArray
    """[speeds] share of the states held out that lies within it."""
    mean_off_m: FloatArray
    """[speeds] greatest mean deviation of a movement's end: what repeats."""
    samples: int
    """Movements that made it."""


def measure_copter(
    kind: PlantKind,
    automaton: MovementAutomaton,
    settings: MeasureSettings | None = None,
    progress: Progress | None = None,
) -> MeasuredCopter:
    """Fly every movement in every class, and see how far the plant strays from what is asked.

    automaton: with inertia. Raises ClearwayError for one without, and for a plant that follows no
    reference.
    """
    classes = automaton.classes
    if classes is None or not classes.has_speeds:
        raise ClearwayError("measuring by classes: the automaton has no inertia")
    settings = settings or MeasureSettings()
    total, flights = settings.flights + settings.held_out, []
    for number in range(total):
        if progress is not None:
            progress(number, total)
        flights.append(_flight(kind, automaton, classes, settings, number))
    if progress is not None:
        progress(total, total)
    made, held_out = flights[: settings.flights], flights[settings.flights :]
    speeds = np.unique(classes.speed_mps)
    by_speed = [_off_at(classes, made, speed) for speed in speeds]
    tube = np.array([_conformal(np.linalg.norm(off, axis=2).ravel()) for _, off in by_speed])
    inside = []
    for speed, radius in zip(speeds, tube, strict=True):
        _, off = _off_at(classes, held_out, speed)
        inside.append(float((np.linalg.norm(off, axis=2) <= radius).mean()))
    means = np.array([_greatest_mean(edges, off[:, -1]) for edges, off in by_speed])
    samples = sum(len(flight) for flight in made)
    measured = with_tube(automaton, speeds, tube)
    return MeasuredCopter(measured, speeds, tube, np.array(inside), means, samples)


def with_tube(
    automaton: MovementAutomaton, speeds_mps: FloatArray, tube_m: FloatArray
) -> MovementAutomaton:
    """An automaton with inertia whose tube is that of the nearest speed [speeds]."""
    assert automaton.classes is not None  # It has inertia.
    off = np.abs(automaton.classes.speed_mps[:, None] - speeds_mps)
    own = tube_m[off.argmin(axis=1)]
    return replace(automaton, table=replace(automaton.classes, class_tube_m=own))


def round_of_classes(following: IntArray, rng: np.random.Generator) -> list[Edge]:
    """A random round that flies every movement in every class where it can be flown.

    following: [classes, movements] class at the end, or -1. Every one is flown once; some are flown
    again where classes are left more often than they are entered. Raises ClearwayError where some
    class does not lead back.
    """
    edges = [(int(at), int(m)) for at, m in np.argwhere(following >= 0)]
    left: list[list[Edge]] = [[] for _ in following]
    for at, m in edges:
        left[at].append((at, m))
    surplus = np.zeros(len(following), dtype=np.int64)
    for at, m in edges:
        surplus[following[at, m]] += 1
        surplus[at] -= 1
    for at in range(len(following)):
        while surplus[at] > 0:  # Entered more often than left: it is left once more.
            way = _way_to(following, at, lambda there: bool(surplus[there] < 0))
            for edge in way:
                left[edge[0]].append(edge)
            surplus[at] -= 1
            surplus[following[way[-1]]] += 1
    for each in left:
        rng.shuffle(each)
    stack: list[tuple[int, Edge | None]] = [(edges[int(rng.integers(len(edges)))][0], None)]
    done: list[Edge] = []
    while stack:
        at, came_by = stack[-1]
        if left[at]:
            edge = left[at].pop()
            stack.append((int(following[edge]), (int(edge[0]), int(edge[1]))))
        else:
            stack.pop()
            if came_by is not None:
                done.append(came_by)
    return done[::-1]


def _way_to(following: IntArray, start: int, there: Callable[[int], bool]) -> list[Edge]:
    """The fewest movements from a class to one that is asked for."""
    came: dict[int, Edge | None] = {start: None}
    waiting = deque([start])
    while waiting:
        at = waiting.popleft()
        if there(at):
            way: list[Edge] = []
            edge = came[at]
            while edge is not None:
                way.append(edge)
                edge = came[edge[0]]
            return way[::-1]
        for m in np.flatnonzero(following[at] >= 0).tolist():
            end = int(following[at, m])
            if end not in came:
                came[end] = (at, m)
                waiting.append(end)
    raise ClearwayError("measuring by classes: some class of motion does not lead back")


def _flight(
    kind: PlantKind,
    automaton: MovementAutomaton,
    classes: ClassTable,
    settings: MeasureSettings,
    number: int,
) -> list[tuple[Edge, FloatArray]]:
    """Every movement with [parts, 3] what the plant was off by, in axes along the heading."""
    rng = np.random.default_rng([settings.seed, number])
    seed, yaw = int(rng.integers(2**31)), float(rng.uniform(-np.pi, np.pi))
    chain = round_of_classes(classes.following, rng)
    at_rest = next(n for n, edge in enumerate(chain) if edge[0] == classes.first)
    chain = chain[at_rest:] + chain[:at_rest]
    state = np.array([0.0, 0.0, 0.0, classes.label_of(classes.first), 0.0, yaw])
    air = Air(settings.wind_mps, settings.gusts_mps, seed)
    plant = leading(kind.make(state * [1, 1, 1, 0, 0, 1], 0.0, air))
    flown = []
    for edge, then in zip(chain, [*chain[1:], chain[0]], strict=True):
        off, state = _lead(plant, automaton, state, (edge, then))
        flown.append((edge, off))
    return flown


def _lead(
    plant: LedPlant, automaton: MovementAutomaton, state: FloatArray, pair: tuple[Edge, Edge]
) -> tuple[FloatArray, FloatArray]:
    """What a plant was off by in a movement, before another one, and the planned state after."""
    movement, then = (automaton.movements[m] for _, m in pair)
    end = automaton.predict(state, movement)

    def ask(later_s: float) -> Reference:
        if later_s < movement.duration_s:
            return Reference.of(automaton, state, movement, later_s)
        return Reference.of(automaton, end, then, later_s - movement.duration_s)

    plant.follow(ask)
    steps = int(np.ceil(movement.duration_s / STEP_S - 1e-9))
    off = np.empty((steps, 3))
    for step in range(1, steps + 1):
        plant.step(movement.duration_s / steps)
        planned = Reference.of(automaton, state, movement, movement.duration_s * step / steps)
        off[step - 1] = plant.state[:3] - planned.position_m
    if not np.all(np.isfinite(off)):
        raise ClearwayError(f"measuring: the plant flew {movement.name} to nowhere")
    cosine, sine = np.cos(state[5]), np.sin(state[5])
    turned = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return off @ turned, end


def _off_at(
    classes: ClassTable, flights: list[list[tuple[Edge, FloatArray]]], speed_mps: float
) -> tuple[list[Edge], FloatArray]:
    """The movements that begin at a speed, and [n, parts, 3] what they were off by."""
    found = [
        one for flight in flights for one in flight if classes.speed_mps[one[0][0]] == speed_mps
    ]
    return [edge for edge, _ in found], np.array([off for _, off in found])


def _conformal(errors: FloatArray) -> float:
    rank = min(int(np.ceil(TUBE * (len(errors) + 1))), len(errors))
    return float(np.sort(errors)[rank - 1])


def _greatest_mean(edges: list[Edge], ends: FloatArray) -> float:
    by_edge: dict[Edge, list[FloatArray]] = {}
    for edge, end in zip(edges, ends, strict=True):
        by_edge.setdefault(edge, []).append(end)
    return max(float(np.linalg.norm(np.mean(each, axis=0))) for each in by_edge.values())
