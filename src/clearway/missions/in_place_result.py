"""The JSON of an encounter flown in place of one of its aircraft."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from clearway.base.provenance import provenance
from clearway.io.json_values import round_number

if TYPE_CHECKING:
    from clearway.missions.in_place import InPlaceFlight, Way
    from clearway.sim import Run
    from clearway.traffic.recorded import Aircraft
    from clearway.traffic.recorded.approach import Approach
    from clearway.traffic.recorded.report import Clock


def in_place_result(found: InPlaceFlight, clock: Clock) -> dict[str, Any]:
    """Both aircraft, and the closest points of the three ways; times since the flight's start."""
    part, file = found.part, found.file
    closest = part.from_s + part.closest_s
    return {
        "mission": file.mission.name,
        "recording": file.traffic.recording,
        "own": _aircraft(part.own),
        "other": _aircraft(part.other),
        "from_s": round_number(part.from_s),
        "from": _utc(part.from_s, clock),
        "closest": _utc(closest, clock),
        "closest_s": round_number(part.closest_s),
        "speed_mps": file.vehicle.speed_mps,
        "turning_radius_m": round_number(found.setup.planner.automaton.turning_radius_m),
        "margin_m": found.run.safety_margin_m,
        "keep_m": round_number(found.keep_m),
        "recorded": _way(found.recorded, clock, part.from_s) | {"unheard_s": found.unheard_s},
        "without_avoidance": _way(found.without, clock, part.from_s) | _run(found.run_without),
        "with_avoidance": _way(found.avoiding, clock, part.from_s) | _run(found.run),
        "path_added_m": round_number(found.added_m),
        "notes": list(found.setup.notes),
        "provenance": provenance([file.traffic.recording] if file.traffic.recording else []),
    }


def _aircraft(one: Aircraft) -> dict[str, Any]:
    return {
        "address": one.address,
        "callsign": one.callsign,
        "altitude_step_m": round_number(one.altitude_step_m),
    }


def _way(way: Way, clock: Clock, from_s: float) -> dict[str, Any]:
    nearest = None
    if way.nearest is not None:
        nearest = {"address": way.nearest[0]} | _approach(way.nearest[1], clock, from_s)
    return {
        "closest": None if way.closest is None else _approach(way.closest, clock, from_s),
        "nearest_of_all": nearest,
        "path_length_m": round_number(way.path_length_m),
    }


def _approach(approach: Approach, clock: Clock, from_s: float) -> dict[str, Any]:
    return {
        "time_s": round_number(approach.time_s),
        "time": _utc(from_s + approach.time_s, clock),
        "horizontal_m": round_number(approach.horizontal_m),
        "vertical_m": round_number(approach.vertical_m),
        "slant_m": round_number(approach.slant_m),
        "near_mid_air": approach.near_mid_air,
        "well_clear": approach.well_clear,
    }


def _run(run: Run) -> dict[str, Any]:
    return {
        "reached": run.reached,
        "time_s": round_number(run.metrics.time_s),
        "margin_violations": run.metrics.margin_violations,
        "emergencies": run.emergencies,
        "decisions": len(run.decisions),
        "decision_ms": run.decision_ms,
        "data_left_out": dict(sorted(run.counts.items())),
    }


def _utc(time_s: float, clock: Clock) -> str | None:
    if clock != "utc":
        return None
    return datetime.fromtimestamp(time_s, UTC).isoformat(timespec="milliseconds")
