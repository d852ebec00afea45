"""Flights of the campaign `dead-ends`, judged by geometry of the tests' own."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.sim.baselines import CLEARWAY
from clearway.studies.campaigns.families import CAMPAIGN_FAMILIES, Case, CaseOf, make_case
from clearway.studies.campaigns.file import FamilySection, read_campaign
from solids import Solids

CAMPAIGN = "dead-ends"
BODY_M = 0.1
"""Radius that the campaign gives the vehicle."""


class Flown(NamedTuple):
    """What came of a flight."""

    nearest_m: float
    """Least distance of the vehicle's centre to any surface."""
    reached: bool
    why: str
    """The flight in a line."""


@cache
def labels() -> tuple[str, ...]:
    """Of the campaign's families."""
    return tuple(section.name for section in read_campaign(CAMPAIGN).file.family)


def mission_of(label: str, seed: int) -> MissionFile:
    """The mission of a flight of the campaign."""
    section = _section(label)
    family = CAMPAIGN_FAMILIES[section.family]
    parameters = parse_model(label, section.parameters, family.parameters)
    return family.make(CaseOf(seed, parameters, Path()))


def case_of(label: str, seed: int, **simulation: object) -> Case:
    """A flight of the campaign, with some of the simulation changed."""
    section = _section(label)
    changes = read_campaign(CAMPAIGN).file.changes_of(section, CLEARWAY)
    changes["simulation"] = changes.get("simulation", {}) | simulation
    return make_case(section.family, seed, section.parameters, changes, Path())


def solids_of(file: MissionFile) -> Solids:
    """What stands in the world of a mission."""
    return Solids.of(section.to_obstacle() for section in file.obstacle)


def _section(label: str) -> FamilySection:
    return next(one for one in read_campaign(CAMPAIGN).file.family if one.name == label)


def flown(label: str, seed: int, **simulation: object) -> Flown:
    """A flight by clearway."""
    case = case_of(label, seed, **simulation)
    run = case.setup.fly_with("clearway")
    nearest = solids_of(case.file).nearest_on_track_m(run.states[:, :3])
    return Flown(nearest, run.reached, repr(run))
