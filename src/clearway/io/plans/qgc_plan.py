"""Plans of QGroundControl (.plan): mission items, geofence and rally points in JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal

from clearway.io.foreign import Foreign, read_json
from clearway.io.maps.map_features import Geodetic
from clearway.io.plans.flight_plan import FlightPlan, plan_of
from clearway.io.plans.plan_items import FRAMES, Entry, ItemsRead, Position, read_geodetic
from clearway.io.plans.plan_limits import Fence, polygon_fence, round_fence
from clearway.io.toml import parse_model, refuse_many

FIXED_WING = 1
PX4 = 12
"""MAV_TYPE of vehicleType, MAV_AUTOPILOT of firmwareType."""
LAND = 21


class Transect(Foreign):
    """What a survey or a corridor scan comes down to."""

    Items: tuple[PlanItem, ...] = ()


class PlanItem(Foreign):
    type: str = "SimpleItem"
    command: int | None = None
    frame: int | None = None
    params: tuple[float | None, ...] = ()
    doJumpId: int | None = None
    AMSLAltAboveTerrain: float | None = None
    complexItemType: str = "complex item"
    TransectStyleComplexItem: Transect | None = None
    landCoordinate: tuple[float, float, float] | None = None
    altitudesAreRelative: bool = True


class PlanMission(Foreign):
    plannedHomePosition: tuple[float, float, float]
    items: tuple[PlanItem, ...]
    cruiseSpeed: float | None = None
    hoverSpeed: float | None = None
    vehicleType: int | None = None
    firmwareType: int | None = None


class Circle(Foreign):
    center: tuple[float, float]
    radius: float


class FenceCircle(Foreign):
    circle: Circle
    inclusion: bool


class FencePolygon(Foreign):
    polygon: tuple[tuple[float, float], ...]
    inclusion: bool


class GeoFence(Foreign):
    circles: tuple[FenceCircle, ...] = ()
    polygons: tuple[FencePolygon, ...] = ()


class RallyPoints(Foreign):
    points: tuple[tuple[float, float, float], ...] = ()


class QgcPlan(Foreign):
    fileType: Literal["Plan"]
    mission: PlanMission
    geoFence: GeoFence = GeoFence()
    rallyPoints: RallyPoints = RallyPoints()


def read_plan(path: Path) -> FlightPlan:
    """The plan in a file; InputError with everything in it that cannot be used."""
    data = read_json(path)
    refuse_many(str(path), data, "what a ground station saves")
    plan = parse_model(str(path), data, QgcPlan)
    mission, px4 = plan.mission, plan.mission.firmwareType == PX4
    # PX4 takes a height of 0 as one; it also flies to the place of a take-off.
    items = ItemsRead(zero_keeps_height=not px4)
    number = 0
    for place, entry in _simple("mission.items", mission.items, items.left_out):
        number = number + 1 if entry.doJumpId is None else entry.doJumpId
        frame, position = _frame_and_position(entry)
        first, second = (*entry.params, None, None)[:2]
        items.take(Entry(place, number, entry.command, frame, (first, second), position))
    home, rally, fences = _places(plan, items.problems)
    speed = mission.cruiseSpeed if mission.vehicleType == FIXED_WING else mission.hoverSpeed
    read = plan_of(path, home, items, speed if speed and speed > 0.0 else None)
    return replace(
        read,
        rally=(*rally, *read.rally),
        fences=(*fences, *read.fences),
        flies_to_take_off=px4,
    )


def _simple(
    place: str, items: tuple[PlanItem, ...], counts: Counter[str]
) -> Iterator[tuple[str, PlanItem]]:
    """Simple items with their places in the file, those of surveys and corridors too."""
    for number, entry in enumerate(items):
        here = f"{place}[{number}]"
        if entry.type == "SimpleItem":
            yield here, entry
        elif entry.TransectStyleComplexItem is not None and entry.TransectStyleComplexItem.Items:
            inner = entry.TransectStyleComplexItem.Items
            yield from _simple(f"{here}.TransectStyleComplexItem.Items", inner, counts)
        elif entry.landCoordinate is not None:
            yield here, _landing(entry.landCoordinate, entry.altitudesAreRelative)
        else:
            counts[entry.complexItemType] += 1


def _landing(place: tuple[float, float, float], above_home: bool) -> PlanItem:
    """The end of a landing pattern, at which it lands."""
    return PlanItem(command=LAND, frame=3 if above_home else 0, params=(*(None,) * 4, *place))


def _frame_and_position(entry: PlanItem) -> tuple[int, Position]:
    """Frame of the height, and where an entry leads."""
    params = (*entry.params, *(None,) * (7 - len(entry.params)))
    frame = 3 if entry.frame is None else entry.frame
    if FRAMES.get(frame) == "ground" and entry.AMSLAltAboveTerrain is not None:
        frame, params = 0, (*params[:6], entry.AMSLAltAboveTerrain)
    return frame, (params[4], params[5], params[6])


def _places(
    plan: QgcPlan, problems: list[str]
) -> tuple[Geodetic, tuple[Geodetic, ...], tuple[Fence, ...]]:
    """Home, rally points and fences; problems are added to the list."""

    def geodetic(place: str, values: tuple[float, float, float]) -> Geodetic:
        try:
            return read_geodetic(*values)
        except ValueError as cause:
            problems.append(f"{place}: {cause}")
        return Geodetic(*values)

    home = geodetic("mission.plannedHomePosition", plan.mission.plannedHomePosition)
    rally = tuple(
        geodetic(f"rallyPoints.points[{number}]", point)
        for number, point in enumerate(plan.rallyPoints.points)
    )
    fences: list[Fence] = []
    for number, part in enumerate(plan.geoFence.polygons):
        corners = [list(corner) for corner in part.polygon]
        try:
            fences.append(polygon_fence(number, corners, inclusion=part.inclusion))
        except ValueError as cause:
            problems.append(f"geoFence.polygons[{number}]: {cause}")
    for number, one in enumerate(plan.geoFence.circles):
        circle = one.circle
        try:
            fences.append(
                round_fence(number, circle.center, circle.radius, inclusion=one.inclusion)
            )
        except ValueError as cause:
            problems.append(f"geoFence.circles[{number}]: {cause}")
    return home, rally, tuple(fences)
