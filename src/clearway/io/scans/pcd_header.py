"""Headers of PCD files, versions 0.5 to 0.7: where x, y and z stand in the data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from clearway.base.errors import InputError
from clearway.io.foreign import whole_number

KEYS = (
    "VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"
)  # fmt: skip
NEEDED = ("FIELDS", "SIZE", "TYPE", "WIDTH", "DATA")
"""COUNT, HEIGHT, VIEWPOINT and POINTS are younger, or follow from the others."""
ENCODINGS = ("ascii", "binary", "binary_compressed")
SIZES: Mapping[str, tuple[int, ...]] = {"F": (4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}
LARGEST = 2**31 - 1
"""Of sizes and counts of a field."""
AXES = ("x", "y", "z")
MOST_LINES = 1_000


class PcdHeader(NamedTuple):
    """What a header says of the data."""

    data: str
    """One of ENCODINGS."""
    points: int
    point_bytes: int
    values: int
    """Of a point, all fields and counts."""
    columns: tuple[int, ...]
    """Of x, y and z among a point's values."""
    offsets: dict[str, int]
    """Of x, y and z among a point's bytes."""
    dtype: np.dtype[np.void]
    """x, y and z of one point."""
    viewpoint: tuple[float, ...]
    start: int
    """Where the data begin, in bytes."""
    lines: int
    """Before the data."""


def read_pcd_header(source: str, content: bytes) -> PcdHeader:
    """The header at the start of a file; InputError with everything that is wrong in it."""
    words, start, lines = _words(content)
    missing = [key for key in NEEDED if key not in words]
    if missing:
        raise InputError(
            source,
            f"no PCD header, or a truncated one: no {', '.join(missing)} line; "
            f"valid: a PCD file of version 0.5 to 0.7 with DATA {', '.join(ENCODINGS)}",
        )
    problems: list[str] = []
    fields = [name.lower() for name in words["FIELDS"]]
    sizes = _whole(words, "SIZE", problems)
    counts = _whole({"COUNT": ["1"] * len(fields), **words}, "COUNT", problems)
    data = words["DATA"][0].lower() if words["DATA"] else ""
    if data not in ENCODINGS:
        problems.append(f"header DATA {data!r}; valid: {', '.join(ENCODINGS)}")
    points = _points(words, problems)
    if not problems:
        problems += _layout_problems(fields, words["TYPE"], sizes, counts)
    if problems:
        raise InputError(source, problems)
    ends = np.cumsum([size * count for size, count in zip(sizes, counts, strict=True)])
    columns = np.cumsum([0, *counts])
    at = {axis: fields.index(axis) for axis in AXES}
    offsets = {axis: int(ends[n] - sizes[n] * counts[n]) for axis, n in at.items()}
    return PcdHeader(
        data,
        points,
        int(ends[-1]),
        int(columns[-1]),
        tuple(int(columns[n]) for n in at.values()),
        offsets,
        np.dtype(
            {
                "names": AXES,
                "formats": [f"<{words['TYPE'][n].lower()}{sizes[n]}" for n in at.values()],
                "offsets": [offsets[axis] for axis in AXES],
                "itemsize": int(ends[-1]),
            }
        ),
        _viewpoint(words),
        start,
        lines,
    )


def _words(content: bytes) -> tuple[dict[str, list[str]], int, int]:
    """Words of the header's lines by key, where the data begin, and how many lines are before."""
    found: dict[str, list[str]] = {}
    at = 0
    for number in range(1, MOST_LINES):
        end = content.find(b"\n", at)
        if end < 0:
            break
        line = content[at:end].decode("ascii", "replace").split()
        at = end + 1
        if line and line[0] in KEYS:
            found[line[0]] = line[1:]
        if line[:1] == ["DATA"]:
            return found, at, number
    return {key: value for key, value in found.items() if key != "DATA"}, at, 0


def _whole(words: Mapping[str, list[str]], key: str, problems: list[str]) -> list[int]:
    """Whole numbers above 0, one a field."""
    values, fields = words[key], words.get("FIELDS", [])
    good = [size for word in values if 0 < (size := whole_number(word) or 0) <= LARGEST]
    if len(good) != len(values) or ("FIELDS" in words and len(values) != len(fields)):
        problems.append(
            f"header {key} {' '.join(values)[:80]}: one whole number above 0 is needed for each "
            f"of the {len(fields)} fields"
        )
    return good


def _points(words: Mapping[str, list[str]], problems: list[str]) -> int:
    """How many points; WIDTH x HEIGHT where POINTS is not there."""
    numbers = {}
    for key in ("WIDTH", "HEIGHT", "POINTS"):
        word = next(iter(words.get(key, ["1"])), "")
        number = whole_number(word)
        if number is None:
            problems.append(f"header {key} {word[:40]!r} is no whole number")
        else:
            numbers[key] = number
    if problems or len(numbers) < 3:
        return 0
    cells = numbers["WIDTH"] * numbers["HEIGHT"]
    if "POINTS" in words and numbers["POINTS"] != cells:
        problems.append(
            f"header: WIDTH {numbers['WIDTH']} x HEIGHT {numbers['HEIGHT']} is {cells}, "
            f"but POINTS {numbers['POINTS']}"
        )
    return cells


def _layout_problems(
    fields: list[str], types: list[str], sizes: list[int], counts: list[int]
) -> list[str]:
    missing = [axis for axis in AXES if axis not in fields]
    if missing:
        return [
            f"header FIELDS: no {', '.join(missing)} among {' '.join(fields)}; "
            "fields x, y and z are needed"
        ]
    if len(types) != len(fields):
        return [f"header TYPE: {len(types)} for {len(fields)} fields"]
    problems = []
    for axis in AXES:
        at = fields.index(axis)
        if sizes[at] not in SIZES.get(types[at], ()) or counts[at] != 1:
            problems.append(
                f"header: field {axis} of TYPE {types[at]} SIZE {sizes[at]} COUNT {counts[at]}; "
                "valid: F of 4 or 8 bytes, I or U of 1, 2, 4 or 8, COUNT 1"
            )
    return problems


def _viewpoint(words: Mapping[str, list[str]]) -> tuple[float, ...]:
    """Position and quaternion; that of a level sensor at the origin where there is none."""
    try:
        return tuple(float(word) for word in words["VIEWPOINT"])
    except (KeyError, ValueError):
        return (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
