"""Families of cases by name: from a seed and parameters to a flight that any planner can fly."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from clearway.base.errors import ClearwayError, InputError
from clearway.base.suggest import did_you_mean
from clearway.io.maps.column_table import read_column_table
from clearway.io.public_data import at_hand, where_from
from clearway.io.toml import Section, parse_model
from clearway.missions.lidar_section import PATTERN_KEYS
from clearway.missions.mission_file import (
    AbsentPublicFileError,
    MissionFile,
    list_built_in_missions,
    read_mission_file,
)
from clearway.missions.mission_maps import mission_maps
from clearway.missions.mission_world import mission_world
from clearway.missions.sections import Point, Positive
from clearway.missions.setup import FlightSetup, prepare
from clearway.missions.world_file import mission_of
from clearway.obstacles.columns import Columns
from clearway.sim.world_parts import MadeWorld, leg, scatter_ends
from clearway.studies.campaigns.conflicts import KINDS, ConflictParameters, conflict
from clearway.studies.campaigns.made_worlds import MADE, MadeFamily, StartParameters
from clearway.studies.campaigns.peer_worlds import (
    PEER_WORLDS,
    MovingParameters,
    moving_mission,
    with_moving,
)
from clearway.studies.campaigns.sampled import sample_mission, with_intruder

PLACES = Path(__file__).parents[1] / "examples" / "missions"
"""The surveyed places of the examples: a wheel has them here, a checkout where they stand."""


class AbsentDataError(ClearwayError):
    """Files that a case needs are not there."""


class MissionParameters(Section):
    """Of `mission`."""

    mission: str
    """Its name: the seed is that of noise and drop-outs."""


class PlaceParameters(StartParameters):
    """Of `place`."""

    mission: str
    """A mission file, relative to the campaign's: the seed is that of noise and drop-outs."""


class TableParameters(StartParameters):
    """Of `table`."""

    file: str
    """A table of columns (.csv), relative to the campaign's file: x, y, radius, height."""
    start_m: Point
    goal_m: Point
    heights_m: Annotated[tuple[float, float], Field(strict=False)] | None = None
    """Lowest and highest height to fly at; default: any."""
    corridor_m: Positive | None = None
    """Half the width of what is flown in about the straight way; default: any."""


class SampledParameters(Section):
    """Of `sampled`."""

    model: str | None = None
    """File of an encounter model, relative to the campaign's; default: a small made-up one."""


@dataclass(frozen=True, slots=True)
class CaseOf:
    """What a case is made from."""

    seed: int
    parameters: Any
    """A section of the family's own kind."""
    folder: Path
    """What paths are relative to."""


@dataclass(frozen=True, slots=True)
class Family:
    """Cases of one kind."""

    about: str
    parameters: type[Section]
    make: Callable[[CaseOf], MissionFile]
    """Raises AbsentDataError where files that it reads are not there."""
    finish: Callable[[FlightSetup, CaseOf], FlightSetup] = field(default=lambda setup, _: setup)
    """What a mission file cannot say, such as traffic that follows recorded tracks."""


@dataclass(frozen=True, eq=False)
class Case:
    """A flight, ready for any planner."""

    file: MissionFile
    """What `clearway fly` would fly."""
    setup: FlightSetup


def _make(family: MadeFamily) -> Callable[[CaseOf], MissionFile]:
    return lambda case: family.mission(case.seed, case.parameters)


def _mission(case: CaseOf) -> MissionFile:
    return _read_built_in(case.parameters.mission).with_values("simulation", seed=case.seed)


@lru_cache(maxsize=8)
def _read_built_in(name: str) -> MissionFile:
    """A mission that comes with clearway, read once for all seeds."""
    if name not in list_built_in_missions():
        known = ", ".join(sorted(list_built_in_missions()))
        near = did_you_mean(name, list_built_in_missions())
        raise InputError("mission", f"{name!r}{near}: there are {known}; family place takes files")
    return read_mission_file(name)


def _place(case: CaseOf) -> MissionFile:
    path = case.folder / case.parameters.mission
    if not path.exists() and (PLACES / path.name).exists():
        path = PLACES / path.name
    if not path.exists():
        raise AbsentDataError(f"no file {case.parameters.mission}{where_from(path)}")
    try:
        file = read_mission_file(str(path))
    except AbsentPublicFileError as error:
        raise AbsentDataError(str(error)) from error
    named = [file.point_cloud.file] if file.point_cloud else []
    named += [file.columns.file] if file.columns and file.columns.file else []
    named += file.map.files if file.map else ()
    absent = [name for name in named if not Path(name).exists()]
    if absent:
        needed = ", ".join(Path(a).name for a in absent)
        raise AbsentDataError(f"{case.parameters.mission} needs {needed}{where_from(absent[0])}")
    return _from_anywhere(file, case).with_values("simulation", seed=case.seed)


def _table(case: CaseOf) -> MissionFile:
    given = case.parameters
    path = at_hand(case.folder / given.file)
    if not path.exists():
        raise AbsentDataError(f"no file {given.file}{where_from(path)}")
    world = Columns(read_column_table(path), ground_m=0.0)
    mission = leg(f"{path.stem}-{case.seed}", given.start_m, given.goal_m)
    if given.ends is not None:
        mission = scatter_ends(mission, world, given.heights_m, given.ends, case.seed)
    made = MadeWorld(world, mission, given.heights_m, given.corridor_m)
    return mission_of(made, case.seed)


def _from_anywhere(file: MissionFile, case: CaseOf) -> MissionFile:
    """The mission with start and goals moved at random, where the parameters ask for it."""
    ends = case.parameters.ends
    if ends is None:
        return file
    there = mission_world(file, mission_maps(file)).there
    rules = file.rules
    heights = None
    if rules.floor_m is not None and rules.ceiling_m is not None:
        heights = rules.floor_m, rules.ceiling_m
    mission = scatter_ends(file.to_mission(), there, heights, ends, case.seed)
    waypoints = tuple(map(tuple, mission.waypoints_m.tolist()))
    start = mission.start
    return file.with_values("mission", waypoints_m=waypoints).with_values(
        "vehicle",
        position_m=start.position_m,
        attitude_deg=np.degrees(start.attitude_rad),
    )


def _conflict(kind: str) -> Callable[[CaseOf], MissionFile]:
    return lambda case: conflict(kind, case.seed, case.parameters)


def _model(case: CaseOf) -> Path | None:
    name = case.parameters.model
    path = None if name is None else at_hand(case.folder / name)
    if path is not None and not path.exists():
        raise AbsentDataError(f"no file {name}{where_from(path)}")
    return path


def _sample(case: CaseOf) -> MissionFile:
    return sample_mission(case.seed, _model(case))


def _with_intruder(setup: FlightSetup, case: CaseOf) -> FlightSetup:
    return with_intruder(setup, case.seed, _model(case))


def _about(function: Callable[..., Any]) -> str:
    return (function.__doc__ or "").strip().splitlines()[0]


CAMPAIGN_FAMILIES: Mapping[str, Family] = MappingProxyType(
    {
        **{
            name: Family(_about(made.make), made.parameters, _make(made))
            for name, made in {**MADE, **PEER_WORLDS}.items()
        },
        "moving": Family(
            "Obstacles on closed ways among pillars and bars; sensors alone tell of them.",
            MovingParameters,
            lambda case: moving_mission(case.seed, case.parameters),
            lambda setup, case: with_moving(setup, case.seed, case.parameters),
        ),
        "mission": Family("A mission that comes with clearway.", MissionParameters, _mission),
        "place": Family(
            "A mission file of your own, such as a surveyed place.", PlaceParameters, _place
        ),
        "table": Family(
            "A table of columns, such as the obstacle field of a benchmark.",
            TableParameters,
            _table,
        ),
        **{
            kind: Family(_about(make), ConflictParameters, _conflict(kind))
            for kind, make in KINDS.items()
        },
        "sampled": Family(
            "Traffic drawn from an encounter model; the margin keeps near mid-air collisions off.",
            SampledParameters,
            _sample,
            _with_intruder,
        ),
    }
)
"""Add a family here to fly it in campaigns."""


def make_case(
    family: str,
    seed: int,
    parameters: Mapping[str, Any],
    changes: Mapping[str, Mapping[str, Any]],
    folder: Path,
) -> Case:
    """A case of a known family.

    Raises AbsentDataError where data are not there, InputError for parameters and changes that
    cannot be.
    """
    known = CAMPAIGN_FAMILIES[family]
    section = parse_model(f"{family}: parameters", parameters, known.parameters)
    case = CaseOf(seed, section, folder)
    file = _change(known.make(case), changes, folder)
    # All seeds of a mission share what is the same: reach sets, sensors, surveyed worlds.
    shared = _prepare(file.with_values("simulation", seed=0))
    setup = replace(shared, simulation=replace(shared.simulation, seed=file.simulation.seed))
    return Case(file, known.finish(setup, case))


@lru_cache(maxsize=8)
def _prepare(file: MissionFile) -> FlightSetup:
    return prepare(file)


def _change(
    file: MissionFile, changes: Mapping[str, Mapping[str, Any]], folder: Path
) -> MissionFile:
    """The mission with keys of its tables changed, checked like a file."""
    if not changes:
        return file
    # Only keys that were given: what suits one kind of vehicle is refused for another.
    tables = file.model_dump(exclude_unset=True)
    for table, values in changes.items():
        # Every sensor, intruder or obstacle alike.
        if isinstance(getattr(file, table), tuple):
            old = [one.model_dump(exclude_unset=True) for one in getattr(file, table)]
            tables[table] = [_change_keys(one, values) for one in old]
        else:
            tables[table] = {**(tables.get(table) or {}), **values}
    return parse_model("changes", tables, MissionFile, folder)


def _change_keys(old: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of one table of several with others over them; of a sensor, one way to say its beams."""
    ways = [way for way in PATTERN_KEYS if values.keys() & set(way)]
    left_out = set(chain(*PATTERN_KEYS)) if ways else set()
    return {key: value for key, value in old.items() if key not in left_out} | dict(values)
