"""Thousands of encounters, each flown by every planner; the same for any number of processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from clearway.base.errors import ClearwayError
from clearway.sim.baselines import PLANNERS
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.processes import in_processes
from clearway.studies.risk.encounter import draw_encounter
from clearway.studies.risk.flight import STRAIGHT, Separation, craft_of, separation_of
from clearway.studies.risk.settings import RiskSettings

CHUNK = 10
"""Encounters that a process flies at a time."""


@dataclass(frozen=True, slots=True)
class RiskOutcome:
    """What came of one encounter, without avoidance and with each planner."""

    number: int
    weight: float
    layer: int
    straight: Separation
    flown: Mapping[str, Separation]
    """By planner."""
    emergencies: Mapping[str, int]
    """Decisions in which nothing kept the margin, by planner."""

    def of(self, planner: str) -> Separation:
        """Of a planner, or of straight flight."""
        return self.straight if planner == STRAIGHT else self.flown[planner]


@dataclass(frozen=True, slots=True)
class RiskStudy:
    """Many encounters of one kind."""

    settings: RiskSettings
    planners: tuple[str, ...]
    seed: int
    outcomes: tuple[RiskOutcome, ...]
    """Ascending by number."""


def study(
    model: EncounterModel,
    planners: Sequence[str],
    numbers: Sequence[int],
    settings: RiskSettings | None = None,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> RiskStudy:
    """Draw and fly the encounters of many numbers; raises ClearwayError without any.

    progress: called with how many more are done.
    """
    settings = settings or RiskSettings()
    report = progress or (lambda _more: None)
    if workers < 1:
        raise ClearwayError(f"workers: must be at least 1, got {workers}")
    if not numbers:
        raise ClearwayError("risk: at least one encounter is needed")
    flown_by = {planner: PLANNERS.located(planner) for planner in planners}
    job = _Job(model, flown_by, settings, seed)
    # Reach sets are built and stored once, before processes load them.
    craft_of(settings)
    done: list[RiskOutcome] = []
    chunks = [numbers[at : at + CHUNK] for at in range(0, len(numbers), CHUNK)]
    for some in in_processes(_fly, chunks, workers, _begin, (job,)):
        done += some
        report(len(some))
    ordered = tuple(sorted(done, key=lambda each: each.number))
    return RiskStudy(settings, tuple(planners), seed, ordered)


@dataclass(frozen=True, slots=True)
class _Job:
    """What all encounters of a study share."""

    model: EncounterModel
    flown_by: Mapping[str, str]
    """Planners as asked for, and where workers find those of users."""
    settings: RiskSettings
    seed: int

    def fly(self, numbers: Sequence[int]) -> list[RiskOutcome]:
        return [self._outcome(number) for number in numbers]

    def _outcome(self, number: int) -> RiskOutcome:
        encounter = draw_encounter(self.model, number, self.settings, self.seed)
        straight, _ = separation_of(encounter, STRAIGHT, self.settings)
        flown, emergencies = {}, {}
        for planner, where in self.flown_by.items():
            flown[planner], emergencies[planner] = separation_of(encounter, where, self.settings)
        return RiskOutcome(number, encounter.weight, encounter.layer, straight, flown, emergencies)


_jobs: list[_Job] = []
"""The job of this process; the model is sent to each once, not with every chunk."""


def _begin(job: _Job) -> None:
    _jobs[:] = [job]


def _fly(numbers: Sequence[int]) -> list[RiskOutcome]:
    return _jobs[0].fly(numbers)
