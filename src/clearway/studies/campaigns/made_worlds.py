"""Parameters of the families of made-up worlds, and missions through them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, Self

from pydantic import Field, model_validator

from clearway.io.toml import Section
from clearway.missions.mission_file import MissionFile
from clearway.missions.sections import NotNegative
from clearway.missions.world_file import mission_of
from clearway.sim import clutter, column_fields, dead_ends, warehouse, worlds
from clearway.sim.world_parts import MadeWorld, RandomEnds, anywhere, enlarge, scatter_ends

Length = Annotated[float, Field(gt=0.0, le=1000.0)]
LengthSpan = Annotated[tuple[Length, Length], Field(strict=False)]
Number = Annotated[int, Field(ge=1, le=10_000)]
Density = Annotated[float, Field(ge=0.0, le=1.0)]
Numbers = Annotated[tuple[Number, Number], Field(strict=False)]


class StartParameters(Section):
    """Of families whose flights may start at random, by the seed."""

    start_aside_m: NotNegative = 0.0
    """How far start and goals are moved across the way at most, and half as far along it: each to a
    place of its own, with room about it."""
    any_heading: bool = False
    """Whether the flight starts in any direction; else as the family says."""

    @property
    def ends(self) -> RandomEnds | None:
        """How start and goals are moved; None for not at all."""
        if not self.start_aside_m and not self.any_heading:
            return None
        return RandomEnds(self.start_aside_m, self.any_heading)


class WorldParameters(StartParameters):
    """Of a family of made-up worlds; pairs are the least and the greatest that a seed draws."""

    anywhere: bool = True
    """Whether world and flight lie anywhere and head anywhere, by the seed; else as they are made,
    most with their start at the origin and their way along x."""
    times_larger: Annotated[float, Field(ge=0.1, le=100.0)] = 1.0
    """How many times as long all lengths are, for vehicles of another scale."""

    @model_validator(mode="after")
    def _ascend(self) -> Self:
        for name in type(self).model_fields:
            value = getattr(self, name)
            if isinstance(value, tuple) and value[0] > value[1]:
                raise ValueError(f"{name}: the least comes first, got {list(value)}")
        return self


class BallParameters(WorldParameters):
    """Of `balls`."""

    balls: Number | Numbers | None = None
    """Number in the box of 50 x 30 x 20 m; default: drawn from 30 to 240 with the seed."""
    room_m: NotNegative = 0.0
    """About start and waypoint, where balls are left out."""


class ForestParameters(WorldParameters):
    """Of `forest`."""

    apart_m: Length = column_fields.TRUNKS_APART_M
    """Between trunks, at least."""
    trees_per_m2: Density | None = None
    """Of a dense forest on level ground, whose trunks may touch; default: an open one."""


class ColumnParameters(WorldParameters):
    """Of `columns`."""

    columns_per_m2: Density = column_fields.PILLARS_PER_M2
    """Number to the square metre."""


class CylinderParameters(WorldParameters):
    """Of `cylinders`."""

    covered: Annotated[float, Field(gt=0.0, le=0.25)] = column_fields.DENSITIES["medium"]
    """Share of the ground that they cover."""


class WallParameters(WorldParameters):
    """Of `walls`."""

    gap_m: LengthSpan = worlds.WALL_GAPS_M
    """Width of the gaps."""
    walls: Number = worlds.WALLS
    """Number, 18 m apart."""
    aside_m: Length = worlds.GAPS_ASIDE_M
    """How far gaps lie from the straight way, at most."""


class WarehouseParameters(WorldParameters):
    """Of `warehouse`."""

    aisle_m: LengthSpan = warehouse.AISLES_M
    """Width of the aisles, 3 m at least: stacks in them leave 2 m."""

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        _need(self, "aisle_m", 3.0)
        return self


class PocketParameters(WorldParameters):
    """Of `pockets`."""

    depth_m: LengthSpan = worlds.POCKET_DEPTHS_M
    """From mouth to back; the deeper they may be, the farther apart they are."""
    width_m: LengthSpan = worlds.POCKET_WIDTHS_M
    """Between the sides."""


class MazeParameters(WorldParameters):
    """Of `maze`."""

    room_m: LengthSpan = worlds.MAZE_ROOMS_M
    """Side of the rooms, 10 m at least."""
    faces_door: bool = False
    """Whether the flight starts towards the open side of its room, else along x."""

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        _need(self, "room_m", 10.0)
        return self


class DeadEndParameters(WorldParameters):
    """Of `dead-end`, `cave` and `closed-tube`."""

    width_m: LengthSpan = dead_ends.WIDTHS_M
    """Between its sides; of a cave its height too."""
    depth_m: LengthSpan = dead_ends.DEPTHS_M
    """From its mouth to its end."""


class WedgeParameters(WorldParameters):
    """Of `wedge`."""

    width_m: LengthSpan = dead_ends.WEDGE_WIDTHS_M
    """Of its mouth."""
    depth_m: LengthSpan = dead_ends.WEDGE_DEPTHS_M
    """From its mouth to its corner."""


class ClosedStreetParameters(WorldParameters):
    """Of `closed-street`."""

    width_m: LengthSpan = dead_ends.STREET_WIDTHS_M
    """Between its houses, at least."""
    depth_m: LengthSpan = dead_ends.STREET_DEPTHS_M
    """From its mouth to the house at its end."""


class UShapeParameters(WorldParameters):
    """Of `u-shape`."""

    width_m: LengthSpan = dead_ends.U_WIDTHS_M
    """Between its sides, 9.5 m at least: the flight starts there."""
    depth_m: LengthSpan = dead_ends.U_DEPTHS_M
    """From its open side to its back, 14 m at least."""

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        _need(self, "width_m", 9.5)
        _need(self, "depth_m", 14.0)
        return self


class RoomParameters(WorldParameters):
    """Of `room`."""

    width_m: LengthSpan = dead_ends.DOOR_WIDTHS_M
    """Of its door."""
    depth_m: LengthSpan = dead_ends.ROOM_SIDES_M
    """Of its sides, 16 m at least: the flight starts inside."""

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        _need(self, "depth_m", 16.0)
        return self


class MixedParameters(WorldParameters):
    """Of `make_mixed`."""

    shapes: Numbers = clutter.MIXED_COUNTS
    """Number in the box of 50 x 30 x 20 m; those about start and waypoint are left out."""


class NetParameters(WorldParameters):
    """Of `nets`."""

    gap_m: LengthSpan = clutter.NET_GAPS_M
    """From net to net."""
    thickness_m: Length = clutter.NET_THICKNESS_M
    """Of the ropes: the smallest object that the mission declares."""


COMMON = frozenset(WorldParameters.model_fields)
"""Parameters that are not those of what is made."""


class MadeFamily(NamedTuple):
    """Made-up worlds of one kind."""

    parameters: type[WorldParameters]
    make: Callable[..., MadeWorld]
    """From a seed and, by name, the parameters."""

    def mission(self, seed: int, parameters: Any) -> MissionFile:
        """The mission through the world of a seed; parameters: a section of the family's kind."""
        own = [name for name in type(parameters).model_fields if name not in COMMON]
        made = self.make(seed, **{name: getattr(parameters, name) for name in own})
        if parameters.times_larger != 1.0:
            made = enlarge(made, parameters.times_larger)
        ends = parameters.ends
        if ends is not None:
            mission = scatter_ends(made.mission, made.world, made.heights_m, ends, seed)
            made = made._replace(mission=mission)
        return mission_of(anywhere(made, seed) if parameters.anywhere else made, seed)


MADE: Mapping[str, MadeFamily] = MappingProxyType(
    {
        "balls": MadeFamily(BallParameters, worlds.ball_world),
        "forest": MadeFamily(ForestParameters, column_fields.forest),
        "columns": MadeFamily(ColumnParameters, column_fields.column_field),
        "cylinders": MadeFamily(CylinderParameters, column_fields.cylinder_field),
        "street": MadeFamily(WorldParameters, worlds.street),
        "warehouse": MadeFamily(WarehouseParameters, warehouse.warehouse),
        "wires": MadeFamily(WorldParameters, worlds.wires),
        "walls": MadeFamily(WallParameters, worlds.walls),
        "pockets": MadeFamily(PocketParameters, worlds.pockets),
        "maze": MadeFamily(MazeParameters, worlds.maze),
        "dead-end": MadeFamily(DeadEndParameters, dead_ends.dead_end),
        "wedge": MadeFamily(WedgeParameters, dead_ends.wedge),
        "cave": MadeFamily(DeadEndParameters, dead_ends.cave),
        "closed-street": MadeFamily(ClosedStreetParameters, dead_ends.make_closed_street),
        "closed-tube": MadeFamily(DeadEndParameters, dead_ends.make_closed_tube),
        "u-shape": MadeFamily(UShapeParameters, dead_ends.u_shape),
        "room": MadeFamily(RoomParameters, dead_ends.room),
        "mixed": MadeFamily(MixedParameters, clutter.make_mixed),
        "nets": MadeFamily(NetParameters, clutter.nets),
    }
)
"""Families by name; those of `sim.worlds` fly by name with their defaults too."""


def _need(parameters: WorldParameters, name: str, least: float) -> None:
    low = getattr(parameters, name)[0]
    if low < least:
        raise ValueError(f"{name}: at least {least:g}, got {low:g}")
