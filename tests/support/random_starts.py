"""Flights through empty air from anywhere, towards anywhere: real numbers, any heading."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, prepare

AUTOMATA = Path(__file__).parents[2] / "examples" / "automata"
Tables = Mapping[str, Mapping[str, Any]]
SENSOR = {"beams_per_cell": [20, 10], "sigma_m": 0.03, "dropout": 0.05}
AIRFRAMES: dict[str, tuple[float, Tables]] = {
    "plane": (25.0, {"vehicle": {"kind": "plane"}}),
    "copter": (12.0, {"vehicle": {"kind": "inertialess"}}),
    "quadrotor": (
        60.0,
        {
            "mission": {"reach_radius_m": 7.5},
            "vehicle": {
                "plant": "quadrotor",
                "automaton": str(AUTOMATA / "quadrotor.toml"),
                "body_radius_m": 0.5,
            },
            "grid": {"range_m": 50.0},
            "safety": {"margin_m": 3.0},
        },
    ),
    "F450": (
        45.0,
        {
            "mission": {"reach_radius_m": 4.0},
            "vehicle": {
                "plant": "F450",
                "automaton": str(AUTOMATA / "F450.toml"),
                "body_radius_m": 0.4,
            },
            "grid": {"range_m": 40.0},
            "safety": {"margin_m": 1.5},
        },
    ),
}
"""Length of the way, and tables of a mission, by airframe."""


def flight(airframe: str, seed: int, changes: Tables | None = None) -> FlightSetup:
    """The flight of a seed: from anywhere, heading anywhere, to a goal in any direction.

    changes: keys of the mission's tables, over those of the airframe.
    """
    far_m, tables = AIRFRAMES[airframe]
    rng = np.random.default_rng([seed, 70])
    start_m, heading = rng.uniform(-50.0, 50.0, 3), float(rng.uniform(-180.0, 180.0))
    course, rise = float(rng.uniform(-np.pi, np.pi)), float(rng.uniform(-0.2, 0.2))
    way_m = far_m * np.array([np.cos(course), np.sin(course), rise])
    mission: dict[str, Any] = {
        "mission": {"name": airframe, "waypoints_m": [(start_m + way_m).tolist()]},
        "vehicle": {"position_m": start_m.tolist(), "attitude_deg": [0.0, 0.0, heading]},
        "simulation": {"seed": seed},
        "lidar": SENSOR,
    }
    for more in (tables, changes or {}):
        for table, values in more.items():
            mission[table] = {**mission.get(table, {}), **values}
    mission["lidar"] = [mission["lidar"]]
    return prepare(parse_model(f"{airframe} {seed}", mission, MissionFile, Path()))
