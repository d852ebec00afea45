"""Terrain rasters through rasterio: one band of heights, in metres whatever its unit.

GeoTIFF, and the tiles of SRTM (HGT) and of DTED, whose heights are above the sea level of EGM96.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError, MissingExtraError
from clearway.base.frames import FloatArray
from clearway.base.units import FOOT_M, US_SURVEY_FOOT_M
from clearway.io.maps.coordinates import Projection, projection
from clearway.io.maps.map_features import ParsedMap
from clearway.io.maps.plausible import HIGHEST_GROUND_M, LOWEST_GROUND_M
from clearway.io.maps.terrain import Terrain

ROWS_AT_ONCE = 256
MOST_SAMPLES = 20_000_000
MOST_BLOCK_BYTES = 100_000_000
"""Of a strip or tile, which is unpacked as a whole."""
CACHE_MB = 64
"""Of the library, which else takes a share of the machine."""
METRES = {
    "m": 1.0, "metre": 1.0, "metres": 1.0, "meter": 1.0, "meters": 1.0, "cm": 0.01,
    "ft": FOOT_M, "foot": FOOT_M, "feet": FOOT_M, "international foot": FOOT_M,
    "us-ft": US_SURVEY_FOOT_M, "ftus": US_SURVEY_FOOT_M, "us survey foot": US_SURVEY_FOOT_M,
    "us survey feet": US_SURVEY_FOOT_M, "us_survey_foot": US_SURVEY_FOOT_M,
}  # fmt: skip
"""Of a unit of heights, by the names that rasters have for it."""


OTHERS = ("population", "density", "landcover", "landuse", "ndvi", "slope", "aspect", "temperature",
          "rainfall", "precipitation", "nightlight")  # fmt: skip
"""Words of rasters that hold something else than heights."""
WORDS = re.compile(r"[a-z]+")
MOST_WORDS = 2_000
STEEP_SHARE = 0.2
"""Of neighbours steeper than 45 deg; of mountains fewer are."""
DEGREE_M = 111_195.0


class Tile(NamedTuple):
    """What is known of rasters by their suffix."""

    driver: str
    """Of GDAL; no other one is tried, since some of them read what lies elsewhere."""
    above: str = ""
    """What heights are above, where the format says so."""


HGT = Tile("SRTMHGT", "above sea level (EGM96)")
DTED = Tile("DTED", "above sea level (EGM96)")
TILES = {".hgt": HGT, ".dt0": DTED, ".dt1": DTED, ".dt2": DTED}
"""Any other suffix is a GeoTIFF."""
HGT_NAME = re.compile(r"[NS]\d\d[EW]\d\d\d\..*", re.IGNORECASE)
HGT_SIDES = (1201, 3601)
"""Samples a side, of two bytes each: three and one second of arc."""


class Raster(NamedTuple):
    """A raster as it is stored."""

    affine: Any
    crs: Any
    heights: FloatArray
    """[rows, columns] in its own unit, NaN where it has no data."""
    unit: str
    """Of heights, as the band states it; empty where it does not."""
    about: str = ""
    """What the file says its band is."""


def read_terrain(path: Path) -> ParsedMap:
    """Heights of a single-band raster whose rows and columns run along its reference system.

    A tile of SRTM lies where its name says, such as N50E008.hgt.

    Raises InputError when it is damaged, truncated, not georeferenced, turned, of several bands or
    too large; MissingExtraError without rasterio.
    """
    tile = TILES.get(path.suffix.lower(), Tile("GTiff"))
    if tile is HGT:
        _check_hgt(path)
    raster = _read(path, tile.driver)
    affine, crs = raster.affine, raster.crs
    placed = crs is not None and not affine.is_identity
    if not placed or affine.b or affine.d or min(raster.heights.shape) < 2:
        rows, columns = raster.heights.shape
        raise InputError(
            str(path),
            "a terrain needs a coordinate reference system, at least 2 x 2 samples, and rows and "
            f"columns along its axes; it has {rows} x {columns} samples, "
            f"reference system {crs}, transform {tuple(affine)[:6]}",
        )
    place = projection(path, crs.to_wkt())
    metres, notes = _unit(path, raster.unit, place)
    heights, counts = _ground(path, raster.heights, metres)
    return ParsedMap(
        kind=f"terrain raster of {heights.shape[1]} x {heights.shape[0]} samples",
        crs=f"{place.name}, heights {tile.above}" if tile.above else place.name,
        terrain=_terrain(path, raster, place, heights),
        counts=counts,
        notes=(*notes, *_doubts(path, raster, heights)),
    )


def _check_hgt(path: Path) -> None:
    """Raise InputError for what the library would only call unknown."""
    if not HGT_NAME.fullmatch(path.name):
        raise InputError(
            str(path), "a tile of SRTM lies where its name says; valid: one such as N50E008.hgt"
        )
    sizes = [2 * side * side for side in HGT_SIDES]
    size = path.stat().st_size
    if size not in sizes:
        raise InputError(
            str(path),
            f"{size:,} bytes: truncated, or no tile of SRTM; valid: "
            + ", ".join(
                f"{n:,} ({side} x {side})" for n, side in zip(sizes, HGT_SIDES, strict=True)
            ),
        )


def _read(path: Path, driver: str) -> Raster:
    try:
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioError
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "map") from cause
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)  # refused by its transform
            with (
                rasterio.Env(GDAL_CACHEMAX=CACHE_MB),
                rasterio.open(path, driver=driver) as raster,
            ):
                return _raster(path, raster)
    except (RasterioError, ValueError, IndexError, MemoryError) as cause:
        if isinstance(cause, InputError):
            raise
        reason = " ".join(str(cause.__cause__ or cause).split())
        raise InputError(
            str(path), f"damaged or truncated, or no raster ({reason[:160]})"
        ) from cause


def _raster(path: Path, raster: Any) -> Raster:
    _check_size(path, raster)
    # Large: each step works on the one array.
    heights: FloatArray = raster.read(1, out_dtype=np.float64)
    heights[raster.read_masks(1) == 0] = np.nan
    with np.errstate(over="ignore", invalid="ignore"):
        heights *= raster.scales[0]
        heights += raster.offsets[0]
    words = (raster.descriptions[0], *(f"{key} {value}" for key, value in raster.tags().items()))
    about = " ".join(str(word) for word in words if word)[:MOST_WORDS]
    unit = (raster.units[0] or "").strip()
    return Raster(raster.transform, raster.crs, heights, unit, about)


def _check_size(path: Path, raster: Any) -> None:
    if raster.count != 1:
        raise InputError(
            str(path),
            f"{raster.count} bands: a picture? Valid: one band of heights of the ground "
            "(`gdal_translate -b 1` takes one out)",
        )
    if raster.width * raster.height > MOST_SAMPLES:
        raise InputError(
            str(path),
            f"{raster.width} x {raster.height} samples; at most {MOST_SAMPLES:,} are taken: cut "
            "the area out that is flown in (`gdal_translate -projwin`)",
        )
    kind = np.dtype(raster.dtypes[0])
    if kind.kind not in "iuf":
        raise InputError(str(path), f"samples of type {kind}; valid: whole or real numbers")
    block_bytes = int(np.prod(raster.block_shapes[0])) * kind.itemsize
    if block_bytes > MOST_BLOCK_BYTES:
        raise InputError(
            str(path),
            f"stored in pieces of {block_bytes:,} bytes; at most {MOST_BLOCK_BYTES:,} are taken: "
            "store it in tiles (`gdal_translate -co TILED=YES`)",
        )


def _unit(path: Path, stated: str, place: Projection) -> tuple[float, tuple[str, ...]]:
    """Metres of the unit of heights: as the band says, else the reference system, else as across;
    and what was assumed."""
    notes: tuple[str, ...] = ()
    if place.ellipsoidal:
        notes = ("heights above the ellipsoid are taken as above sea level",)
    if stated:
        if stated.lower() not in METRES:
            raise InputError(str(path), f"unit of heights {stated!r}; valid: {', '.join(METRES)}")
        return METRES[stated.lower()], notes
    if place.up_m is not None:
        return place.up_m, notes
    if place.across_m not in (None, 1.0):
        return place.across_m or 1.0, (f"no unit of heights in the file: {place.unit} assumed",)
    return 1.0, notes


def _doubts(path: Path, raster: Raster, heights: FloatArray) -> tuple[str, ...]:
    """Notes where a raster may be of something else: any single band is taken as heights."""
    notes = []
    if not raster.unit:
        low, high = float(np.nanmin(heights)), float(np.nanmax(heights))
        notes.append(
            f"nothing in the file says that its band is heights: {low:g} to {high:g} are taken as "
            "metres of ground"
        )
    words = WORDS.findall(f"{path.stem} {raster.about}".lower().replace("_", " "))
    other = next((word for word in words if word.startswith(OTHERS)), None)
    if other is not None:
        notes.append(f"IS THIS TERRAIN? Its name or its tags say {other!r}")
    across = abs(raster.affine.a) * (DEGREE_M if raster.crs.is_geographic else 1.0)
    steep = _steep_share(heights, across)
    if steep > STEEP_SHARE:
        notes.append(
            f"IS THIS TERRAIN? {100.0 * steep:.0f} % of its neighbours "
            "lie more than 45 deg above each other"
        )
    return tuple(notes)


def _steep_share(heights: FloatArray, across_m: float) -> float:
    """Share of neighbours in rows that lie farther apart in height than across; some rows at once,
    since all would take the memory of the raster again and again."""
    steep = known = 0
    for first in range(0, len(heights), ROWS_AT_ONCE):
        steps = np.abs(np.diff(heights[first : first + ROWS_AT_ONCE], axis=1))
        steep += int(np.count_nonzero(steps > across_m))
        known += int(np.count_nonzero(np.isfinite(steps)))
    return steep / known if known else 0.0


def _ground(path: Path, heights: FloatArray, metres: float) -> tuple[FloatArray, dict[str, int]]:
    """Heights in metres, NaN where there is no ground; and how many of these there are, by why."""
    with np.errstate(over="ignore", invalid="ignore"):
        heights *= metres
    empty = ~np.isfinite(heights)
    with np.errstate(invalid="ignore"):
        beyond = ~empty & ~((heights >= LOWEST_GROUND_M) & (heights <= HIGHEST_GROUND_M))
    heights[empty | beyond] = np.nan
    if np.isnan(heights).all():
        raise InputError(str(path), "no sample with a height in it")
    valid = f"{LOWEST_GROUND_M:g} to {HIGHEST_GROUND_M:g} m"
    found = {
        "sample without data": int(empty.sum()),
        f"sample that is no height of ground ({valid})": int(beyond.sum()),
    }
    return heights, {reason: count for reason, count in found.items() if count}


def _terrain(path: Path, raster: Raster, place: Projection, heights: FloatArray) -> Terrain:
    """Rows and columns in ascending order of their places."""
    from pyproj import Transformer

    affine = raster.affine
    x = affine.c + affine.a * (np.arange(heights.shape[1]) + 0.5)
    y = affine.f + affine.e * (np.arange(heights.shape[0]) + 0.5)
    if affine.e < 0:
        _turn_over(heights)
    if affine.a < 0:
        _turn_over(heights.T)
    return Terrain(
        heights,
        np.sort(x),
        np.sort(y),
        place,
        Transformer.from_crs("EPSG:4326", raster.crs.to_wkt(), always_xy=True),
        path.name,
    )


def _turn_over(rows: FloatArray) -> None:
    """The last row first, in place: a copy would be as large again."""
    last = len(rows) - 1
    for n in range(len(rows) // 2):
        rows[[n, last - n]] = rows[[last - n, n]]
