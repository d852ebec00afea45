"""Measuring a plant: every movement flown after every other, and how well that predicts.

A flight is a random round that uses each pair of movements once (an Eulerian circuit), so that
every pair comes after whatever may come before it. Some flights make the table, others, held out,
tell how far predictions are off by the number of movements since the own state estimate was known.
The tube is calibrated on all of them, each predicted by a table that the others make (split
conformal, by leaving one out), so that no flight vouches for itself. A flight on its way repeats
few pairs, which random rounds fly rarely: so the tube is never less than what holds the pair that
strays most.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.sim.plants.air import Air
from clearway.sim.plants.exact_rounds import with_exact_rounds
from clearway.sim.plants.plant import Plant, PlantKind
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.class_table import ClassTable

STEPS = 8
"""Places that are kept of a movement."""
STEP_S = 0.05
SETTLES = 5
"""Times that a movement is flown until it is trimmed."""
FARTHEST = 8
"""Movements since the own state estimate was known, up to which predictions are checked against
truth."""
NOWHERE = 0.02
"""Share of the longest movement within which a trimmed one leads nowhere."""
TUBE = 0.999
"""Share of places that lie within the tube."""
WORST = 2.576
"""Deviations of the end of the pair that strays most that lie within it: 99 % of a normal one's."""
Progress = Callable[[int, int], None]
"""(flights done, flights in all)"""


@dataclass(frozen=True)
class MeasureSettings:
    """How a plant is measured; raises ClearwayError for less than one flight of either kind."""

    flights: int = 6
    """That make the table."""
    held_out: int = 3
    """That predictions are checked against."""
    seed: int = 0
    wind_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts_mps: float = 0.0

    def __post_init__(self) -> None:
        if self.flights < 1 or self.held_out < 1:
            raise ClearwayError("measuring: at least one flight to make it and one held out")


class FlownMovement(NamedTuple):
    """One movement as it was flown."""

    previous: str
    name: str
    path: FloatArray
    """[STEPS, 4] x, y, z, yaw from its start, level, along the heading there."""
    start: FloatArray
    """[6] world frame."""
    end: FloatArray


class MeasuredPairs(NamedTuple):
    """What was measured of each (movement flown last, movement)."""

    paths: dict[tuple[str, str], FloatArray]
    """[STEPS, 4] mean way of each pair."""
    first: str
    """What counts as flown before a flight begins."""
    spread_m: dict[tuple[str, str], float]
    """Standard deviation of each pair's end."""
    spread_yaw_rad: dict[tuple[str, str], float]

    def fly(self, asked: MovementAutomaton, tube_m: tuple[float, ...] = ()) -> MovementAutomaton:
        """The automaton that flies as measured; asked: by closed form."""
        table = ClassTable.of_pairs(asked.names, self.paths, self.first, tube_m)
        return replace(asked, table=table)


@dataclass(frozen=True, eq=False)
class MeasuredPlant:
    """What measuring a plant gave."""

    automaton: MovementAutomaton
    """With the table of pairs."""
    pairs: MeasuredPairs
    samples: int
    """Movements that made it."""
    error_m: tuple[FloatArray, ...]
    """Per number of movements, from 1 on: errors of predictions, held out."""
    closed_form_m: tuple[FloatArray, ...]
    """The same by the movements' closed form."""


def measure_plant(
    kind: PlantKind,
    automaton: MovementAutomaton,
    settings: MeasureSettings | None = None,
    progress: Progress | None = None,
) -> MeasuredPlant:
    """Fly every movement after every other, and see how well the table of it predicts.

    automaton: movements by closed form, as the plant's loops are asked for them. Takes flights of
    as many movements as there are pairs.
    """
    settings = settings or MeasureSettings()
    asked = replace(automaton, table=None)
    total = settings.flights + settings.held_out
    flights = []
    for number in range(total):
        if progress is not None:
            progress(number, total)
        flights.append(_flight(kind, asked, settings, number))
    if progress is not None:
        progress(total, total)
    made, held_out = flights[: settings.flights], flights[settings.flights :]
    steady = {name: _steady(kind, asked, settings, name) for name in asked.names}
    pairs = measure_pairs(asked, [one for flight in made for one in flight], steady)
    tube_m = fit_tube(_leave_out(asked, flights, steady), max(pairs.spread_m.values(), default=0.0))
    measured = pairs.fly(asked, tube_m)
    errors = tuple(_errors(measured, held_out, moves) for moves in _lengths())
    closed = tuple(_errors(asked, held_out, moves) for moves in _lengths())
    samples = sum(len(flight) for flight in made)
    return MeasuredPlant(measured, pairs, samples, errors, closed)


def measure_pairs(
    automaton: MovementAutomaton,
    flown: Sequence[FlownMovement],
    steady: Mapping[str, FloatArray],
) -> MeasuredPairs:
    """The mean way of each pair, and the spread of its end.

    steady: [STEPS, 4] ways of movements flown on and on; those that lead nowhere stand.
    """
    by_pair: dict[tuple[str, str], list[FloatArray]] = defaultdict(list)
    for one in flown:
        by_pair[one.previous, one.name].append(one.path)
    paths = {pair: np.mean(ways, axis=0) for pair, ways in by_pair.items()}
    nowhere_m = NOWHERE * automaton.step_m
    stand = (name for name, way in steady.items() if np.abs(way[:, :3]).max() <= nowhere_m)
    paths |= {(name, name): steady[name] for name in stand}

    def spread() -> dict[tuple[str, str], float]:
        ends = {pair: np.array(ways)[:, -1, :3] for pair, ways in by_pair.items()}
        off = {pair: end - paths[pair][-1, :3] for pair, end in ends.items()}
        return {pair: float(np.sqrt((each**2).sum(axis=1).mean())) for pair, each in off.items()}

    level = [m.name for m in automaton.movements if not m.climb_mps and not m.pitch_rate_rps]
    paths = with_exact_rounds(paths, spread(), level)
    first = automaton.hold.name if automaton.hold is not None else _straight(automaton)
    turned = {
        pair: float(np.sqrt(np.mean([(way[-1, 3] - paths[pair][-1, 3]) ** 2 for way in ways])))
        for pair, ways in by_pair.items()
    }
    return MeasuredPairs(paths, first, spread(), turned)


def _steady(
    kind: PlantKind, automaton: MovementAutomaton, settings: MeasureSettings, name: str
) -> FloatArray:
    """[STEPS, 4] the way of a movement that has been flown on and on: from a trimmed state."""
    plant = kind.make(np.zeros(6), automaton.start_mps, Air(settings.wind_mps))
    movement = automaton[name]
    for _ in range(SETTLES):
        flown = _fly(plant, movement, name)
    return flown.path


def _straight(automaton: MovementAutomaton) -> str:
    level = (m.name for m in automaton.movements if not m.turn_rate_rps and not m.climb_mps)
    return next(level, automaton.names[0])


def _lengths() -> range:
    return range(1, FARTHEST + 1)


def _flight(
    kind: PlantKind, automaton: MovementAutomaton, settings: MeasureSettings, number: int
) -> list[FlownMovement]:
    rng = np.random.default_rng([settings.seed, number])
    seed = int(rng.integers(2**31))
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    plant = kind.make(start, automaton.start_mps, Air(settings.wind_mps, settings.gusts_mps, seed))
    names = round_of_pairs(automaton.names, rng)
    flown = []
    for position, name in enumerate(names):
        one = _fly(plant, automaton[name], names[position - 1])
        if position:
            flown.append(one)
    return flown


def _fly(plant: Plant, movement: Movement, previous: str) -> FlownMovement:
    steps = max(STEPS, int(np.ceil(movement.duration_s / STEP_S / STEPS - 1e-9)) * STEPS)
    plant.begin(movement)
    before = np.array(plant.state, dtype=np.float64)
    path = np.empty((STEPS, 4))
    for step in range(1, steps + 1):
        plant.step(movement.duration_s / steps)
        if step % (steps // STEPS) == 0:
            path[step // (steps // STEPS) - 1] = _see_from(before, np.array(plant.state))
    after = np.array(plant.state, dtype=np.float64)
    if not np.all(np.isfinite(after)):
        raise ClearwayError(f"measuring: the plant flew {movement.name} to {after.tolist()}")
    return FlownMovement(previous, movement.name, path, before, after)


def _see_from(start: FloatArray, state: FloatArray) -> FloatArray:
    off = state - start
    cosine, sine = np.cos(start[5]), np.sin(start[5])
    return np.array(
        [cosine * off[0] + sine * off[1], -sine * off[0] + cosine * off[1], off[2], off[5]]
    )


def round_of_pairs(names: Sequence[str], rng: np.random.Generator) -> list[str]:
    """A random round through the names in which each follows each, itself too, exactly once."""
    left = {name: list(rng.permutation(len(names))) for name in names}
    stack, done = [names[int(rng.integers(len(names)))]], []
    while stack:
        if left[stack[-1]]:
            stack.append(names[int(left[stack[-1]].pop())])
        else:
            done.append(stack.pop())
    return done[::-1]


def _errors(
    automaton: MovementAutomaton, flights: Sequence[Sequence[FlownMovement]], moves: int
) -> FloatArray:
    """How far places lie off after so many movements, predicted from the state before them."""
    table, errors = automaton.classes, []
    for flight in flights:
        for begin in range(len(flight) - moves + 1):
            chain = flight[begin : begin + moves]
            state = np.array([*chain[0].start[:3], 0.0, 0.0, chain[0].start[5]])
            if table is not None:
                state[3] = table.label_of(table.classes.index(chain[0].previous))
            for one in chain:
                state = automaton.predict(state, automaton[one.name])
            errors.append(float(np.linalg.norm(state[:3] - chain[-1].end[:3])))
    return np.array(errors)


def _leave_out(
    asked: MovementAutomaton,
    flights: Sequence[Sequence[FlownMovement]],
    steady: Mapping[str, FloatArray],
) -> tuple[FloatArray, ...]:
    """Per number of movements the errors of all flights, each by the table of all others."""
    errors: list[list[FloatArray]] = [[] for _ in _lengths()]
    for number, left_out in enumerate(flights):
        others = [one for at, flight in enumerate(flights) if at != number for one in flight]
        by_others = measure_pairs(asked, others, steady).fly(asked)
        for found, moves in zip(errors, _lengths(), strict=True):
            found.append(_errors(by_others, [left_out], moves))
    return tuple(np.concatenate(each) for each in errors)


def fit_tube(errors: Sequence[FloatArray], worst_m: float) -> tuple[float, ...]:
    """Radii that hold nearly all errors, and the next one as likely; they never shrink.

    worst_m: deviation of the end of the pair that strays most. Where its own ends would leave the
    first radius, flights of that pair over and over would: all radii grow by as much.
    """
    radii = [0.0]
    for each in errors:
        rank = min(int(np.ceil(TUBE * (len(each) + 1))), len(each))
        radii.append(max(radii[-1], float(np.sort(each)[rank - 1]) if rank else 0.0))
    first = radii[1] if len(radii) > 1 else 0.0
    grown = max(1.0, WORST * worst_m / first) if first > 0.0 else 1.0
    return tuple(grown * radius for radius in radii[1:])
