"""What a mission file leaves out and its vehicle decides: range, margin, reach radius, movement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.io.toml import Section
from clearway.missions.lidar_section import LidarSection
from clearway.missions.mission_sections import MissionSection, SafetySection, VehicleSection
from clearway.missions.sections import GridSection, fill_left_out
from clearway.sensors import find_pattern
from clearway.vehicle.scale import Scale, scale_of

FOLLOWING = {
    "grid": "range_m",
    "safety": "margin_m",
    "mission": "reach_radius_m",
    "vehicle": "movement_s",
}
"""The key of each table that follows from the vehicle where it is left out."""


def suit_vehicle(
    mission: MissionSection,
    vehicle: VehicleSection,
    grid: GridSection,
    safety: SafetySection,
    lidars: Sequence[LidarSection],
) -> dict[str, Section]:
    """Return tables as suit the vehicle, by name; none where nobody can say what it does.

    lidars: all sensors; none where there are others of which no range is known.
    """
    scale = mission_scale(mission, vehicle, lidars)
    if scale is None:
        return {}
    range_m = {} if grid.range_edges_m is not None else {"range_m": scale.range_m}
    return {
        "mission": fill_left_out(mission, reach_radius_m=scale.reach_radius_m),
        "grid": fill_left_out(grid, **range_m),
        "safety": fill_left_out(safety, margin_m=scale.margin_m),
    }


def mission_scale(
    mission: MissionSection, vehicle: VehicleSection, lidars: Sequence[LidarSection]
) -> Scale | None:
    """Return what suits the vehicle and the sensors; None where its movements cannot be read."""
    try:
        automaton = vehicle.to_automaton()
    except ClearwayError:  # Told where the flight is prepared.
        return None
    ways = np.diff(np.array(mission.waypoints_m), axis=0)
    apart_m = np.linalg.norm(ways, axis=1).min(initial=np.inf)
    return scale_of(automaton, _sees_m(lidars), float(apart_m))


def _sees_m(lidars: Sequence[LidarSection]) -> float | None:
    """Range of the LiDAR that sees farthest; None where one of them goes by the grid."""
    ranges = [
        one.max_range_m if one.pattern is None else find_pattern(one.pattern).max_range_m
        for one in lidars
    ]
    stated = [one for one in ranges if one is not None]
    return max(stated) if stated and len(stated) == len(ranges) else None
