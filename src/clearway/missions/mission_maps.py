"""The maps of a mission: what is there, what is on the map, and what to keep out of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.rules import GroundHeights
from clearway.io.maps.map_features import Geodetic
from clearway.io.maps.maps import MapFile, read_maps
from clearway.io.maps.placing import Bounds
from clearway.io.moments import parse_moment
from clearway.missions.mission_file import MissionFile
from clearway.obstacles.obstacle import Obstacle


class MissionMaps(NamedTuple):
    """Obstacles of all map files of a mission, world frame."""

    there: tuple[Obstacle, ...] = ()
    """Really there."""
    charted: tuple[Obstacle, ...] = ()
    """On the map, zones to keep out of included."""
    ground: GroundHeights | None = None
    """Of the first terrain among them."""
    origin: Geodetic | None = None
    """Of the local frame that they stand in."""
    notes: tuple[str, ...] = ()


def mission_maps(file: MissionFile) -> MissionMaps:
    """What `[map]` of a mission holds near it; nothing without that table.

    Raises InputError for a file that cannot be read, and a moment that is none.
    """
    section = file.map
    if section is None or not section.files:
        return MissionMaps()
    origin = file.mission.origin_geodetic
    when = None if section.at is None else parse_moment("map.at", section.at)
    maps = read_maps(
        section.files,
        None if origin is None else Geodetic(*origin),
        bounds_m=_bounds(file, section.beyond_m),
        point_radius_m=section.point_radius_m,
        crs=section.crs,
    )
    solid = tuple(obstacle for one in maps for obstacle in one.solid)
    volumes = tuple(
        volume
        for one in maps
        for zone in one.keep_out
        if section.keep_out and zone.in_force(when)
        for volume in zone.obstacles
    )
    return MissionMaps(
        there=() if section.known == "map" else solid,
        charted=(() if section.known == "world" else solid) + volumes,
        ground=next((one.ground for one in maps if one.ground is not None), None),
        origin=maps[0].origin,
        notes=_notes(file, maps),
    )


def _bounds(file: MissionFile, beyond_m: float) -> Bounds:
    """The box around a mission, and what lies not far beyond."""
    mission = file.mission
    points = np.array([file.vehicle.position_m, *mission.waypoints_m, *mission.landing_m])[:, :2]
    return points.min(axis=0) - beyond_m, points.max(axis=0) + beyond_m


def _notes(file: MissionFile, maps: tuple[MapFile, ...]) -> tuple[str, ...]:
    notes = []
    if file.mission.origin_geodetic is None:
        latitude, longitude, height = maps[0].origin
        notes.append(
            "no mission.origin_geodetic: the origin is in the middle of the first map file, at "
            f"{latitude:.6f}, {longitude:.6f}, {height:.1f} m"
        )
    for one in maps:
        held = f"{len(one.obstacles)} obstacles, {len(one.floor)} blocks of ground, "
        notes.append(f"{one.source}: {held}{len(one.keep_out)} zones near the mission")
        notes += [f"{one.source}: {count} left out: {why}" for why, count in one.counts.items()]
        notes += [f"{one.source}: {note}" for note in one.notes]
    return tuple(notes)
