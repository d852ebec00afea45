"""A recorded encounter as a mission: the ownship takes the place of one of the two aircraft.

Turning, look-ahead and margins follow from the speed and from what the recording can tell, so that
the mission file alone flies it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.units import FOOT_M
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.traffic.recorded.own_part import LEG_S, OwnPart

GRAVITY_MPS2 = 9.81
MARGIN_M = 1000.0 * FOOT_M
"""Twice the horizontal limit of a near mid-air collision."""
BANK_DEG = 25.0
TURN_STEP_DEG = 7.5
"""Also the steepest climb: 400 ft/min per 10 kt."""
LOOK_AHEAD_S = LEG_S
REACH_SHARE = 0.4
"""The reach radius as a share of the turning radius."""
PASS_MARGINS = 3.0
"""Waypoints count as passed within so many margins."""


@dataclass(frozen=True, slots=True)
class FlownAs:
    """How the ownship takes the place of an aircraft."""

    margin_m: float = MARGIN_M
    """Between the two, beside what the heights may be off."""
    bank_deg: float = BANK_DEG
    look_ahead_s: float = LOOK_AHEAD_S
    seed: int = 0


def mission_name(part: OwnPart) -> str:
    """What the mission is called: after both aircraft."""
    names = [one.callsign or one.address for one in (part.own, part.other)]
    return f"{names[0]}-meets-{names[1]}".lower()


def encounter_mission(part: OwnPart, recording: str | Path, flown: FlownAs) -> MissionFile:
    """The mission of an own part, checked like a file.

    Raises InputError for settings that no vehicle can have.
    """
    return parse_model(
        f"encounter of {part.own.address} and {part.other.address}",
        _tables(part, recording, flown),
        MissionFile,
    )


def _tables(part: OwnPart, recording: str | Path, flown: FlownAs) -> dict[str, Any]:
    # Whole metres a second, so that reach sets are found again.
    speed = max(1.0, round(part.speed_mps))
    radius_m = speed**2 / (GRAVITY_MPS2 * np.tan(np.radians(flown.bank_deg)))
    movement_s = float(np.radians(TURN_STEP_DEG) * radius_m / speed)
    layers = max(2, round(flown.look_ahead_s / movement_s))
    reach_m = REACH_SHARE * radius_m
    return {
        "mission": {
            "name": mission_name(part),
            "origin_geodetic": [round(value, 7) for value in part.origin_geodetic],
            "waypoints_m": _round_all(_apart(part.start_m, part.waypoints_m, reach_m)),
            "reach_radius_m": round(reach_m, 1),
            "pass_within_m": round(reach_m + PASS_MARGINS * flown.margin_m, 1),
        },
        "vehicle": {
            "position_m": _round_all([part.start_m])[0],
            "attitude_deg": [round(value, 2) for value in np.degrees(part.attitude_rad).tolist()],
            "speed_mps": speed,
            "turn_step_deg": TURN_STEP_DEG,
            "movement_s": round(movement_s, 3),
            "pitch_limit_deg": TURN_STEP_DEG,
        },
        "grid": {"range_m": round(layers * speed * movement_s, 1), "layers": layers},
        "safety": {"margin_m": round(flown.margin_m, 1)},
        "simulation": {"seed": flown.seed},
        "traffic": {
            "recording": str(Path(recording).absolute()),
            "recording_from": part.from_s,
            "own_address": part.own.address,
            "heights": "geometric" if part.geometric else "barometric",
            "tracker": True,
        },
        "lidar": [],
    }


def _apart(start_m: FloatArray, corners_m: FloatArray, reach_m: float) -> list[FloatArray]:
    """The corners without those within reach of the one before; the last one stays."""
    kept = [start_m]
    for corner in corners_m[:-1]:
        if np.linalg.norm(corner - kept[-1]) > reach_m:
            kept.append(corner)
    if len(kept) > 1 and np.linalg.norm(corners_m[-1] - kept[-1]) <= reach_m:
        kept.pop()
    return [*kept[1:], corners_m[-1]]


def _round_all(points_m: Sequence[FloatArray]) -> list[list[float]]:
    return [[round(float(value), 1) for value in point] for point in points_m]
