"""Waypoint missions of DJI (WPML): `waylines.wpml`, what is flown, with `template.kml` beside it.

Heights are above the place of take-off, above the ground, or above the ellipsoid of WGS 84; the
latter are taken as above home, whose ellipsoidal height `takeOffRefPoint` tells.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Literal, NamedTuple

from clearway.base.errors import InputError
from clearway.io.foreign import position_of
from clearway.io.maps.map_features import Geodetic
from clearway.io.plans.flight_plan import FlightPlan
from clearway.io.plans.plan_items import Item, read_geodetic
from clearway.io.xml_tree import Element

MODES: dict[str, Literal["home", "ground", "ellipsoid", "sea level"]] = {
    "relativeToStartPoint": "home",
    "aboveGroundLevel": "ground",
    "realTimeFollowSurface": "ground",
    "WGS84": "ellipsoid",
    "EGM96": "sea level",
}
"""Of `executeHeightMode` and, in templates, of `heightMode`."""
FINISH = ("goHome", "autoLand", "gotoFirstWaypoint", "noAction")
NO_HOME = Geodetic(0.0, 0.0, 0.0)
TOLD = 10


class Start(NamedTuple):
    """The place of take-off; its height is above the ellipsoid."""

    geodetic: Geodetic
    sea_level_m: float | None
    """Height of the sea level above the ellipsoid there; None where nothing tells."""


def is_wpml(root: Element) -> bool:
    """Whether a document is DJI's: it says how missions are flown."""
    return next(root.every("missionConfig"), None) is not None


def wpml_plan(path: Path, root: Element, template: Element | None) -> FlightPlan:
    """The mission of `waylines.wpml`, or of a template alone; InputError with all that is wrong."""
    problems: list[str] = []
    counts: Counter[str] = Counter()
    config = next(root.every("missionConfig"))
    start = _start(template or root, problems)
    items, speeds = [], []
    folders = [one for one in root.every("Folder") if one.child("Placemark") is not None]
    for folder in folders:
        speed = _number(folder, "autoFlightSpeed", problems)
        speeds += [] if speed is None else [speed]
        items += _list_flown(folder, start, counts, problems)
    if not folders:
        problems.append(f"line {root.line}: no <Folder> with a <Placemark>: no waypoint in it")
    if start is not None:
        items = [*_take_off(config, start, items, problems), *items]
    if problems:
        raise InputError(str(path), problems[:TOLD])
    notes = []
    home = NO_HOME
    if start is not None:
        home = start.geodetic
        if start.sea_level_m is None:
            notes.append("home's height is above the ellipsoid; maps count from the sea level")
        else:
            home = home._replace(height_m=home.height_m - start.sea_level_m)
    if len(folders) > 1:
        notes.append(f"{len(folders)} waylines are flown one after the other")
    if len(set(speeds)) > 1:
        notes.append(f"of their speeds the first is flown, {speeds[0]:g} m/s")
    items += _finish(path, config, items)
    speed = speeds[0] if speeds and speeds[0] > 0.0 else None
    return FlightPlan(
        str(path), path.stem, home, tuple(items), speed, counts=+counts, notes=tuple(notes)
    )


def _start(document: Element, problems: list[str]) -> Start | None:
    """`takeOffRefPoint` as latitude,longitude,height; the geoid by any place with both heights."""
    told = next(document.every("takeOffRefPoint"), None)
    if told is None or not told.text:
        return None
    try:
        latitude, longitude, height = (float(word) for word in told.text.split(","))
        place = read_geodetic(latitude, longitude, height)
    except ValueError as cause:
        problems.append(f"line {told.line}: takeOffRefPoint {told.text[:40]!r}: {cause}")
        return None
    modes = [one.text for one in document.every("heightMode")]
    if modes and modes[0] == "EGM96":
        for mark in document.every("Placemark"):
            above_sea = _number(mark, "height", problems)
            ellipsoidal = _number(mark, "ellipsoidHeight", problems)
            if above_sea is not None and ellipsoidal is not None:
                return Start(place, ellipsoidal - above_sea)
    return Start(place, None)


def _list_flown(
    folder: Element, start: Start | None, counts: Counter[str], problems: list[str]
) -> list[Item]:
    """Waypoints of a wayline, by their index."""
    stated = folder.read_text("executeHeightMode") or next(
        (one.text for one in folder.every("heightMode")), "relativeToStartPoint"
    )
    if stated not in MODES:
        problems.append(f"line {folder.line}: height mode {stated!r}; valid: {', '.join(MODES)}")
        return []
    found = []
    for number, mark in enumerate(one for one in folder.children if one.name == "Placemark"):
        index = _number(mark, "index", problems)
        item = _waypoint(mark, folder, stated, start, problems)
        if item is not None:
            found.append((number if index is None else index, item))
        counts["action of camera or gimbal"] += sum(1 for _ in mark.every("action"))
        counts["speed of a waypoint's own"] += mark.read_text("useGlobalSpeed") == "0"
    return [item for _, item in sorted(found, key=lambda entry: entry[0])]


def _waypoint(
    mark: Element, folder: Element, mode: str, start: Start | None, problems: list[str]
) -> Item | None:
    where = f"line {mark.line}, waypoint {mark.read_text('index')}"
    point = mark.child("Point")
    words = ("" if point is None else point.read_text("coordinates")).split(",")
    names = ("executeHeight", "height") if mode != "WGS84" else ("executeHeight", "ellipsoidHeight")
    heights = (_number(mark, name, problems) for name in names)
    height = next((one for one in heights if one is not None), None)
    if height is None:
        height = _number(folder, "globalHeight", problems)
    try:
        if height is None:
            raise ValueError(f"no height ({', '.join(names)})")
        latitude, longitude = position_of([float(words[0]), float(words[1])])
        above = MODES[mode]
        if above == "ellipsoid":
            if start is None:
                raise ValueError("height above the ellipsoid, but no takeOffRefPoint tells home's")
            above, height = "home", height - start.geodetic.height_m
        elif above == "sea level" and start is not None and start.sea_level_m is None:
            raise ValueError("height above sea level, but home's is above the ellipsoid alone")
        read_geodetic(latitude, longitude, height)
    except (ValueError, IndexError) as cause:
        told = cause if isinstance(cause, ValueError) else f"no place, got {','.join(words)[:40]!r}"
        problems.append(f"{where}: {told}")
        return None
    return Item(where, "waypoint", latitude, longitude, height, above)


def _take_off(config: Element, start: Start, items: list[Item], problems: list[str]) -> list[Item]:
    """Up to the safe height, with `safely` on to the first waypoint's, before it leaves home."""
    security = _number(config, "takeOffSecurityHeight", problems)
    height = max(security or 0.0, 0.0)
    first = items[0] if items else None
    if first is not None and first.height_m is not None and first.above == "home":
        safely = config.read_text("flyToWaylineMode") != "pointToPoint"
        height = max(height, first.height_m) if safely or not height else height
    if height <= 0.0:
        return []
    place = start.geodetic
    return [Item("take-off", "take-off", place[0], place[1], height, "home")]


def _finish(path: Path, config: Element, items: list[Item]) -> list[Item]:
    """What is done after the last waypoint."""
    action = config.read_text("finishAction") or "noAction"
    if action not in FINISH:
        raise InputError(
            str(path),
            f"line {config.line}: finishAction {action[:40]!r}; valid: {', '.join(FINISH)}",
        )
    if action == "goHome":
        return [Item(action, "return", None, None, 0.0, "home")]
    if action == "autoLand":
        return [Item(action, "land", None, None, 0.0, "home")]
    if action == "gotoFirstWaypoint":
        return [next(one for one in items if one.action == "waypoint")]
    return []


def _number(element: Element, name: str, problems: list[str]) -> float | None:
    """A finite number of a child; None where there is none."""
    told = element.child(name)
    if told is None or not told.text:
        return None
    try:
        value = float(told.text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        problems.append(f"line {told.line}: {name} {told.text[:40]!r} is no number")
        return None
    return value
