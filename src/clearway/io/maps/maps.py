"""Map files of any known format: obstacles in a local frame, and zones to keep out of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path

import numpy as np

from clearway.avoidance.rules import GroundHeights
from clearway.base.brief import brief
from clearway.base.checks import above_zero_problem
from clearway.base.errors import ClearwayError, InputError, naming
from clearway.base.frames import FloatArray
from clearway.io.foreign_errors import damage_told
from clearway.io.maps.ground import ground_heights
from clearway.io.maps.map_features import (
    UNLIMITED_M,
    Daily,
    Disc,
    Geodetic,
    Height,
    MapFeature,
    ParsedMap,
    Period,
    ZoneFeature,
    as_stated,
)
from clearway.io.maps.placing import Bounds, Place, PlacingTally, place_features, place_floor
from clearway.io.maps.plausible import LARGEST_POINT_RADIUS_M, refuse_impossible
from clearway.io.what_file import reader_of, refuse_others, require_files
from clearway.obstacles.obstacle import Obstacle

POINT_RADIUS_M = 20.0
"""Assumed around obstacles that a file gives as mere points."""
NOTHING_LEFT = "WARNING: nothing of this map is left"
"""How the note begins that says so."""
WEEK = ("MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN")


@dataclass(frozen=True, slots=True, eq=False)
class KeepOut:
    """A zone of the airspace: nothing is there to be seen, and yet it is to be kept clear of."""

    identifier: str
    name: str
    restriction: str
    """As the file says: PROHIBITED, REQ_AUTHORIZATION, CONDITIONAL, ..."""
    limits: tuple[str, ...]
    """Lower and upper limit of each of its volumes, in words."""
    periods: tuple[Period, ...]
    """When it is in force; none means always."""
    obstacles: tuple[Obstacle, ...]
    """Volumes that hold it, local frame."""

    __repr__ = brief

    def in_force(self, at: datetime | None) -> bool:
        """Whether it counts at a moment; without one, any zone does."""
        return at is None or not self.periods or any(_covers(one, at) for one in self.periods)


@dataclass(frozen=True, slots=True, eq=False)
class MapFile:
    """One map file in a local frame: x east, y north, z up from the origin, metres."""

    source: str
    kind: str
    crs: str
    origin: Geodetic
    obstacles: tuple[Obstacle, ...]
    """What stands on the ground."""
    floor: tuple[Obstacle, ...] = ()
    """Blocks that hold the ground."""
    ground: GroundHeights | None = None
    """The ground itself, where the file is a terrain and an area was asked for."""
    keep_out: tuple[KeepOut, ...] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
    """What was left out, by reason."""
    notes: tuple[str, ...] = ()
    """What was assumed where the file is silent; to be shown."""

    __repr__ = brief

    @property
    def is_empty(self) -> bool:
        """Whether nothing at all is left of it: a flight with it is one without a map."""
        return not (self.obstacles or self.floor or self.keep_out)

    @property
    def solid(self) -> tuple[Obstacle, ...]:
        """Everything that is really there."""
        return self.obstacles + self.floor


def read_map(
    path: str | Path, origin: Geodetic | None = None, *, point_radius_m: float = POINT_RADIUS_M
) -> MapFile:
    """Read one map file; the suffix and the content tell its format.

    Parameters
    ----------
    path
        The file.
    origin
        Latitude, longitude and height above sea level of the local frame; by default amid the
        places of the file, at its lowest ground.
    point_radius_m
        Of what the file gives as a mere point; above 0, at most 100 km.

    Returns
    -------
    MapFile
        Its obstacles in the local frame, in metres.

    Raises
    ------
    InputError
        When the file is absent, empty, truncated or of no known format.
    MissingExtraError
        When the package that reads the format is not installed.
    ClearwayError
        For a `point_radius_m` out of range.

    Examples
    --------
    >>> from pathlib import Path
    >>> import clearway as cw
    >>> place = '{"type": "Point", "coordinates": [14.5, 46.05]}'
    >>> mast = '{"type": "Feature", "properties": {"height": 40}, "geometry": ' + place + "}"
    >>> masts = '{"type": "FeatureCollection", "features": [' + mast + "]}"
    >>> _ = Path("masts.geojson").write_text(masts)
    >>> len(cw.ObstacleMap(cw.read_map("masts.geojson").solid))
    1
    """
    return read_maps([path], origin, point_radius_m=point_radius_m)[0]


def read_maps(
    paths: Sequence[str | Path],
    origin: Geodetic | None = None,
    *,
    bounds_m: Bounds | None = None,
    point_radius_m: float = POINT_RADIUS_M,
    crs: str | None = None,
) -> tuple[MapFile, ...]:
    """Map files of known formats in one local frame; the suffix and the content tell which.

    origin: latitude, longitude, height above sea level; by default amid the places of the first
    file that has any, at its lowest ground. A terrain among the files is the ground that heights of
    the others are above. bounds_m: lowest and highest x, y; what lies beyond is left out and
    counted. point_radius_m: above 0, at most 100 km. crs: reference system of a CityJSON model or a
    Shapefile that states none, such as EPSG:7415. Raises InputError when a file is absent, empty,
    truncated or of no known format, SeveralErrors when several are absent, MissingExtraError when
    the package that reads it is not installed, and ClearwayError for a point_radius_m that is none.
    """
    problem = above_zero_problem("point_radius_m", point_radius_m, LARGEST_POINT_RADIUS_M)
    if problem is not None:
        raise ClearwayError(problem)
    require_files(map(Path, paths))
    parsed = [_parse(Path(path), point_radius_m, crs) for path in paths]
    ground = next((one.terrain for one in parsed if one.terrain is not None), None)
    place = Place(origin or _middle(paths, parsed), ground, bounds_m)
    placed = []
    for path, one in zip(paths, parsed, strict=True):
        with damage_told(path, "map"):
            placed.append(_place(str(path), one, place))
    return tuple(placed)


def _parse(path: Path, radius_m: float, crs: str | None) -> ParsedMap:
    from clearway.io.maps.map_formats import READERS, Assumed

    if path.is_dir():
        raise InputError(str(path), "is a folder; the file of a map is needed")
    reader = reader_of(path, READERS, "map")
    with naming(path, "read"):
        empty = path.stat().st_size == 0
    if empty:
        raise InputError(str(path), "the file is empty (0 bytes)")
    refuse_others(path, "map")
    with damage_told(path, "map"):
        parsed = reader(path, Assumed(radius_m, crs))
    refuse_impossible(path, parsed)
    if crs is None or as_stated(crs) in parsed.notes:
        return parsed
    unused = f"{crs} is not used: the file, or its format, states a reference system itself"
    return replace(parsed, notes=(*parsed.notes, unused))


def _middle(paths: Sequence[str | Path], maps: Sequence[ParsedMap]) -> Geodetic:
    """Where a local frame begins by default: amid a file's places, at its lowest ground."""
    for parsed in maps:
        if parsed.terrain is not None:
            latitude, longitude = parsed.terrain.extent().mean(axis=0)
            lowest = float(np.nanmin(parsed.terrain.height_m))
            return Geodetic(float(latitude), float(longitude), lowest)
        features = [*parsed.features, *(one for zone in parsed.zones for one in zone.features)]
        if features:
            heights = [part.low.value_m for part in features if part.low.above == "sea level"]
            places = np.concatenate([_places(feature) for feature in features])
            latitude, longitude = np.median(_on_one_side(places), axis=0)
            east = (float(longitude) + 180.0) % 360.0 - 180.0
            return Geodetic(float(latitude), east, min(heights, default=0.0))
    counts = (f"{count} {reason}" for one in maps for reason, count in one.counts.items())
    raise InputError(
        ", ".join(map(str, paths)),
        f"nothing to keep clear of in it (left out: {', '.join(counts) or 'nothing'}), so no place "
        "for the origin; valid: an origin (--origin, origin_geodetic)",
    )


def _on_one_side(places: FloatArray) -> FloatArray:
    """Places [n, 2] with longitudes from 0 to 360 degrees where that keeps them closer together."""
    around = np.stack([places[:, 0], places[:, 1] % 360.0], axis=-1)
    return around if np.ptp(around[:, 1]) < np.ptp(places[:, 1]) else places


def _places(feature: MapFeature) -> FloatArray:
    outline = feature.outline
    if isinstance(outline, Disc):
        return np.array([[outline.latitude_deg, outline.longitude_deg]])
    return outline.rings[0]


def _place(source: str, parsed: ParsedMap, place: Place) -> MapFile:
    tally = PlacingTally()
    obstacles = place_features(parsed.features, place, tally)
    zones = []
    for zone in parsed.zones:
        volumes = tuple(place_features(zone.features, place, tally))
        if volumes:
            zones.append(_keep_out(zone, volumes))
    floor, notes, ground = _ground(parsed, place)
    return MapFile(
        source=source,
        kind=parsed.kind,
        crs=parsed.crs,
        origin=place.origin,
        obstacles=tuple(obstacles),
        floor=tuple(floor),
        ground=ground,
        keep_out=tuple(zones),
        counts={**parsed.counts, **tally.left_out},
        notes=parsed.notes + notes + tally.notes() + _nothing_left(obstacles, floor, zones, place),
    )


def _nothing_left(
    obstacles: Sequence[Obstacle], floor: Sequence[Obstacle], zones: Sequence[KeepOut], place: Place
) -> tuple[str, ...]:
    """A warning where a file ends in nothing: it may be of another place, or its origin wrong."""
    if obstacles or floor or zones:
        return ()
    latitude, longitude, height = place.origin
    return (
        f"{NOTHING_LEFT} around the origin {latitude:.6f}, {longitude:.6f} at {height:.1f} m: is "
        "it the right map, and the right origin?",
    )


def _ground(
    parsed: ParsedMap, place: Place
) -> tuple[list[Obstacle], tuple[str, ...], GroundHeights | None]:
    """The floor of a terrain, notes on it, and its heights where an area is asked for."""
    if parsed.terrain is None:
        return [], (), None
    bounds = place.bounds_m
    ground = None if bounds is None else ground_heights(parsed.terrain, place, bounds)
    return *place_floor(parsed.terrain, place), ground


def _keep_out(zone: ZoneFeature, volumes: tuple[Obstacle, ...]) -> KeepOut:
    limits = tuple(f"{_limit(part.low)} to {_limit(part.high)}" for part in zone.features)
    return KeepOut(zone.identifier, zone.name, zone.restriction, limits, zone.periods, volumes)


def _limit(height: Height) -> str:
    if height.value_m >= UNLIMITED_M:
        return "unlimited"
    return f"{height.value_m:g} m above {height.above}"


def _covers(period: Period, at: datetime) -> bool:
    """Whether a moment lies in a period and, where it has hours, in one of them."""
    begin, end = (_aware(moment) for moment in (period.start, period.end))
    if (begin is not None and at < begin) or (end is not None and at > end):
        return False
    # Hours may be of another time zone, or run past midnight: yesterday's and tomorrow's may count.
    days = [at.astimezone(UTC).date() + timedelta(days=shift) for shift in (-1, 0, 1)]
    return not period.hours or any(_in_hours(one, day, at) for one in period.hours for day in days)


def _in_hours(hours: Daily, day: date, at: datetime) -> bool:
    if hours.days and WEEK[day.weekday()] not in hours.days:
        return False
    begin = _moment(day, hours.start or time.min)
    end = _moment(day, hours.end or time.max)
    return begin <= at <= (end if end > begin else end + timedelta(days=1))


def _moment(day: date, hour: time) -> datetime:
    return datetime.combine(day, hour if hour.tzinfo else hour.replace(tzinfo=UTC))


def _aware(moment: datetime | None) -> datetime | None:
    """A moment without a time zone is in UTC."""
    return moment.replace(tzinfo=UTC) if moment and moment.tzinfo is None else moment
