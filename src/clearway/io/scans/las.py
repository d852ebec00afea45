"""Aerial surveys in LAS and LAZ files, through laspy; units from the CRS that the file states."""

from __future__ import annotations

import struct
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError, MissingExtraError, naming
from clearway.base.units import FOOT_M, US_SURVEY_FOOT_M
from clearway.io.apart import apart
from clearway.io.scans.laz_chunks import check_chunks
from clearway.io.scans.pointcloud import PointCloud

BLANKS = " \t\r\n\0"
NOISE_CLASSES = (7, 18)
"""ASPRS low and high noise."""
GEOTIFF_UNITS = {
    9001: ("metres", 1.0),
    9002: ("feet", FOOT_M),
    9003: ("US survey feet", US_SURVEY_FOOT_M),
}
NO_UNIT = (0, 32767)
"""Undefined, and told by other keys."""
FINEST_SCALE_M = 1e-5
HEADER_BYTES_1_2 = 227
HEADER_BYTES = 375
RECORD_HEADER_BYTES = 54
EXTENDED_RECORD_HEADER_BYTES = 60
COMPRESSED_FORMAT = 128
"""Added to the point format by LAZ."""
PACKAGES = ("laspy", "pyproj")
LOADED_APART = ("laspy", "lazrs", "pyproj")
"""Before a reader is forked, see `io.readers`."""
MOST_PACKED = 5_000_000
"""Points of a LAZ file that need not have a byte each."""
HORIZONTAL_UNIT_KEY = 3076
VERTICAL_UNIT_KEY = 4099


class Unit(NamedTuple):
    """A length unit of the file."""

    name: str
    metres: float


class CloudReference(NamedTuple):
    """What a file says about its coordinates."""

    crs: str | None
    horizontal: Unit
    vertical: Unit
    notes: tuple[str, ...]


def read_las(path: Path) -> PointCloud:
    """Points of a LAS or LAZ file in metres, without noise (class 7, 18) and withheld points.

    LAZ is unpacked in a process of its own, which lazrs ends on some damaged files. Raises
    InputError when the file is damaged, truncated or in degrees.
    """
    if not all(map(find_spec, PACKAGES)):  # laspy looks for pyproj where a file states a CRS
        raise MissingExtraError(f"reading {path}", "lidar")
    with naming(path, "read"):
        compressed = _is_compressed(path)
    if compressed and find_spec("lazrs") is None:
        raise MissingExtraError(f"reading {path}", "lidar")
    return apart(path, "LAZ file", _read, path, True) if compressed else _read(path, False)


def _read(path: Path, compressed: bool) -> PointCloud:
    import laspy

    try:
        if compressed:
            with laspy.open(path) as file:
                check_chunks(path, file.header)
        las: Any = laspy.read(path)
    except InputError:
        raise
    except MemoryError as cause:
        raise InputError(
            str(path), "the header promises more points than memory can hold: damaged?"
        ) from cause
    except (
        laspy.LaspyException,
        ValueError,
        RuntimeError,
        TypeError,
        KeyError,
        IndexError,
        OverflowError,
        OSError,
        struct.error,
    ) as cause:
        raise InputError(
            str(path),
            f"damaged or truncated, or no LAS or LAZ file ({type(cause).__name__}: {cause})",
        ) from cause
    promised = int(las.header.point_count)
    if len(las.points) != promised:
        raise InputError(
            str(path), f"truncated: the header promises {promised} points, {len(las.points)} found"
        )
    return _cloud(path, las, _reference(path, las))


def _is_compressed(path: Path) -> bool:
    """Whether the points are compressed, of a header that promises no more than the file holds.

    Raises InputError for one that does: laspy would loop over its counts.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        header = file.read(HEADER_BYTES)
    if len(header) < HEADER_BYTES_1_2 or not header.startswith(b"LASF"):
        raise InputError(str(path), f"no LAS or LAZ header, or a truncated one ({size} bytes)")
    start, records, form, length, count = struct.unpack_from("<IIBHI", header, 96)
    extended_start, extended = 0, 0
    if header[25] >= 4 and len(header) == HEADER_BYTES:
        extended_start, extended, count = struct.unpack_from("<QIQ", header, 235)
    if (
        start > size
        or records * RECORD_HEADER_BYTES > size
        or (extended and extended_start + extended * EXTENDED_RECORD_HEADER_BYTES > size)
    ):
        raise InputError(str(path), f"truncated in its header records ({size} bytes), or damaged")
    if form >= COMPRESSED_FORMAT and count > max(MOST_PACKED, size):
        raise InputError(
            str(path),
            f"damaged LAZ: the header promises {count:,} points, more than {size} bytes can hold",
        )
    if form < COMPRESSED_FORMAT and start + count * length > size:
        raise InputError(
            str(path),
            f"truncated: the header promises {count} points of {length} bytes, "
            f"the file holds {max(0, size - start) // max(1, length)}",
        )
    return bool(form >= COMPRESSED_FORMAT)


def _cloud(path: Path, las: Any, reference: CloudReference) -> PointCloud:
    classes = np.asarray(las.classification, dtype=np.uint8)
    noise = np.isin(classes, NOISE_CLASSES)
    withheld = np.asarray(las.withheld, dtype=bool) & ~noise
    kept = ~(noise | withheld)
    left_out = {"noise class 7 or 18": noise, "withheld": withheld}
    horizontal, vertical = reference.horizontal, reference.vertical
    scale = np.array([horizontal.metres, horizontal.metres, vertical.metres])
    unit = horizontal.name
    if vertical.name != horizontal.name:
        unit = f"{horizontal.name} across, {vertical.name} up"
    return PointCloud(
        points_m=np.asarray(las.xyz, dtype=np.float64)[kept] * scale,
        classes=classes[kept],
        crs=reference.crs,
        unit=unit,
        source=str(path),
        survey=True,
        counts={reason: int(mask.sum()) for reason, mask in left_out.items() if mask.any()},
        notes=reference.notes,
    )


def _reference(path: Path, las: Any) -> CloudReference:
    """Units by the CRS, else by the GeoTIFF keys, else metres and a note."""
    empty = _note_emptied(las.header)
    found = _reference_told(path, las)
    return found if not empty else found._replace(notes=(*found.notes, *empty))


def _note_emptied(header: Any) -> tuple[str, ...]:
    """A note of how many WKT records hold nothing but blanks, which are none for pyproj then."""
    records = [
        one
        for some in (header.vlrs, header.evlrs or ())
        for one in some
        if type(one).__name__ == "WktCoordinateSystemVlr" and not one.string.strip(BLANKS)
    ]
    for one in records:
        one.string = ""
    return (f"empty WKT records in the header: {len(records)}",) if records else ()


def _reference_told(path: Path, las: Any) -> CloudReference:
    try:
        crs: Any = las.header.parse_crs()
    except (ValueError, RuntimeError) as cause:
        raise InputError(str(path), f"the CRS in the header cannot be read: {cause}") from cause
    keys = _geotiff_keys(path, las)
    horizontal = keys.get(HORIZONTAL_UNIT_KEY)
    vertical = keys.get(VERTICAL_UNIT_KEY)
    if crs is None:
        if horizontal is None:
            _check_no_degrees(path, las.header)
            note = "no CRS in the file: metres assumed"
            metres = Unit("metres", 1.0)
            return CloudReference(None, metres, vertical or metres, (note,))
        return CloudReference(None, horizontal, vertical or horizontal, ())
    axes = crs.axis_info
    if crs.is_geocentric:
        raise InputError(
            str(path),
            f"coordinates are geocentric (CRS {crs.name}), so none of them is up; "
            "valid: a projected CRS, in metres or feet",
        )
    if any(axis.unit_name == "degree" for axis in axes[:2]):
        raise InputError(
            str(path),
            f"coordinates are in degrees (CRS {crs.name}); "
            "valid: a projected CRS, in metres or feet",
        )
    units = [_unit(axis.unit_name, axis.unit_conversion_factor) for axis in axes]
    if len(units) > 2:
        vertical = units[2]
    notes = () if vertical else (f"no vertical unit in the CRS: {units[0].name} assumed",)
    return CloudReference(str(crs.name), units[0], vertical or units[0], notes)


def _check_no_degrees(path: Path, header: Any) -> None:
    """Refuse what can only be degrees: metres are never given to a hundredth of a millimetre."""
    low, high = np.minimum(header.mins, header.maxs), np.maximum(header.mins, header.maxs)
    if (
        max(header.scales[:2]) < FINEST_SCALE_M
        and max(abs(low[0]), abs(high[0])) <= 180.0
        and max(abs(low[1]), abs(high[1])) <= 90.0
    ):
        raise InputError(
            str(path),
            f"no CRS in the file, and coordinates that look like degrees: x {low[0]:g} to "
            f"{high[0]:g}, y {low[1]:g} to {high[1]:g}, in steps of {header.scales[0]:g}; "
            "valid: a projected CRS, in metres or feet",
        )


def _unit(name: str, metres: float) -> Unit:
    plural = {"metre": "metres", "foot": "feet", "US survey foot": "US survey feet"}
    return Unit(plural.get(name, name), float(metres))


def _geotiff_keys(path: Path, las: Any) -> dict[int, Unit]:
    """Length units stated by GeoTIFF keys, by key; InputError for one that is not known."""
    stated = {
        key.id: key.value_offset
        for directory in las.header.vlrs.get("GeoKeyDirectoryVlr")
        for key in directory.geo_keys
        if key.id in (HORIZONTAL_UNIT_KEY, VERTICAL_UNIT_KEY) and key.value_offset not in NO_UNIT
    }
    unknown = sorted(set(stated.values()) - GEOTIFF_UNITS.keys())
    if unknown:
        valid = ", ".join(f"{code} ({name})" for code, (name, _) in GEOTIFF_UNITS.items())
        raise InputError(
            str(path), f"unit of length {unknown[0]} of its GeoTIFF keys; valid: {valid}"
        )
    return {key: Unit(*GEOTIFF_UNITS[code]) for key, code in stated.items()}
