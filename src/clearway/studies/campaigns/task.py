"""One flight of a campaign: what is to be flown, flown, and what came of it as a row."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from clearway.base.errors import FlightRefusedError
from clearway.base.version import __version__
from clearway.sim import Run
from clearway.sim.baselines import PLANNERS, check_planner_name
from clearway.sim.pilot import Steering
from clearway.studies.campaigns.families import Case, make_case
from clearway.studies.campaigns.file import Campaign, FamilySection
from clearway.studies.campaigns.row import FlightRow, Outcome, judge_flight, measures


@dataclass(frozen=True, slots=True)
class Task:
    """A flight to be flown, wherever there is a worker."""

    campaign: str
    settings_id: str
    source: str
    """Of the campaign, as given on the command line."""
    folder: str
    """What paths in parameters are relative to."""
    label: str
    family: str
    parameters: str
    """JSON object."""
    changes: str
    """JSON object."""
    planner: str
    """Its column: a planner, or a variant of one."""
    flown_by: str
    """The planner, a user's own one with its file: workers may be in other folders."""
    seed: int

    @property
    def key(self) -> str:
        """Names the flight in its campaign."""
        return f"{self.label}/{self.planner}/{self.seed}"

    @property
    def replay(self) -> str:
        """The command that flies it again."""
        return f"clearway campaign {self.source} --replay {self.key}"


class Spent(NamedTuple):
    """What a flight took to compute."""

    wall_s: float
    cpu_s: float


def tasks_of(campaign: Campaign) -> list[Task]:
    """All flights: every seed with all families and planners before the next seed.

    So a campaign that has been stopped is a smaller one.
    """
    file = campaign.file
    tasks = []
    for number in range(max(section.seeds or file.seeds for section in file.family)):
        for section in file.family:
            if number >= (section.seeds or file.seeds):
                continue
            planners = dict.fromkeys(section.planners or file.planners)
            tasks += [
                _task(campaign, section, planner, file.first_seed + number)
                for planner in planners
                if planner not in section.leave_out
            ]
    return tasks


def _task(campaign: Campaign, section: FamilySection, planner: str, seed: int) -> Task:
    file = campaign.file
    changes = file.changes_of(section, planner)
    return Task(
        file.name,
        section.settings_id(changes),
        campaign.source,
        campaign.folder,
        section.name,
        section.family,
        json.dumps(section.parameters, sort_keys=True),
        json.dumps(changes, sort_keys=True),
        planner,
        PLANNERS.locate(file.find_flyer(planner), Path(campaign.folder)),
        seed,
    )


def fly_task(task: Task) -> FlightRow:
    """The row of a flight.

    What a planner raises is a flight that failed, since in the air nothing would catch it either.
    Errors as of `make_case`, and OwnCodeError where a user's planner is not found.
    """
    setup = case_of(task).setup
    check_planner_name(task.flown_by)
    watch = _Watch()
    try:
        run = setup.fly_with(task.flown_by)
    except FlightRefusedError as refusal:
        return _not_flown(task, "refused", str(refusal), watch.read())
    except Exception as problem:
        return _not_flown(task, "failed", f"{type(problem).__name__}: {problem}", watch.read())
    return make_flight_row(task, run, watch.read())


class _Watch:
    """Started when made."""

    def __init__(self) -> None:
        self._wall_s, self._cpu_s = time.perf_counter(), time.thread_time()

    def read(self) -> Spent:
        return Spent(time.perf_counter() - self._wall_s, time.thread_time() - self._cpu_s)


def case_of(task: Task) -> Case:
    """What a task flies in. Errors as of `make_case`."""
    return _case(task.family, task.seed, task.parameters, task.changes, task.folder)


@lru_cache(maxsize=8)
def _case(family: str, seed: int, parameters: str, changes: str, folder: str) -> Case:
    return make_case(family, seed, json.loads(parameters), json.loads(changes), Path(folder))


def make_flight_row(task: Task, run: Run[Steering], spent: Spent) -> FlightRow:
    """What came of a flight; equal for equal flights, but for how long they took to compute."""
    return FlightRow(
        **_describe_known(task),
        outcome=judge_flight(run),
        why="",
        **measures(run),
        **spent._asdict(),
    )


def _not_flown(task: Task, outcome: Outcome, why: str, spent: Spent) -> FlightRow:
    return FlightRow(**_describe_known(task), outcome=outcome, why=why, **spent._asdict())


def _describe_known(task: Task) -> dict[str, Any]:
    """What a row says of a flight before it is flown."""
    return {
        "key": task.key,
        "label": task.label,
        "planner": task.planner,
        "seed": task.seed,
        "family": task.family,
        "parameters": task.parameters,
        "changes": task.changes,
        "campaign": task.campaign,
        "settings_id": task.settings_id,
        "version": __version__,
        "replay": task.replay,
        "hidden": PLANNERS.find(task.flown_by).describe_hidden(case_of(task).setup.dangers),
    }
