"""Plans of QGroundControl (.plan): mission items, geofence and rally points in JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from clearway.base.errors import InputError
from clearway.io.foreign import Foreign, read_json, rings_of
from clearway.io.maps.map_features import Disc, Geodetic, Polygon
from clearway.io.plans.flight_plan import Fence, FlightPlan
from clearway.io.plans.plan_items import CHANGE_SPEED, FRAMES, ItemsRead, Position, geodetic_of
from clearway.io.toml import parse_model, refuse_many

FIXED_WING = 1
LAND = 21
LARGEST_FENCE_M = 100_000.0


class Transect(Foreign):
    """What a survey or a corridor scan comes down to."""

    Items: tuple[PlanItem, ...] = ()


class PlanItem(Foreign):
    type: str = "SimpleItem"
    command: int | None = None
    frame: int | None = None
    params: tuple[float | None, ...] = ()
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
    mission, items = plan.mission, ItemsRead()
    speed = mission.cruiseSpeed if mission.vehicleType == FIXED_WING else mission.hoverSpeed
    for place, entry in _simple("mission.items", mission.items, items.left_out):
        if entry.command == CHANGE_SPEED and not items.found and len(entry.params) > 1:
            told = entry.params[1] or 0.0
            speed = told if told > 0.0 else speed  # -1 keeps the speed
        else:
            items.take(place, entry.command, *_frame_and_position(entry))
    home, rally, fences = _places(plan, items.problems)
    if items.problems:
        raise InputError(str(path), items.problems)
    return FlightPlan(
        str(path),
        path.stem,
        home,
        tuple(items.found),
        speed if speed and speed > 0.0 else None,
        fences,
        rally,
        items.left_out,
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
            return geodetic_of(*values)
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
        ring = [[longitude, latitude] for latitude, longitude in part.polygon]
        try:
            fences.append(Fence(f"fence {number}", Polygon(rings_of([ring])), part.inclusion))
        except ValueError as cause:
            problems.append(f"geoFence.polygons[{number}]: {cause}")
    for number, circle in enumerate(plan.geoFence.circles):
        latitude, longitude = circle.circle.center
        geodetic(f"geoFence.circles[{number}]", (latitude, longitude, 0.0))
        if not 0.0 < circle.circle.radius <= LARGEST_FENCE_M:
            problems.append(
                f"geoFence.circles[{number}]: radius {circle.circle.radius:g} m is not above 0 and "
                f"at most {LARGEST_FENCE_M:g} m"
            )
        disc = Disc(latitude, longitude, circle.circle.radius)
        fences.append(Fence(f"round fence {number}", disc, circle.inclusion))
    return home, rally, tuple(fences)
