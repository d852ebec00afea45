"""Where on Earth and when a mission takes place, as far as it says."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import NamedTuple

from clearway.avoidance.rules import GroundHeights
from clearway.io.maps.map_features import Geodetic
from clearway.io.moments import parse_moment
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_maps import MissionMaps
from clearway.missions.mission_traffic import RecordedAir


class MissionPlace(NamedTuple):
    """All of it None for a mission in a made-up frame without a date."""

    origin: Geodetic | None = None
    """Of the world frame, x east and y north."""
    ground: GroundHeights | None = None
    """Of the first terrain among its maps."""
    begins: datetime | None = None
    """By `map.at`, or by the recording of traffic that plays around it."""


NOWHERE = MissionPlace()


def mission_place(file: MissionFile, maps: MissionMaps, air: RecordedAir | None) -> MissionPlace:
    """What the mission's tables and files tell."""
    begins = None
    if air is not None and air.begins_s is not None:
        begins = datetime.fromtimestamp(air.begins_s, UTC)
    elif file.map is not None and file.map.at is not None:
        begins = parse_moment("map.at", file.map.at)
    given = file.mission.origin_geodetic
    return MissionPlace(maps.origin if given is None else Geodetic(*given), maps.ground, begins)
