"""DAIDALUS encounters (.daa): names, units, then one row of each aircraft at each time."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS, NAUTICAL_MILE_M
from clearway.io.foreign import note_unended
from clearway.io.traffic.traffic_rows import DAMAGED, Sieve
from clearway.traffic.recorded.report import TrafficRecording, TrafficReport

FORM = "DAIDALUS"
NAMES: Mapping[str, tuple[str, ...]] = {
    "name": ("name", "aircraft", "id"),
    "lat": ("lat", "latitude"),
    "lon": ("lon", "long", "longitude"),
    "alt": ("alt", "altitude"),
    "trk": ("trk", "track", "heading"),
    "gs": ("gs", "groundspeed", "groundspd", "airspeed"),
    "vs": ("vs", "verticalspeed", "hdot"),
    "vx": ("vx",),
    "vy": ("vy",),
    "vz": ("vz",),
    "time": ("time", "tm", "st"),
}
UNCERTAIN = re.compile("std|cov|sigma|uncert|accuracy")
MOST_NAMES = 200
"""Characters of the names of columns in a note."""
NEEDED = ("name", "lat", "lon", "alt", "time")
DEGREE = math.pi / 180.0
FACTORS = {
    "deg": DEGREE, "degree": DEGREE, "degrees": DEGREE, "rad": 1.0,
    "m": 1.0, "km": 1000.0, "ft": FOOT_M, "feet": FOOT_M,
    "nmi": NAUTICAL_MILE_M, "nm": NAUTICAL_MILE_M,
    "m/s": 1.0, "mps": 1.0, "knot": KNOT_MPS, "knots": KNOT_MPS, "kn": KNOT_MPS, "kts": KNOT_MPS,
    "fpm": FOOT_PER_MINUTE_MPS, "ft/min": FOOT_PER_MINUTE_MPS,
    "s": 1.0, "sec": 1.0, "min": 60.0, "none": 1.0, "unitless": 1.0,
}  # fmt: skip
CUSTOMARY = {
    "lat": DEGREE, "lon": DEGREE, "alt": FOOT_M, "trk": DEGREE, "gs": KNOT_MPS,
    "vs": FOOT_PER_MINUTE_MPS, "vx": KNOT_MPS, "vy": KNOT_MPS, "vz": FOOT_PER_MINUTE_MPS,
    "time": 1.0,
}  # fmt: skip
"""Where a file has no row of units."""


def read_daidalus(source: str, content: bytes) -> TrafficRecording:
    """Reports of a scripted encounter; the first aircraft is the ownship.

    Columns are separated by commas or blanks, `#` starts a comment. Altitudes are geometric: the
    scripts know no air pressure. Raises InputError when a column is missing, a unit unknown, or
    the last row cut off.
    """
    lines = _lines(content)
    names = [name.lower() for name in lines[0][1]]
    columns = _columns(source, names)
    rows, factors, notes = lines[1:], CUSTOMARY, ["no row of units: deg, ft, knot, fpm, s assumed"]
    if rows and not _is_row(rows[0][1], columns):
        factors, notes = _factors(source, rows[0], columns), []
        rows = rows[1:]
    sieve = Sieve(source)
    sieve.notes.extend((*notes, *_note_unused(names, columns), *note_unended(content)))
    own = None
    for number, (place, words) in enumerate(rows, start=1):
        if len(words) >= len(names) and _is_row(words, columns):
            sieve.take(_report(words, columns, factors))
            sieve.heard[words[columns["name"]]] += 1
            own = own or words[columns["name"]]
        elif number == len(rows) and not content.endswith(b"\n"):
            sieve.cut_off(f"line {place}, the last one, has {len(words)} of {len(names)} values")
        else:
            sieve.drop(DAMAGED, f"line {place}: no row of {len(names)} values")
    return sieve.recording(FORM, clock="relative", own_address=own)


def _lines(content: bytes) -> list[tuple[int, list[str]]]:
    """Number and words of each line that has any."""
    found = []
    for place, line in enumerate(content.decode("utf-8-sig", "replace").splitlines(), start=1):
        words = re.split(r"\s*[,;]\s*|\s+", line.split("#")[0].strip(" \t,;"))
        if words != [""]:
            found.append((place, words))
    return found


def _columns(source: str, names: Sequence[str]) -> dict[str, int]:
    """Index of each known column."""
    columns = {
        key: next(at for at, name in enumerate(names) if name in aliases)
        for key, aliases in NAMES.items()
        if set(aliases) & set(names)
    }
    missing = [key for key in NEEDED if key not in columns]
    if missing:
        flat = "sx" in names or "x" in names
        raise InputError(
            source,
            f"no column {', '.join(missing)} among {', '.join(names)[:120]}"
            + ("; positions in a plane (sx, sy) have no place on Earth" if flat else "")
            + "; valid: name, lat, lon, alt, time, and trk, gs, vs or vx, vy, vz",
        )
    return columns


def _note_unused(names: Sequence[str], columns: Mapping[str, int]) -> list[str]:
    """A note on the columns that are not read; uncertainties first, which widen nothing here."""
    unused = [name for at, name in enumerate(names) if name and at not in columns.values()]
    uncertain = [name for name in unused if UNCERTAIN.search(name)]
    other = [name for name in unused if name not in uncertain]
    notes = []
    if uncertain:
        notes.append(
            f"{len(uncertain)} columns of uncertainties are not used, volumes and alerts are not "
            f"widened by them: {', '.join(uncertain)[:MOST_NAMES]}"
        )
    if other:
        notes.append(f"{len(other)} columns are not used: {', '.join(other)[:MOST_NAMES]}")
    return notes


def _factors(
    source: str, line: tuple[int, list[str]], columns: Mapping[str, int]
) -> dict[str, float]:
    """SI units by column, of the row of units."""
    place, words = line
    units = [word.strip("[]()").lower() for word in words]
    found, problems = {}, []
    for key, column in columns.items():
        unit = units[column] if column < len(units) else ""
        if key == "name":
            continue
        if unit in FACTORS:
            found[key] = FACTORS[unit]
        else:
            problems.append(
                f"line {place}: unit {unit or '(none)'!r} of column {key} is unknown; "
                f"valid: {', '.join(FACTORS)}"
            )
    if problems:
        raise InputError(source, problems)
    return found


def _is_row(words: Sequence[str], columns: Mapping[str, int]) -> bool:
    """Whether every known column but the name holds a number."""
    for key, column in columns.items():
        if column >= len(words):
            return False
        if key != "name":
            try:
                float(words[column])
            except ValueError:
                return False
    return True


def _report(
    words: Sequence[str], columns: Mapping[str, int], factors: Mapping[str, float]
) -> TrafficReport:
    value = {
        key: float(words[column]) * factors[key] for key, column in columns.items() if key != "name"
    }
    speed, track = value.get("gs"), value.get("trk")
    if "vx" in value and "vy" in value:
        speed = math.hypot(value["vx"], value["vy"])
        track = math.atan2(value["vx"], value["vy"]) % (2.0 * math.pi)
    return TrafficReport(
        time_s=value["time"],
        address=words[columns["name"]],
        latitude_deg=math.degrees(value["lat"]),
        longitude_deg=math.degrees(value["lon"]),
        altitude_m=value["alt"],
        altitude_kind="geometric",
        geometric_altitude_m=value["alt"],
        ground_speed_mps=speed,
        track_rad=track,
        vertical_rate_mps=value.get("vs", value.get("vz")),
        callsign=words[columns["name"]],
        source="scripted",
    )
