"""Flights of studies: every level with the same worlds, in any number of processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from clearway.base.intervals import wilson
from clearway.missions.setup import prepare
from clearway.studies.campaigns.row import Outcome, judge_flight
from clearway.studies.faults.studies import ESCAPE, STUDIES, case
from clearway.studies.processes import run_in_processes

Task = tuple[str, str, float, str]
"""Study, variant, level, escapes asked for."""
Job = tuple[int, Task, tuple[int, ...]]
"""Number of the task, the task, seeds."""


@dataclass(frozen=True, slots=True)
class FaultFlight:
    """What came of one flight."""

    seed: int
    outcome: Outcome
    reached: bool
    nearest_m: float
    """To a surface: inf where nothing was near."""
    escape_mode: str
    """Escapes that were flown: where what was asked for cannot be had, others are."""

    @property
    def kept(self) -> bool:
        """Reached, and never nearer than the margin."""
        return self.outcome == "safe"

    @property
    def not_reached(self) -> bool:
        """Never nearer than the margin, but not there when its time was up."""
        return self.outcome == "not reached"

    @property
    def margin_lost(self) -> bool:
        """Nearer than the margin, without a crash."""
        return self.outcome == "margin lost"

    @property
    def crashed(self) -> bool:
        return self.outcome == "crashed"

    @property
    def margin_kept(self) -> bool:
        """Never nearer than the margin, reached or not."""
        return self.kept or self.not_reached


@dataclass(frozen=True, slots=True)
class Point:
    """One level of a variant: flights are kept, not_reached, margin_lost or crashed."""

    study: str
    variant: str
    level: float
    escape_asked: str
    flights: tuple[FaultFlight, ...]

    @property
    def escape_mode(self) -> str:
        """Escapes that were flown: the same in all flights, which have the same sensors."""
        return self.flights[0].escape_mode

    @property
    def kept(self) -> int:
        return sum(flight.kept for flight in self.flights)

    @property
    def not_reached(self) -> int:
        return sum(flight.not_reached for flight in self.flights)

    @property
    def margin_lost(self) -> int:
        return sum(flight.margin_lost for flight in self.flights)

    @property
    def crashed(self) -> int:
        return sum(flight.crashed for flight in self.flights)

    @property
    def margin_kept(self) -> int:
        return self.kept + self.not_reached

    @property
    def reached(self) -> int:
        return sum(flight.reached for flight in self.flights)

    @property
    def nearest_m(self) -> float:
        return min(flight.nearest_m for flight in self.flights)

    def interval(self, count: int) -> tuple[float, float]:
        """Wilson interval of a count of its flights."""
        return wilson(count, len(self.flights))


def fly_one(name: str, variant: str, level: float, seed: int, escape: str = ESCAPE) -> FaultFlight:
    """One flight of a study; escape: escapes asked for, as `[safety] escape`."""
    study = STUDIES[name]
    run = prepare(study.variants[variant](case(study, seed, escape), level, seed)).fly()
    return FaultFlight(
        seed,
        judge_flight(run),
        run.reached,
        float(run.nearest_surface_m.min()),
        "" if run.ways_out is None else run.ways_out.flown,
    )


def fly_studies(
    names: Sequence[str],
    seeds: Sequence[int],
    workers: int = 2,
    on_flown: Callable[[int, int], None] = lambda _done, _total: None,
    escape: str = ESCAPE,
) -> list[Point]:
    """All levels and variants of studies, by name; on_flown hears how many flights are done.

    escape: escapes asked for, as `[safety] escape`.
    """
    tasks = [
        (name, variant, level, escape)
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
    jobs: list[Job] = [(number, task, seeds) for number, task in enumerate(tasks)]
    yield from run_in_processes(_fly_level, jobs, workers)


def _fly_level(job: Job) -> tuple[int, tuple[FaultFlight, ...]]:
    number, (name, variant, level, escape), seeds = job
    return number, tuple(fly_one(name, variant, level, seed, escape) for seed in seeds)
