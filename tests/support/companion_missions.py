"""Missions in free space that a companion computer flies, as tables that tests change."""

from __future__ import annotations

from typing import Any

from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, prepare

CALM: dict[str, Any] = {
    "mission": {"name": "companion", "waypoints_m": [[40, 0, 7]], "reach_radius_m": 2},
    "vehicle": {"position_m": [0, 0, 7], "speed_mps": 3.0},
    "grid": {"range_m": 40, "layers": 10, "azimuth_deg": 45, "columns": 7, "elevation_deg": 30,
             "rows": 5},
    "safety": {"margin_m": 5.0},
    "lidar": [],
}  # fmt: skip


def mission(**changes: Any) -> tuple[MissionFile, FlightSetup]:
    """A mission with some tables in place of those of the calm one, and how it is flown."""
    tables = {key: changes.get(key, table) for key, table in CALM.items()}
    file = parse_model("companion", tables, MissionFile)
    return file, prepare(file)
