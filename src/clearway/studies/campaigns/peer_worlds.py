"""Parameters of the families of worlds that other projects measure their planners in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Annotated

from pydantic import Field

from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from clearway.missions.world_file import mission_of
from clearway.sim.peer_worlds import barn, boxes, moving, perlin, rings
from clearway.sim.world_parts import scatter_ends
from clearway.studies.campaigns.made_worlds import (
    Density,
    LengthSpan,
    MadeFamily,
    Number,
    StartParameters,
    WorldParameters,
)

Filled = Annotated[float, Field(gt=0.0, le=0.4)]


class BarnParameters(WorldParameters):
    """Of `barn`."""

    fill: Filled | None = None
    """Share of cells filled before they are smoothed; default: by the seed, 0.15 to 0.35."""
    rounds: Annotated[int, Field(ge=0, le=10)] | None = None
    """Of smoothing; default: by the seed, 2 to 4."""


class PerlinParameters(WorldParameters):
    """Of `perlin`."""

    fill: Filled = perlin.FILL
    """Share of the box that is filled."""


class BoxParameters(WorldParameters):
    """Of `boxes`."""

    boxes_per_m2: Density = boxes.PER_M2
    """Number to the square metre."""


class SmallMazeParameters(WorldParameters):
    """Of `small-maze`."""

    room_m: LengthSpan = boxes.ROOM_M
    """Side of the rooms."""


class RingForestParameters(WorldParameters):
    """Of `ring-forest`."""

    cylinders: Number = rings.CYLINDERS
    """Number on 40 x 20 m."""
    rings: Number = rings.RINGS
    """Number there too."""


class MovingParameters(StartParameters):
    """Of `moving`."""

    obstacles: Number = moving.OBSTACLES
    """Number in a box of 100 x 12 x 4 m, of which 65 % move."""


PEER_WORLDS: Mapping[str, MadeFamily] = MappingProxyType(
    {
        "barn": MadeFamily(BarnParameters, barn.barn),
        "perlin": MadeFamily(PerlinParameters, perlin.perlin),
        "boxes": MadeFamily(BoxParameters, boxes.box_field),
        "small-maze": MadeFamily(SmallMazeParameters, boxes.small_maze),
        "ring-forest": MadeFamily(RingForestParameters, rings.ring_forest),
    }
)
"""Families by name, which fly in campaigns alone: they suit a copter."""


def moving_mission(seed: int, given: MovingParameters) -> MissionFile:
    """Return the flight through the field of a seed, which follows what moves."""
    made = moving.moving_field(seed, given.obstacles)
    if given.ends is not None:
        mission = scatter_ends(made.mission, made.world, made.heights_m, given.ends, seed)
        made = made._replace(mission=mission)
    return mission_of(made, seed).with_values("traffic", follow_movers=True)


def with_moving(setup: FlightSetup, seed: int, given: MovingParameters) -> FlightSetup:
    """Return the flight with what moves there, which no report tells of."""
    return replace(setup, script=moving.moving_script(seed, given.obstacles))
