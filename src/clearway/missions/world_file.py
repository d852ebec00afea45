"""Missions through made-up worlds as mission files: `forest:3` is the forest of seed 3."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.missions.lidar_section import LidarSection
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.mission_sections import (
    MissionSection,
    SafetySection,
    SimulationSection,
    VehicleSection,
)
from clearway.missions.place_sections import ColumnsSection, WorldObstacleSection
from clearway.missions.planned import Notice
from clearway.missions.rule_sections import RulesSection
from clearway.obstacles.columns import Columns
from clearway.obstacles.obstacle import Obstacle
from clearway.sim.world_parts import MadeWorld
from clearway.sim.worlds import WORLD_FAMILIES, make_world

NOISE = LidarSection(beams_per_cell=(20, 10), sigma_m=0.03, dropout=0.05)
"""The sensor of all made-up worlds: that of the paper's missions."""


def read_mission(name_or_path: str | Path, notice: Notice | None = None) -> MissionFile:
    """Read a mission: by name, a mission file (TOML), a flight plan, or a made-up world.

    Units stand in the keys, as in the file.

    Parameters
    ----------
    name_or_path
        One that comes with clearway ("static-obstacles"), a file of one's own, a plan of a ground
        station (.plan, .waypoints, .kml, .kmz), or a family of worlds and a seed
        ("forest:3"; without a number, 0).
    notice
        Called with what was assumed or left out.

    Returns
    -------
    MissionFile
        All of the mission, checked.

    Raises
    ------
    InputError
        With every problem of a file: unknown keys, wrong types, impossible values; for a name that
        is none, with those that there are.

    Examples
    --------
    >>> import clearway as cw
    >>> mission = cw.read_mission("static-obstacles")
    >>> mission.with_values("simulation", seed=3).simulation.seed
    3
    >>> mission.with_values("simulation", sede=3)
    Traceback (most recent call last):
        ...
    clearway.base.errors.InputError: mission 'static-obstacles': simulation.sede: unknown key ...
    """
    name = str(name_or_path)
    family, _, seed = name.partition(":")
    if family not in WORLD_FAMILIES:
        return read_mission_file(name, notice)
    if seed and not seed.isdigit():
        raise InputError(name, f"seed {seed!r}: a whole number is needed after the colon")
    return world_mission(family, int(seed or 0))


def world_mission(family: str, seed: int) -> MissionFile:
    """The mission file that flies a world of a family; its seed is the simulation's too."""
    return mission_of(make_world(family, seed), seed)


def mission_of(made: MadeWorld, seed: int) -> MissionFile:
    """The mission file that flies a made world; the seed is that of noise and drop-outs."""
    world, mission = made.world, made.mission
    tables: dict[str, Any] = {
        "mission": MissionSection(
            name=mission.name,
            waypoints_m=tuple(_point(goal) for goal in mission.waypoints_m),
            reach_radius_m=mission.reach_radius_m,
        ),
        "vehicle": VehicleSection(
            position_m=_point(mission.start.position_m),
            attitude_deg=_point(np.degrees(mission.start.attitude_rad)),
        ),
        "simulation": SimulationSection(seed=seed),
    }
    if made.heights_m is not None or made.corridor_m is not None:
        floor_m, ceiling_m = made.heights_m or (None, None)
        tables["rules"] = RulesSection(
            floor_m=floor_m, ceiling_m=ceiling_m, route_m=made.corridor_m
        )
    if made.smallest_object_m is not None:
        tables["safety"] = SafetySection(smallest_object_m=made.smallest_object_m)
    if isinstance(world, Columns):
        tables["columns"] = ColumnsSection(
            rows_m=tuple(tuple(row) for row in world.rows_m.tolist()),
            ground_m=world.ground_m if np.isfinite(world.ground_m) else None,
        )
        return MissionFile(lidar=(NOISE,), **tables)
    parts = tuple(_section(obstacle) for obstacle in world.obstacles)
    return MissionFile(lidar=(NOISE,), obstacle=parts, **tables)


def _section(obstacle: Obstacle) -> WorldObstacleSection:
    return WorldObstacleSection(
        shape=obstacle.shape,
        position_m=_point(obstacle.position_m),
        orientation_deg=_point(np.degrees(obstacle.orientation_rad)),
        size_m=obstacle.size_m,
        radius_m=obstacle.radius_m,
        name=obstacle.name,
    )


def _point(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
