"""Mission files that fly the flight plan of a ground station, alone or with keys of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from clearway.errors import InputError
from clearway.io.flight_plan import as_mission
from clearway.io.qgc_plan import read_plan
from clearway.io.waypoint_file import read_waypoints

PLANS = (".plan", ".waypoints")
"""Suffixes of flight plans of ground stations."""
Notice = Callable[[str], None]
"""Called with a sentence for the user."""


def beside(path: Path, file: str) -> str:
    """The place of a file that is given relative to a mission file."""
    return str((path.parent / file).absolute())


def planned_tables(path: Path, speed_mps: float | None, notice: Notice | None) -> dict[str, Any]:
    """Tables of a mission file that flies a plan, at a speed in place of the plan's if it is given.

    notice: called with what was assumed or left out.
    """
    plan = read_plan(path) if path.suffix == ".plan" else read_waypoints(path)
    converted = as_mission(plan, speed_mps)
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
    place = Path(beside(path, mission["plan"]))
    if place.suffix not in PLANS:
        raise InputError(
            str(path), f"mission.plan: suffix {place.suffix!r}; valid: {', '.join(PLANS)}"
        )
    speed = tables.get("vehicle", {}).get("speed_mps")
    planned = planned_tables(place, speed if isinstance(speed, (int, float)) else None, notice)
    own = {key: value for key, value in mission.items() if key != "plan"}
    merged = {**planned, **tables}
    for name in shared:
        merged[name] = {**planned[name], **(own if name == "mission" else tables.get(name, {}))}
    if isinstance(tables.get("obstacle", []), list):
        merged["obstacle"] = [*planned["obstacle"], *tables.get("obstacle", [])]
    return merged
