"""Mission files that fly the flight plan of a ground station, alone or with keys of their own."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from clearway.base.checks import geodetic_problem
from clearway.base.errors import ClearwayError, InputError, naming
from clearway.io.foreign_errors import damage_told
from clearway.io.plans.fence_file import read_fence, read_rally
from clearway.io.plans.flight_plan import FlightPlan, as_mission, reach_of_plane
from clearway.io.plans.kml_plan import read_kml, read_kmz
from clearway.io.plans.qgc_plan import read_plan
from clearway.io.plans.waypoint_file import read_waypoints
from clearway.missions.mission_sections import VehicleSection
from clearway.vehicle.scale import scale_of


class PlanFormat(NamedTuple):
    """A kind of flight plans of ground stations."""

    name: str
    suffix: str
    sign: bytes
    """Pattern of what they begin like, whatever they are called: Mission Planner says .txt too."""
    read: Callable[[Path], FlightPlan]


START = rb"\A(?:\xef\xbb\xbf)?(?:\s*#[^\n]*\n)*\s*"
"""Comments may come first."""
FORMATS = (
    PlanFormat("plan of QGroundControl", ".plan", rb'"fileType"\s*:\s*"Plan"', read_plan),
    PlanFormat(
        "KMZ, of DJI (WPML) too", ".kmz", rb"(?s)\APK\x03\x04.{26}(?:wpmz/|doc\.kml)", read_kmz
    ),
    PlanFormat("KML", ".kml", rb"<kml\b", read_kml),
    PlanFormat("QGC WPL", ".waypoints", START + rb"QGC WPL", read_waypoints),
)
"""Add a format here."""
LIMITS = (
    PlanFormat(
        "fence of ArduPilot",
        ".fen",
        START + rb"-?\d{1,2}\.\d+[ \t]+-?\d{1,3}\.\d+[ \t]*\r?\n",
        read_fence,
    ),
    PlanFormat("rally points of ArduPilot", ".ral", START + rb"RALLY[ \t]", read_rally),
)
"""Kinds of files that limit a flight, and are none."""
PLANS = tuple(one.suffix for one in FORMATS)
"""Suffixes of flight plans of ground stations."""
HEAD = 4096
Notice = Callable[[str], None]
"""Called with a sentence for the user."""


def resolve_beside(path: Path, file: str) -> str:
    """The place of a file that is given relative to a mission file."""
    return str((path.parent / file).absolute())


def plan_reader(path: Path) -> Callable[[Path], FlightPlan] | None:
    """What reads a flight plan, by suffix or content; None for any other file."""
    known = FORMATS + LIMITS
    reader = next((one.read for one in known if one.suffix == path.suffix.lower()), None)
    if reader is not None or path.suffix == ".toml" or not path.is_file():
        return reader
    with naming(path, "read"), path.open("rb") as file:
        head = file.read(HEAD)
    return next((one.read for one in known if re.search(one.sign, head)), None)


def make_planned_tables(
    path: Path,
    speed_mps: float | None,
    notice: Notice | None,
    origin: tuple[float, float, float] | None = None,
    *,
    own_goals: bool = False,
    reach_m: Callable[[float], float] = reach_of_plane,
) -> dict[str, Any]:
    """Tables of a mission file that flies a plan, at a speed in place of the plan's if it is given.

    origin, own_goals, reach_m: what the mission itself says, as of `as_mission`. notice: called
    with what was assumed or left out.
    """
    read = plan_reader(path)
    if read is None:
        raise InputError(str(path), f"no flight plan; valid: {', '.join(PLANS)}")
    with damage_told(path, "flight plan"):
        converted = as_mission(read(path), speed_mps, origin, own_goals=own_goals, reach_m=reach_m)
    if notice is not None:
        for note in converted.notes:
            notice(f"{path}: {note}")
    return converted.tables


def with_plan(path: Path, tables: dict[str, Any], notice: Notice | None) -> dict[str, Any]:
    """The tables of a mission file over those of the plan that it names."""
    mission, shared = tables.get("mission"), ("mission", "vehicle", "grid", "safety")
    if not isinstance(mission, dict) or not isinstance(mission.get("plan"), str):
        return tables
    if not all(isinstance(tables.get(name, {}), dict) for name in shared):
        return tables
    place = Path(resolve_beside(path, mission["plan"]))
    if plan_reader(place) is None:
        raise InputError(
            str(path), f"mission.plan: suffix {place.suffix!r}; valid: {', '.join(PLANS)}"
        )
    speed = tables.get("vehicle", {}).get("speed_mps")
    planned = make_planned_tables(
        place,
        speed if isinstance(speed, (int, float)) else None,
        notice,
        _place_of(mission.get("origin_geodetic")),
        own_goals=bool(mission.get("waypoints_m")),
        reach_m=_reach_by_speed(mission.get("reach_radius_m"), tables.get("vehicle", {})),
    )
    own = {key: value for key, value in mission.items() if key != "plan"}
    merged = {**planned, **tables}
    for name in shared:
        merged[name] = {
            **planned.get(name, {}),
            **(own if name == "mission" else tables.get(name, {})),
        }
    if isinstance(tables.get("obstacle", []), list):
        merged["obstacle"] = [*planned["obstacle"], *tables.get("obstacle", [])]
    return merged


def _reach_by_speed(stated: object, vehicle: Mapping[str, Any]) -> Callable[[float], float]:
    """The reach radius of a mission, by speed: stated, or as suits its vehicle."""
    if isinstance(stated, (int, float)):
        return lambda _speed_mps: float(stated)

    def of_vehicle(speed_mps: float) -> float:
        try:
            section = VehicleSection.model_validate({**vehicle, "speed_mps": speed_mps})
            return scale_of(section.to_automaton()).reach_radius_m
        except (ValidationError, ClearwayError):  # Told where the whole mission is checked.
            return reach_of_plane(speed_mps)

    return of_vehicle


def _place_of(stated: object) -> tuple[float, float, float] | None:
    """Latitude, longitude and height as a mission states them; None where it states no place."""
    if not isinstance(stated, list) or len(stated) != 3:
        return None
    if not all(isinstance(value, (int, float)) for value in stated):
        return None
    latitude, longitude, height = map(float, stated)
    if geodetic_problem(latitude, longitude, height):
        return None
    return latitude, longitude, height
