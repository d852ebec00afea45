"""Flights of studies: every level with the same worlds, in any number of processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from clearway.base.intervals import wilson
from clearway.missions.setup import prepare
from clearway.studies.faults.studies import STUDIES, case
from clearway.studies.processes import in_processes

Task = tuple[str, str, float]
"""Study, variant, level."""


@dataclass(frozen=True, slots=True)
class FaultFlight:
    """What came of one flight."""

    seed: int
    reached: bool
    kept: bool
    """Reached, and never nearer than the margin."""
    crashed: bool
    nearest_m: float
    """To a surface: inf where nothing was near."""


@dataclass(frozen=True, slots=True)
class Point:
    """One level of a variant."""

    study: str
    variant: str
    level: float
    flights: tuple[FaultFlight, ...]

    @property
    def kept(self) -> int:
        return sum(flight.kept for flight in self.flights)

    @property
    def crashed(self) -> int:
        return sum(flight.crashed for flight in self.flights)

    @property
    def reached(self) -> int:
        return sum(flight.reached for flight in self.flights)

    @property
    def nearest_m(self) -> float:
        return min(flight.nearest_m for flight in self.flights)

    def interval(self, count: int) -> tuple[float, float]:
        """Wilson interval of a count of its flights."""
        return wilson(count, len(self.flights))


def fly_one(name: str, variant: str, level: float, seed: int) -> FaultFlight:
    """One flight of a study."""
    study = STUDIES[name]
    setup = prepare(study.variants[variant](case(study, seed), level, seed))
    run = setup.fly()
    return FaultFlight(
        seed,
        run.reached,
        run.safe and run.crashed_s is None,
        run.crashed_s is not None,
        float(run.nearest_surface_m.min()),
    )


def fly_studies(
    names: Sequence[str],
    seeds: Sequence[int],
    workers: int = 2,
    on_flown: Callable[[int, int], None] = lambda _done, _total: None,
) -> list[Point]:
    """All levels and variants of studies, by name; on_flown hears how many flights are done."""
    tasks = [
        (name, variant, level)
        for name in names
        for variant in STUDIES[name].variants
        for level in STUDIES[name].levels
    ]
    done: dict[int, Point] = {}
    for number, flown in _each(tasks, tuple(seeds), workers):
        done[number] = Point(*tasks[number], flown)
        on_flown(len(done) * len(seeds), len(tasks) * len(seeds))
    return [done[number] for number in range(len(tasks))]


def _each(
    tasks: Sequence[Task], seeds: tuple[int, ...], workers: int
) -> Iterator[tuple[int, tuple[FaultFlight, ...]]]:
    """(number of the task, its flights) as they are done; one worker needs no other process."""
    numbered = [(number, task, seeds) for number, task in enumerate(tasks)]
    yield from in_processes(_numbered, numbered, workers)


def _numbered(
    job: tuple[int, Task, tuple[int, ...]],
) -> tuple[int, tuple[FaultFlight, ...]]:
    number, task, seeds = job
    return number, _fly_level(*task, seeds)


def _fly_level(
    name: str, variant: str, level: float, seeds: tuple[int, ...]
) -> tuple[FaultFlight, ...]:
    return tuple(fly_one(name, variant, level, seed) for seed in seeds)
