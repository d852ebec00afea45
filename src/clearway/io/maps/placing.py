"""Map features into a local frame: outlines become boxes, heights above ground become heights."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, enu_from_geodetic, geodetic_from_enu
from clearway.io.maps.map_features import Disc, Geodetic, Height, MapFeature
from clearway.io.maps.rectangles import Cover, cover_polygon
from clearway.io.maps.terrain import Terrain
from clearway.obstacles.obstacle import Obstacle

MOST_PILLAR_M = 60.0
"""A disc up to this radius is one square pillar around it, a larger one is cut into boxes."""
DISC_CORNERS = 32
MOST_APART_M = 100_000.0
"""Farther from the origin, down is no longer where the local frame has it (by a degree)."""
GEOID_M = (-107.0, 86.0)
"""Between these the sea level lies above the WGS 84 ellipsoid, anywhere on Earth."""
FLOOR_DEPTH_M = 20.0
"""How far the floor reaches below the lowest ground."""
Bounds = tuple[FloatArray, FloatArray]
"""Lowest and highest x, y [2] each of a local frame."""


@dataclass(slots=True)
class PlacingTally:
    """What placing adds to a file's account."""

    left_out: Counter[str] = field(default_factory=Counter)
    outlines: int = 0
    polygon_m2: float = 0.0
    covered_m2: float = 0.0
    assumed_ground: int = 0
    ellipsoid: int = 0

    def notes(self) -> tuple[str, ...]:
        """What was assumed, in sentences."""
        notes = []
        if self.outlines:
            excess = 100.0 * (self.covered_m2 / self.polygon_m2 - 1.0)
            notes.append(
                f"{self.outlines} outlines are covered by boxes, which take {excess:.1f} % more "
                "area than the outlines"
            )
        if self.assumed_ground:
            notes.append(
                f"{self.assumed_ground} heights are above a ground that no terrain file tells: "
                "the origin's height is taken for it"
            )
        if self.ellipsoid:
            notes.append(
                f"{self.ellipsoid} heights are above the ellipsoid: extended by all that sea level "
                f"may differ from it ({-GEOID_M[1]:g} to {-GEOID_M[0]:g} m)"
            )
        return tuple(notes)


MOST_PLACED = 100_000
TOO_MANY = f"{{:,}} obstacles on the map, at most {MOST_PLACED:,} are taken; valid: a part of it"


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A local frame: east, north, up in metres from an origin."""

    origin: Geodetic
    ground: Terrain | None = None
    bounds_m: Bounds | None = None
    """Beyond these nothing is wanted."""

    def enu(self, latitude_longitude: FloatArray, height_m: float) -> FloatArray:
        """[n, 3] local points of places [n, 2] at a height above sea level."""
        heights = np.full((len(latitude_longitude), 1), height_m)
        return enu_from_geodetic(np.concatenate([latitude_longitude, heights], axis=1), self.origin)

    def corners(self) -> FloatArray | None:
        """[4, 2] latitude, longitude of the bounds."""
        if self.bounds_m is None:
            return None
        (west, south), (east, north) = self.bounds_m
        box = [[west, south, 0], [east, south, 0], [east, north, 0], [west, north, 0]]
        return geodetic_from_enu(box, self.origin)[:, :2]

    def wants(self, low_m: FloatArray, high_m: FloatArray) -> bool:
        """Whether a box of x, y [2] reaches into the bounds."""
        if self.bounds_m is None:
            return True
        return bool(np.all(high_m >= self.bounds_m[0]) and np.all(low_m <= self.bounds_m[1]))


def place_features(
    features: Iterable[MapFeature], place: Place, tally: PlacingTally
) -> list[Obstacle]:
    """Cuboids that hold the features, in the frame of the place; the tally counts the rest.

    Raises ClearwayError for more features than can be placed in minutes and a gigabyte.
    """
    features, placed = list(features), 0
    if place.bounds_m is None and len(features) > MOST_PLACED:
        raise ClearwayError(TOO_MANY.format(len(features)))
    obstacles: list[Obstacle] = []
    for feature in features:
        outline = feature.outline
        rings = (around_disc(outline),) if isinstance(outline, Disc) else outline.rings
        low_height, high_height = _heights(feature, rings[0], place, tally)
        local = [place.enu(ring, low_height) for ring in rings]
        flat = [ring[:, :2] for ring in local]
        if not place.wants(flat[0].min(axis=0), flat[0].max(axis=0)):
            tally.left_out["outside the area"] += 1
            continue
        if np.hypot(*flat[0].T).min() > MOST_APART_M:
            tally.left_out[f"farther than {MOST_APART_M / 1000:g} km from the origin"] += 1
            continue
        placed += 1
        if placed > MOST_PLACED:
            raise ClearwayError(TOO_MANY.format(placed))
        low = float(local[0][:, 2].mean())
        high = low + high_height - low_height
        if not high > low:
            tally.left_out["top not above its foot"] += 1
        elif isinstance(outline, Disc) and outline.radius_m <= MOST_PILLAR_M:
            center = place.enu(np.array([[outline.latitude_deg, outline.longitude_deg]]), 0.0)[0]
            side = 2.0 * outline.radius_m
            obstacles.append(_box(center[:2], (side, side), 0.0, (low, high), feature.name))
        else:
            obstacles.extend(_boxes(cover_polygon(flat), (low, high), feature.name, tally))
    return obstacles


def place_floor(terrain: Terrain, place: Place) -> tuple[list[Obstacle], tuple[str, ...]]:
    """The ground as blocks in the frame of the place, and what they add to it."""
    blocks, lift = terrain.floor(place.corners())
    if not blocks:
        return [], (f"{terrain.name}: no ground inside the area",)
    lowest = min(block.top_m - block.relief_m for block in blocks) - FLOOR_DEPTH_M
    obstacles = []
    for block in blocks:
        corners = place.enu(terrain.corners(block), block.top_m)
        along, across = corners[1] - corners[0], corners[3] - corners[0]
        # As large as its longest sides: neighbours overlap rather than leave a gap.
        size = (
            float(max(np.hypot(*along[:2]), np.hypot(*(corners[2] - corners[3])[:2]))),
            float(max(np.hypot(*across[:2]), np.hypot(*(corners[2] - corners[1])[:2]))),
        )
        top = float(corners[:, 2].max())
        yaw = float(np.arctan2(along[1], along[0]))
        span = (top - (block.top_m - lowest), top)
        obstacles.append(_box(corners[:, :2].mean(axis=0), size, yaw, span, "ground"))
    return obstacles, (
        f"the floor is {len(blocks)} blocks, on average {lift:.1f} m above the terrain and never "
        "below it",
    )


def _boxes(
    covered: Cover, span_m: tuple[float, float], name: str, tally: PlacingTally
) -> list[Obstacle]:
    if not covered.rectangles:
        tally.left_out["outline without an area"] += 1
        return []
    tally.outlines += 1
    tally.polygon_m2 += covered.polygon_m2
    tally.covered_m2 += covered.covered_m2
    return [_box(one.center_m, one.size_m, one.yaw_rad, span_m, name) for one in covered.rectangles]


def _box(
    center_m: FloatArray,
    size_m: tuple[float, float],
    yaw_rad: float,
    span_m: tuple[float, float],
    name: str,
) -> Obstacle:
    low, high = span_m
    return Obstacle.cuboid(
        [center_m[0], center_m[1], 0.5 * (low + high)],
        (*size_m, high - low),
        orientation_rad=(0.0, 0.0, yaw_rad),
        name=name,
    )


def _heights(
    feature: MapFeature, ring: FloatArray, place: Place, tally: PlacingTally
) -> tuple[float, float]:
    """Lower and upper limit above sea level; over uneven ground, from its lowest to its highest."""
    ground: tuple[float, float] | None = None
    if "ground" in (feature.low.above, feature.high.above):
        ground = place.ground.span_m(ring) if place.ground is not None else None
        if ground is None:
            tally.assumed_ground += 1
            ground = (place.origin.height_m, place.origin.height_m)
    tally.ellipsoid += "ellipsoid" in (feature.low.above, feature.high.above)
    low, high = (
        _above_sea(height, end, ground) for end, height in enumerate((feature.low, feature.high))
    )
    return low, high


def _above_sea(height: Height, end: int, ground: tuple[float, float] | None) -> float:
    """end: 0 for a lower limit, 1 for an upper one."""
    if height.above == "ground" and ground is not None:
        return height.value_m + ground[end]
    if height.above == "ellipsoid":
        return height.value_m - GEOID_M[1 - end]
    return height.value_m


def around_disc(disc: Disc) -> FloatArray:
    """[corners, 2] a polygon around a disc, latitude and longitude in degrees."""
    center = (disc.latitude_deg, disc.longitude_deg, 0.0)
    angles = 2.0 * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS
    radius = disc.radius_m / np.cos(np.pi / DISC_CORNERS)
    points = np.stack([radius * np.cos(angles), radius * np.sin(angles), 0.0 * angles], axis=-1)
    return geodetic_from_enu(points, center)[:, :2]
