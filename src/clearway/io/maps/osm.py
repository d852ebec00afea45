"""Buildings, masts and towers of OpenStreetMap (XML or PBF) through pyosmium.

Heights are above ground, as OpenStreetMap has them. Areas are put together by the library, in a
process of its own; ways and relations whose nodes are not in the file are counted.
"""

from __future__ import annotations

from collections import Counter
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError, MissingExtraError
from clearway.io.apart import apart
from clearway.io.maps.geojson import LENGTH, radius_notes, read_heights
from clearway.io.maps.map_features import Disc, MapFeature, ParsedMap, Polygon

STOREY_M = 4.0
"""More than most are high."""
STOREYS = "building:levels"
ROOF = "roof:levels"
STANDS = ("building", "building:part")
MAN_MADE = (
    "mast", "tower", "chimney", "silo", "storage_tank", "water_tower", "communications_tower",
    "antenna", "flagpole", "crane", "gasometer", "cooling_tower",
)  # fmt: skip
POWER = ("tower", "pole", "portal", "generator")
KEYS = ("height", *STANDS, STOREYS, "man_made", "power")
MOST_BYTES = 200_000_000
TOLD = 3


class OsmObject(NamedTuple):
    """What is taken of an object; all of it can be sent from process to process."""

    name: str
    tags: dict[str, str]
    outlines: list[list[Any]]
    """Rings [n, 2] of latitude and longitude, the outer one first; none of a node or a line."""
    place: tuple[float, float] | None
    """Of a node."""


def read_osm(path: Path, radius_m: float) -> ParsedMap:
    """What states a height or storeys; InputError where nothing does, or it is damaged."""
    try:
        import osmium  # noqa: F401
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "map") from cause
    if path.stat().st_size > MOST_BYTES:
        raise InputError(
            str(path),
            f"more than {MOST_BYTES:,} bytes; cut the area out that is flown in (`osmium extract "
            "-b W,S,E,N`)",
        )
    objects, incomplete = apart(path, "OpenStreetMap file", objects_in, path)
    counts: Counter[str] = Counter(incomplete)
    features: list[MapFeature] = []
    odd: list[str] = []
    storeys = 0
    for one in objects:
        told = _make_properties(one.tags)
        try:
            span = read_heights(told)
        except ValueError:
            odd.append(f"{one.name}: {told.get('height')!r}")
            counts["height that is no length"] += 1
            continue
        outlines = _outlines(one, radius_m)
        if isinstance(span, str):
            kind = _kind(one.tags)
            counts[f"{kind}: {span}" if kind else "other object without a height"] += 1
        elif not outlines:
            counts["line: no outline"] += 1
        else:
            storeys += "height" not in one.tags
            name = one.tags.get("name") or one.name
            features += [MapFeature(name, outline, *span) for outline in outlines]
    if not features:
        left = ", ".join(f"{count} {reason}" for reason, count in counts.items())
        raise InputError(
            str(path),
            f"no area or node with a height in it (left out: {left or 'nothing'}); valid tags: "
            f"height, {STOREYS}",
        )
    notes = [f"heights that are no lengths: {'; '.join(odd[:TOLD])}"] if odd else []
    if storeys:
        notes.append(f"{storeys} buildings tell storeys alone: {STOREY_M:g} m each are assumed")
    return ParsedMap(
        "OpenStreetMap", "WGS 84 latitude and longitude", tuple(features), counts=dict(counts),
        notes=(*radius_notes(features, radius_m), *notes),
    )  # fmt: skip


def objects_in(path: Path) -> tuple[list[OsmObject], dict[str, int]]:
    """Objects with a tag that says that they stand, and counts of areas that are not whole."""
    osmium: Any = import_module("osmium")
    found: list[OsmObject] = []
    waiting: dict[tuple[str, int], OsmObject] = {}
    source = osmium.FileProcessor(str(path)).with_locations().with_areas()
    for one in source.with_filter(osmium.filter.KeyFilter(*KEYS)):
        tags = {tag.k: tag.v for tag in one.tags}
        if one.is_node():
            place = (one.location.lat, one.location.lon) if one.location.valid() else None
            found.append(OsmObject(f"node {one.id}", tags, [], place))
        elif one.is_area():
            kind = "way" if one.from_way() else "relation"
            waiting.pop((kind, one.orig_id()), None)
            found.append(OsmObject(f"{kind} {one.orig_id()}", tags, _polygons(one), None))
        else:
            kind = "way" if one.is_way() else "relation"
            waiting[kind, one.id] = OsmObject(f"{kind} {one.id}", tags, [], None)
    broken: Counter[str] = Counter()
    for (kind, _), left in waiting.items():
        if _kind(left.tags) and (kind == "relation" or any(key in left.tags for key in STANDS)):
            broken["outline that is not whole in the file"] += 1
        else:
            found.append(left)
    return found, dict(broken)


def _polygons(area: Any) -> list[list[Any]]:
    polygons = []
    for outer in area.outer_rings():
        rings = [outer, *area.inner_rings(outer)]
        polygons.append([np.array([(n.lat, n.lon) for n in ring])[:-1] for ring in rings])
    return polygons


def _kind(tags: dict[str, str]) -> str:
    """What an object is called that stands; empty for others."""
    if any(tags.get(key, "no") != "no" for key in STANDS):
        return "building"
    if tags.get("man_made") in MAN_MADE:
        return tags["man_made"].replace("_", " ")
    return f"power {tags['power']}" if tags.get("power") in POWER else ""


def _make_properties(tags: dict[str, str]) -> dict[str, Any]:
    """Height and foot as GeoJSON's properties have them."""
    told: dict[str, Any] = {key: tags[key] for key in ("height", "min_height") if key in tags}
    storeys = _count(tags, STOREYS)
    if "height" not in told and storeys is not None:
        told["height"] = STOREY_M * (storeys + (_count(tags, ROOF) or 0.0))
    return told


def _count(tags: dict[str, str], key: str) -> float | None:
    """Storeys; of several, the most. None where the tag is none."""
    found = [LENGTH.fullmatch(word.strip()) for word in tags.get(key, "").split(";")]
    counts = [float(one[1]) for one in found if one is not None and not one[2]]
    return max(counts) if counts else None


def _outlines(one: OsmObject, radius_m: float) -> list[Disc | Polygon]:
    if one.place is not None:
        return [Disc(*one.place, radius_m)]
    return [Polygon(tuple(rings)) for rings in one.outlines]
