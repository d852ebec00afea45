"""Flight plans of ground stations as missions: places become local points, home is the origin.

The vehicle of (4.4) cannot hover, climb straight up or land, so a flight begins in the air at the
height that it takes off to, and ends in the air above the place to land at.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.io.maps.map_features import Disc, Geodetic, Height, MapFeature, Polygon
from clearway.io.maps.placing import MOST_APART_M, Place, PlacingTally, around_disc, place_features
from clearway.io.maps.rectangles import shapely_or_refuse
from clearway.io.plans.mission_order import MOST_FLOWN, in_flown_order
from clearway.io.plans.plan_items import Item, ItemsRead
from clearway.io.plans.plan_limits import Fence
from clearway.obstacles.obstacle import Obstacle
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import scale_of

DEFAULT_SPEED_MPS = 5.0
NOISE = {"sigma_m": 0.03, "dropout": 0.05}
"""Of the sensor of a plan, as of the examples."""
FENCE_DEPTH_M = 500.0
FENCE_HEIGHT_M = 5_000.0
WALL_M = 1.0
NO_HOME = Geodetic(0.0, 0.0, 0.0)
"""Of a plan that does not set its home."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightPlan:
    """What a ground station planned, in its own terms."""

    source: str
    name: str
    home: Geodetic
    items: tuple[Item, ...]
    speed_mps: float | None = None
    fences: tuple[Fence, ...] = ()
    rally: tuple[Geodetic, ...] = ()
    """Places to return to; heights are above home."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """What was left out, by reason."""
    notes: tuple[str, ...] = ()
    """What was assumed where the file is silent."""
    flies_to_take_off: bool = False
    """Whether the vehicle climbs where it stands and then flies to the place of its take-off, as
    PX4 does; ArduPilot does not use that place."""


def plan_of(
    path: Path, home: Geodetic, items: ItemsRead, speed_mps: float | None = None
) -> FlightPlan:
    """Return a plan of the items of MAVLink read from a file, in the order in which they are flown.

    speed_mps: where the items set none. Raises InputError with everything wrong in them.
    """
    order = in_flown_order(items.steps)
    problems = [*items.problems, *order.problems]
    try:
        items.limits.end()
    except ValueError as cause:
        problems.append(str(cause))
    if problems:
        raise InputError(str(path), problems)
    assumed = [f"{count} x {what}" for what, count in (+items.assumed).items()]
    return FlightPlan(
        str(path),
        path.stem,
        home,
        tuple(order.items),
        items.speed_mps or speed_mps,
        tuple(items.limits.fences),
        tuple(items.limits.rally),
        +items.left_out + items.limits.left_out,
        (*order.notes, *assumed),
    )


class Converted(NamedTuple):
    """A plan as the tables of a mission file, and what is to be stated about it."""

    tables: dict[str, Any]
    notes: tuple[str, ...]


def reach_of_plane(speed_mps: float) -> float:
    """Return within how far of a waypoint a plane of a speed counts as there."""
    return scale_of(MovementAutomaton.plane(speed_mps)).reach_radius_m


def as_mission(
    plan: FlightPlan,
    speed_mps: float | None = None,
    origin: tuple[float, float, float] | None = None,
    *,
    own_goals: bool = False,
    reach_m: Callable[[float], float] = reach_of_plane,
) -> Converted:
    """Tables of a mission file that flies the plan; the frame is east, north, up from home.

    speed_mps: in place of the plan's. origin: home, where the plan sets none. own_goals: whether
    the mission has waypoints itself, so that a plan of fences alone will do. reach_m: within how
    far a waypoint counts as reached, by speed. Raises InputError for a plan without a waypoint, or
    with one on the wrong side of a fence or too far away.
    """
    has_home = plan.home[:2] != NO_HOME[:2]
    unset = not has_home
    if unset and origin is not None:
        plan, unset = replace(plan, home=Geodetic(*origin)), False
    if unset:
        plan = _with_home(plan)
    counts = Counter(plan.counts)
    speed = speed_mps or plan.speed_mps or DEFAULT_SPEED_MPS
    tables: dict[str, Any] = {"vehicle": {"speed_mps": speed}, "lidar": [NOISE]}
    radius = reach_m(speed)
    start, goals, landing = _points(plan, radius, counts, has_home=has_home)
    if not goals and own_goals and plan.fences and not unset:
        return _fences_alone(plan, tables, speed)
    if not goals:
        raise InputError(plan.source, _without_waypoints(plan))
    if len(plan.items) > MOST_FLOWN:
        raise InputError(
            plan.source,
            f"{len(plan.items)} items; at most {MOST_FLOWN:,} are taken: fly it in parts",
        )
    _check_distance(plan, goals)
    waypoints = _apart(goals, radius, counts)
    _check_fences(plan, [*goals, *landing])
    towards = next((g for g in waypoints if np.linalg.norm(g - start) > radius), waypoints[0])
    yaw = np.degrees(np.arctan2(towards[1] - start[1], towards[0] - start[0]))
    tables["mission"] = {
        "name": plan.name,
        "origin_geodetic": tuple(plan.home),
        "waypoints_m": [_round_all(point) for point in waypoints],
        "landing_m": [_round_all(point) for point in landing],
    }
    tables["vehicle"] |= {
        "position_m": _round_all(start),
        "attitude_deg": (0.0, 0.0, round(float(yaw), 3)),
    }
    tables["obstacle"] = [_table(one) for one in _fence_volumes(plan)]
    notes = _notes(plan, speed, speed_mps, counts)
    if unset:
        notes = ("home is not set in the plan: the first place in it is taken for home", *notes)
    return Converted(tables, notes)


def _without_waypoints(plan: FlightPlan) -> str:
    """What a plan is that leads nowhere, and what to do with it."""
    if plan.fences:
        return (
            f"no waypoint in it: it holds limits of a flight ({len(plan.fences)} x fence, "
            f"{len(plan.rally)} x rally point); fences alone will do for a mission that names "
            "this file as its `plan` and has waypoints_m, and origin_geodetic where the plan has "
            "no home"
        )
    if plan.rally:
        return (
            f"no waypoint in it: it holds {len(plan.rally)} x rally point, places to return to at "
            "the end of a plan with waypoints"
        )
    return "no waypoint in it"


def _fences_alone(plan: FlightPlan, tables: dict[str, Any], speed_mps: float) -> Converted:
    """Tables of a plan that says where to stay, and nothing of where to go."""
    tables["mission"] = {"name": plan.name, "origin_geodetic": tuple(plan.home)}
    tables["obstacle"] = [_table(one) for one in _fence_volumes(plan)]
    note = (
        f"no waypoint in it: its {len(plan.fences)} fences are taken, about home as the origin; "
        f"{speed_mps:g} m/s goes with it"
    )
    return Converted(tables, (note,))


def _with_home(plan: FlightPlan) -> FlightPlan:
    """The plan with its first place as home; InputError where heights need to know home's."""
    first = next((one for one in plan.items if one.latitude_deg is not None), None)
    if first is None or first.latitude_deg is None or first.longitude_deg is None:
        return plan
    if any(item.above == "sea level" and item.height_m is not None for item in plan.items):
        raise InputError(
            plan.source,
            "home is not set (0, 0), and heights above sea level need its own; valid: a home with "
            "latitude, longitude and height, or "
            "origin_geodetic in a mission that names the plan",
        )
    return replace(plan, home=Geodetic(first.latitude_deg, first.longitude_deg, 0.0))


def _check_distance(plan: FlightPlan, goals: Iterable[FloatArray]) -> None:
    far = [
        f"goal {number}: {np.hypot(*goal[:2]) / 1000.0:,.0f} km from home, where down is another "
        f"way; at most {MOST_APART_M / 1000.0:g} km are flown"
        for number, goal in enumerate(goals, start=1)
        if np.hypot(*goal[:2]) > MOST_APART_M
    ]
    if far:
        raise InputError(plan.source, far)


def _points(
    plan: FlightPlan, radius_m: float, counts: Counter[str], *, has_home: bool
) -> tuple[FloatArray, list[FloatArray], list[FloatArray]]:
    """Start, waypoints and landing points [3] each, local frame."""
    start: FloatArray | None = None
    goals: list[FloatArray] = []
    landing: list[FloatArray] = []
    here = np.array([0.0, 0.0, _first_height(plan)])
    to_fly_to = [n for n, one in enumerate(plan.items) if one.action in ("take-off", "waypoint")]
    last_goal = max(to_fly_to, default=-1)
    for number, item in enumerate(plan.items):
        point = _local(plan, item, here)
        # Above the place, at the height flown: the descent itself is not flown.
        above = np.array([*point[:2], here[2]])
        if item.action == "take-off":
            climbed = _find_climbed(
                point, here, at_place=start is None and not goals and not has_home
            )
            if start is None and not goals:
                start = climbed
            else:
                goals.append(climbed)
            here = climbed
            away = float(np.hypot(*(point - here)[:2])) > radius_m
            if away and plan.flies_to_take_off:
                here = np.array([*point[:2], here[2]])
                goals.append(here)
            elif away:
                counts["place of a take-off: ArduPilot climbs where the vehicle stands"] += 1
        elif item.action == "return":
            landing.append(_return_to(plan, here))
        elif item.action == "land" and number < last_goal:
            counts["landing on the way: its place is passed at the height flown"] += 1
            goals.append(above)
            here = above
        elif item.action == "land":
            landing.append(above)
        else:
            goals.append(point)
            here = point
    if start is None:
        start = np.array([0.0, 0.0, goals[0][2] if goals else 0.0])
    if not goals:
        goals = [one for one in landing if np.linalg.norm(one - start) > radius_m][:1]
    return start, goals, landing


def _find_climbed(point: FloatArray, here: FloatArray, *, at_place: bool) -> FloatArray:
    """[3] where a take-off ends: above the vehicle, or above the place of a plan without a home."""
    height = point[2] if point[2] > 0.0 else here[2]
    return np.array([*(point if at_place else here)[:2], height])


def _first_height(plan: FlightPlan) -> float:
    """The height above home of the first item that has one and is none to land at."""
    for item in plan.items:
        if item.height_m is not None and item.action != "land":
            return float(_local(plan, item, np.zeros(3))[2])
    return 0.0


def _local(plan: FlightPlan, item: Item, here: FloatArray) -> FloatArray:
    """[3] local point of an item; one without a place or a height is where the vehicle is."""
    if item.height_m is None:
        above_home = float(here[2])
    else:
        above_home = item.height_m - (plan.home.height_m if item.above == "sea level" else 0.0)
    if item.latitude_deg is None or item.longitude_deg is None:
        return np.array([here[0], here[1], above_home])
    height = plan.home.height_m + above_home
    return enu_from_geodetic([item.latitude_deg, item.longitude_deg, height], plan.home)


def _return_to(plan: FlightPlan, here: FloatArray) -> FloatArray:
    """[3] above the nearest rally point, or else above home at the height flown."""
    if not plan.rally:
        return np.array([0.0, 0.0, here[2]])
    places = [
        enu_from_geodetic([*point[:2], plan.home.height_m + point.height_m], plan.home)
        for point in plan.rally
    ]
    return min(places, key=lambda place: float(np.hypot(*(place - here)[:2])))


def _apart(goals: list[FloatArray], radius_m: float, counts: Counter[str]) -> list[FloatArray]:
    """Waypoints without those that are reached together with the one before."""
    kept = goals[:1]
    for goal in goals[1:]:
        if np.linalg.norm(goal - kept[-1]) > radius_m:
            kept.append(goal)
        else:
            counts["waypoint within the reach radius of the one before"] += 1
    return kept


def _ring(outline: Disc | Polygon, home: Geodetic) -> FloatArray:
    """[n, 2] corners of a fence, local frame."""
    corners = around_disc(outline) if isinstance(outline, Disc) else outline.rings[0]
    heights = np.full((len(corners), 1), home.height_m)
    return enu_from_geodetic(np.concatenate([corners, heights], axis=1), home)[:, :2]


def _check_fences(plan: FlightPlan, goals: Iterable[FloatArray]) -> None:
    problems = []
    for fence in plan.fences:
        shapely = shapely_or_refuse("a geofence")
        area = shapely.Polygon(_ring(fence.outline, plan.home))
        for number, goal in enumerate(goals, start=1):
            if area.contains(shapely.Point(*goal[:2])) != fence.inclusion:
                side = "outside" if fence.inclusion else "inside"
                problems.append(f"{fence.name}: goal {number} lies {side} of it")
    if problems:
        raise InputError(plan.source, problems)


def _fence_volumes(plan: FlightPlan) -> list[Obstacle]:
    """Boxes over areas to stay outside of, and walls around those to stay inside."""
    low = Height(plan.home.height_m - FENCE_DEPTH_M, "sea level")
    high = Height(plan.home.height_m + FENCE_HEIGHT_M, "sea level")
    outside = [
        MapFeature(fence.name, fence.outline, low, high)
        for fence in plan.fences
        if not fence.inclusion
    ]
    volumes = place_features(outside, Place(plan.home), PlacingTally()) if outside else []
    for fence in plan.fences:
        if fence.inclusion:
            volumes += _walls(fence.name, _ring(fence.outline, plan.home))
    return volumes


def _walls(name: str, ring: FloatArray) -> list[Obstacle]:
    """A wall on every side of an area."""
    walls = []
    for start, end in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        along = end - start
        middle = 0.5 * (start + end)
        size = (float(np.hypot(*along)) + WALL_M, WALL_M, FENCE_DEPTH_M + FENCE_HEIGHT_M)
        height = 0.5 * (FENCE_HEIGHT_M - FENCE_DEPTH_M)
        yaw = float(np.arctan2(along[1], along[0]))
        walls.append(
            Obstacle.cuboid(
                [*middle, height], size, orientation_rad=(0.0, 0.0, yaw), name=f"{name}, wall"
            )
        )
    return walls


def _table(obstacle: Obstacle) -> dict[str, Any]:
    """An `[[obstacle]]` that is on the map only."""
    return {
        "shape": obstacle.shape,
        "position_m": _round_all(obstacle.position_m),
        "orientation_deg": tuple(np.degrees(obstacle.orientation_rad).tolist()),
        "size_m": obstacle.size_m,
        "name": obstacle.name,
        "known": "map",
    }


def _round_all(point: FloatArray) -> tuple[float, ...]:
    return tuple((np.round(point, 3) + 0.0).tolist())


def _notes(
    plan: FlightPlan, speed: float, chosen: float | None, counts: Mapping[str, int]
) -> tuple[str, ...]:
    origin = "chosen" if chosen else "the plan's" if plan.speed_mps else "assumed"
    notes = [
        f"home is the origin, {speed:g} m/s is {origin}; the flight begins and ends in the air"
    ]
    if any(item.above == "sea level" for item in plan.items):
        notes.append("heights above sea level are taken relative to home's")
    if any(item.above == "ground" for item in plan.items):
        notes.append("heights above the ground are taken as above home: no terrain is asked")
    if plan.rally and any(item.action == "return" for item in plan.items):
        notes.append(f"returns to the nearest of {len(plan.rally)} rally points")
    elif plan.rally:
        notes.append(f"{len(plan.rally)} rally points are not needed: the plan does not return")
    notes += plan.notes
    notes += [f"{count} left out: {reason}" for reason, count in counts.items()]
    return tuple(notes)
