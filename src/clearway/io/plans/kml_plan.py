"""Paths and places of KML (.kml, .kmz) as flight plans, and missions of DJI in the same container.

A KML is flown along its one path, or from place to place in the order of the file. Heights are
what `altitudeMode` says: above the ground or above sea level (EGM96).
"""

from __future__ import annotations

import zipfile
import zlib
from collections import Counter
from pathlib import Path
from typing import Literal, NamedTuple

from clearway.base.errors import InputError, naming
from clearway.io.foreign import position_of
from clearway.io.foreign_errors import damage_told
from clearway.io.maps.map_features import Geodetic
from clearway.io.plans.dji_wpml import is_wpml, wpml_plan
from clearway.io.plans.flight_plan import FlightPlan
from clearway.io.plans.plan_items import Item, read_geodetic
from clearway.io.xml_tree import Element, parse_xml

MOST_BYTES = 40_000_000
"""Of a document, unpacked."""
MOST_MEMBERS = 10_000
WAYLINES = "waylines.wpml"
TEMPLATE = "template.kml"
ABOVE: dict[str, Literal["sea level", "ground"]] = {
    "absolute": "sea level",
    "relativeToGround": "ground",
}
HOMES = ("home", "launch", "takeoff", "take-off", "take off")
"""Names of a place, without regard to case, that is taken for home."""
PATHS = ("LineString", "Track")
COMPLAINTS = (zipfile.BadZipFile, zlib.error, NotImplementedError)
"""Of the library, besides Python's own; the last where a packing is not known."""
TOLD = 10
UNSET = Geodetic(0.0, 0.0, 0.0)


class PlaceTold(NamedTuple):
    """A place as KML has it: degrees, and a height of the kind that its mode says."""

    where: str
    latitude_deg: float
    longitude_deg: float
    height_m: float


def read_kml(path: Path) -> FlightPlan:
    """The plan in a KML document, or in one of DJI's; InputError with everything wrong in it."""
    with naming(path, "read"):
        content = path.read_bytes()
    return _plan(path, {path.name: content})


def read_kmz(path: Path) -> FlightPlan:
    """The same, packed: DJI's `waylines.wpml` with its `template.kml`, else the first KML in it."""
    with (
        naming(path, "read"),
        damage_told(path, "KMZ", COMPLAINTS),
        zipfile.ZipFile(path) as packed,
    ):
        names = [one.filename for one in packed.infolist()[:MOST_MEMBERS]]
        # One of each, since each may unpack to far more than it takes.
        last = {n.rpartition("/")[2]: n for n in names}
        wanted = [last[name] for name in (WAYLINES, TEMPLATE) if name in last]
        wanted = wanted or [n for n in names if n.lower().endswith(".kml")][:1]
        if not wanted:
            held = ", ".join(names[:6]) or "nothing"
            raise InputError(str(path), f"no {WAYLINES} and no .kml in it; it holds {held}")
        contents = {name.rpartition("/")[2]: _member(path, packed, name) for name in wanted}
    return _plan(path, contents)


def _member(path: Path, packed: zipfile.ZipFile, name: str) -> bytes:
    with packed.open(name) as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise InputError(str(path), f"{name} unpacks to more than {MOST_BYTES:,} bytes")
    return content


def _plan(path: Path, contents: dict[str, bytes]) -> FlightPlan:
    roots = {}
    for name, content in contents.items():
        try:
            roots[name] = parse_xml(content)
        except ValueError as cause:
            raise InputError(str(path), f"{name}: no whole XML, {cause}") from cause
    main = roots.get(WAYLINES) or next(iter(roots.values()))
    if is_wpml(main):
        return wpml_plan(path, main, roots.get(TEMPLATE))
    return kml_plan(path, main)


def kml_plan(path: Path, root: Element) -> FlightPlan:
    """The path of a KML, or its places; raises InputError where there are several, or none."""
    if root.name != "kml":
        raise InputError(str(path), f"line {root.line}: <{root.name}>; valid: <kml>")
    counts: Counter[str] = Counter()
    problems: list[str] = []
    paths: list[tuple[str, list[Item]]] = []
    places: list[Item] = []
    home = UNSET
    for mark in root.every("Placemark"):
        name = mark.read_text("name") or f"line {mark.line}"
        for one in mark.every("Point", *PATHS, "Polygon", "LinearRing", "Model"):
            if one.name == "Point" and name.strip().lower() in HOMES:
                home = _home(one, problems)
            elif one.name == "Point":
                places += _items(name, one, problems)
            elif one.name in PATHS:
                paths.append((name, _items(name, one, problems)))
            else:
                counts[f"{one.name}, which is no way to fly"] += 1
    if len(paths) > 1:
        names = ", ".join(repr(name) for name, _ in paths[:TOLD])
        problems.append(f"{len(paths)} paths ({names}); valid: one, or places alone")
    if problems:
        raise InputError(str(path), problems[:TOLD])
    if paths and places:
        counts["place beside the path"] += len(places)
    items = paths[0][1] if paths else places
    return FlightPlan(str(path), path.stem, home, _begin(items, home), counts=counts)


def _begin(items: list[Item], home: Geodetic) -> tuple[Item, ...]:
    """Where no home is reported, the first place is where the flight begins."""
    if home == UNSET and len(items) > 1:
        items = [items[0]._replace(action="take-off"), *items[1:]]
    return tuple(items)


def _home(point: Element, problems: list[str]) -> Geodetic:
    for one in _places(point, problems):
        return Geodetic(one.latitude_deg, one.longitude_deg, one.height_m)
    return UNSET


def _items(name: str, one: Element, problems: list[str]) -> list[Item]:
    mode = one.read_text("altitudeMode") or "clampToGround"
    places = _places(one, problems)
    if mode not in ABOVE:
        problems.append(
            f"{name} (line {one.line}): altitudeMode {mode}: it tells no height to fly at; valid: "
            f"{', '.join(ABOVE)}, with heights"
        )
        return []
    return [
        Item(f"{name}, {p.where}", "waypoint", p.latitude_deg, p.longitude_deg, p.height_m,
             ABOVE[mode])
        for p in places
    ]  # fmt: skip


def _places(one: Element, problems: list[str]) -> list[PlaceTold]:
    """Of `coordinates` (longitude,latitude,height words) or of a track's `coord` elements."""
    if one.name == "Track":
        words = [
            (child.line, child.text.split()) for child in one.children if child.name == "coord"
        ]
    else:
        told = one.child("coordinates")
        line = one.line if told is None else told.line
        words = [(line, word.split(",")) for word in ("" if told is None else told.text).split()]
    found = []
    for number, (line, word) in enumerate(words):
        where = f"line {line}, place {number}"
        try:
            found.append(_place(where, word))
        except ValueError as cause:
            problems.append(f"{where}: {cause}")
            if len(problems) >= TOLD:
                break
    if not words:
        problems.append(f"<{one.name}> (line {one.line}): no coordinates in it")
    return found


def _place(where: str, word: list[str]) -> PlaceTold:
    if not 2 <= len(word) <= 3:
        raise ValueError(f"{','.join(word)[:40]!r} is no longitude,latitude,height")
    longitude, latitude, height = (float(part) for part in [*word, "0"][:3])
    latitude, longitude = position_of([longitude, latitude])
    return PlaceTold(where, *read_geodetic(latitude, longitude, height))
