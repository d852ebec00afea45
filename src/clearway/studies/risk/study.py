"""Thousands of encounters, each flown by every planner; the same for any number of processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from clearway.base.errors import ClearwayError
from clearway.sim.baselines import PLANNERS, REPORTED_TRAFFIC
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.processes import run_in_processes
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.flight import craft_of, separation_of
from clearway.studies.risk.journal import RiskJournal
from clearway.studies.risk.long_choice import locate_long
from clearway.studies.risk.outcome import RiskOutcome
from clearway.studies.risk.settings import STRAIGHT, RiskSettings

CHUNK = 10
"""Encounters that a process flies at a time."""


@dataclass(frozen=True, slots=True)
class RiskStudy:
    """Many encounters of one kind."""

    settings: RiskSettings
    planners: tuple[str, ...]
    seed: int
    outcomes: tuple[RiskOutcome, ...]
    """Ascending by number."""

    def describe_hidden(self, planner: str) -> str:
        """What of an encounter a planner cannot know, in words; empty for nothing.

        At real scale all planners hear the same reports.
        """
        if self.settings.vehicle or planner == STRAIGHT:
            return ""
        return PLANNERS.find(planner).describe_hidden([REPORTED_TRAFFIC])


def study(
    model: EncounterModel,
    planners: Sequence[str],
    numbers: Sequence[int],
    settings: RiskSettings | None = None,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
    journal: Path | None = None,
) -> RiskStudy:
    """Draw and fly the encounters of many numbers; raises ClearwayError without any.

    progress: called with how many more are done. journal: a file that outcomes are added to as they
    come; what it holds already of the same study is not flown again. InputError where it is of
    another study.
    """
    settings = settings or RiskSettings()
    report = progress or (lambda _more: None)
    if workers < 1:
        raise ClearwayError(f"workers: must be at least 1, got {workers}")
    if not numbers:
        raise ClearwayError("risk: at least one encounter is needed")
    find = locate_long if settings.vehicle else PLANNERS.locate
    flown_by = {planner: find(planner) for planner in planners}
    job = _Job(model, flown_by, settings, seed)
    if not settings.vehicle:
        # Reach sets are built and stored once, before processes load them.
        craft_of(settings)
    kept = None if journal is None else RiskJournal(journal, model, planners, settings, seed)
    done = [] if kept is None else [each for each in kept.outcomes if each.number in numbers]
    report(len(done))
    flown = {each.number for each in done}
    left = [number for number in numbers if number not in flown]
    chunks = [left[at : at + CHUNK] for at in range(0, len(left), CHUNK)]
    for some in run_in_processes(_fly, chunks, workers, _begin, (job,)):
        done += some
        if kept is not None:
            kept.add(some)
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
        encounter = sample_encounter(self.model, number, self.settings, self.seed)
        straight, _ = separation_of(encounter, STRAIGHT, self.settings)
        flown, emergencies, decision_ms = {}, {}, {}
        for planner, where in self.flown_by.items():
            flown[planner], effort = separation_of(encounter, where, self.settings)
            emergencies[planner] = effort.emergencies
            if effort.median_ms is not None:
                decision_ms[planner] = effort.median_ms
        return RiskOutcome(
            number, encounter.weight, encounter.layer, straight, flown, emergencies, decision_ms
        )


_jobs: list[_Job] = []
"""The job of this process; the model is sent to each once, not with every chunk."""


def _begin(job: _Job) -> None:
    _jobs[:] = [job]


def _fly(numbers: Sequence[int]) -> list[RiskOutcome]:
    return _jobs[0].fly(numbers)
