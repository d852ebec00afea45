"""What a mission flies in: its obstacles, maps and survey, by what is there and what is
reported."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.what_file import require_files
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_maps import MissionMaps
from clearway.missions.place_sections import PointCloudSection
from clearway.missions.scan_fit import ABOVE, find_direction
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.point_world import PointWorld
from clearway.obstacles.world import CombinedWorld, World
from clearway.sim.baselines import Danger, Source


class MissionWorld(NamedTuple):
    """World frame."""

    there: World
    """What is really there."""
    charted: ObstacleMap
    """What is reported to the vehicle."""
    notes: tuple[str, ...]
    """What was left out of the survey."""
    standing: frozenset[Danger] = frozenset()
    """What stands there, by who tells of it."""


def refuse_absent_files(file: MissionFile) -> None:
    """Raise an error that names all files of a mission's world and traffic that are not there."""
    named = [] if file.map is None else list(file.map.files)
    named += [] if file.point_cloud is None else [file.point_cloud.file]
    named += [] if file.columns is None or file.columns.file is None else [file.columns.file]
    named += [] if file.traffic.recording is None else [file.traffic.recording]
    require_files(map(Path, named))


def mission_world(file: MissionFile, maps: MissionMaps) -> MissionWorld:
    """The obstacles of a mission and its maps, and its survey.

    Raises InputError for a survey that cannot be read, or of which nothing is left.
    """
    there = [part.to_obstacle() for part in file.obstacle if part.known != "map"]
    charted = [part.to_obstacle() for part in file.obstacle if part.known != "world"]
    parts: list[World] = [ObstacleMap([*there, *maps.there])]
    notes: tuple[str, ...] = ()
    if file.columns is not None:
        columns = file.columns.to_columns()
        parts += [] if file.columns.known == "map" else [columns]
        charted += [] if file.columns.known == "world" else columns.charted
    if file.point_cloud is not None:
        cloud, notes = _make_surveyed(file.point_cloud)
        parts.append(cloud)
    told = ObstacleMap([*charted, *maps.charted], complete_m=_complete_m(file))
    there_is = parts[0] if len(parts) == 1 else CombinedWorld(parts)
    return MissionWorld(there_is, told, notes, _standing(file, maps))


def _standing(file: MissionFile, maps: MissionMaps) -> frozenset[Danger]:
    """Who tells of what stands there: sensors, if there are any, and maps."""
    seen: Danger = frozenset({Source.SENSORS} if file.lidar or file.sensor else ())
    charted = seen | {Source.MAP}
    found = {
        seen if part.known == "world" else charted for part in file.obstacle if part.known != "map"
    }
    if file.columns is not None and file.columns.known != "map":
        found.add(charted if file.columns.known == "both" else seen)
    if maps.there:
        found.add(charted if file.map is not None and file.map.known == "both" else seen)
    if file.point_cloud is not None:
        found.add(seen)
    return frozenset(found)


def _complete_m(file: MissionFile) -> FloatArray | None:
    """[2, 3] the box in which all that is reported is all that stands there; None without any."""
    declared = False if file.map is None else file.map.complete
    if isinstance(declared, bool):
        return np.array([[-np.inf] * 3, [np.inf] * 3]) if declared else None
    return np.array(declared)


def _make_surveyed(section: PointCloudSection) -> tuple[PointWorld, tuple[str, ...]]:
    """A surveyed place as balls at its points, and what was left out of it."""
    from clearway.io.scans.scan_formats import read_points

    cloud = read_points(section.file, section.leave_out_classes, section.frame)
    points = cloud.points_m
    if section.origin_m == "lowest-corner":
        points = points - points.min(axis=0)
    elif section.origin_m != "file":
        points = points - np.array(section.origin_m)
    left_out = [f"{number} points left out: {reason}" for reason, number in cloud.counts.items()]
    notes = [*left_out, *cloud.notes]
    if section.frame == "auto" and not cloud.survey and find_direction(cloud.points_m) == ABOVE:
        notes.append(
            "all points lie in a cone about +z: if a depth camera recorded them, the world lies on "
            'its side; frame = "optical" of [point_cloud] turns it, frame = "body" leaves it'
        )
    world = PointWorld(np.ascontiguousarray(points), section.point_radius_m)
    return world, tuple(f"{section.file}: {note}" for note in notes)
