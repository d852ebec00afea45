"""Files of other people's formats: text and JSON with errors that name the place, typed loosely."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from pydantic import BaseModel, ConfigDict

from clearway.base.errors import InputError, naming
from clearway.base.frames import FloatArray
from clearway.base.plain_text import shorten

MOST_DIGITS = 18
"""Of whole numbers: they fit into 64 bits."""
LONGEST_VALUE = 40
"""Characters of a value in a message."""


class Foreign(BaseModel):
    """A table of a format that is not ours: other keys are left to the side, text may be a
    number."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)


def read_text(path: Path, western: bool = False) -> str:
    """The file as text; InputError where it cannot be read, is empty or is no text.

    western: take what is not UTF-8 as Windows-1252, which tables of names often are.
    """
    with naming(path, "read"):
        content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        if western and b"\0" not in content:
            return content.decode("cp1252", "replace")
        raise InputError(str(path), f"no text: byte {cause.start} is not UTF-8") from cause
    if not text.strip():
        raise InputError(str(path), f"the file is empty ({path.stat().st_size} bytes)")
    return text


def note_unended(text: str | bytes) -> tuple[str, ...]:
    """A note where the last line of a table has no end: its last number may have lost digits."""
    ended = text.endswith(("\n", "\r")) if isinstance(text, str) else text.endswith((b"\n", b"\r"))
    return () if ended else ("the last line has no line end: cut off?",)


def whole_number(word: str) -> int | None:
    """The number from 0 that a word of a file is; None where it is none, or no file needs it."""
    return int(word) if word.isascii() and word.isdigit() and len(word) <= MOST_DIGITS else None


class NoJsonError(Exception):
    """Text that is no JSON, and why; its reader knows better what it should have been."""


class _RepeatedKeyError(Exception):
    """A key that an object has more than once, and the values that it has there."""


def parse_json(source: str | Path, text: str | bytes, place: str = "") -> Any:
    """Any value of JSON text, whole numbers beyond 64 bits as floats.

    Raises NoJsonError where it is none, InputError of the source where an object of it has a key
    more than once; place: of the text in it, for that message.
    """
    with _keys_once(source, place):
        try:
            return json.loads(text, parse_int=_whole, object_pairs_hook=_object)
        except (ValueError, RecursionError) as cause:
            raise NoJsonError(str(cause)) from cause


@contextmanager
def _keys_once(source: str | Path, place: str = "") -> Iterator[None]:
    try:
        yield
    except _RepeatedKeyError as cause:
        key, *values = cause.args
        told = " and ".join(shorten(str(value), LONGEST_VALUE) for value in values)
        problem = f"key {key!r} is there more than once in the same object ({told}); valid: once"
        raise InputError(str(source), f"{place}: {problem}" if place else problem) from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs of an object: of a key that is repeated, JSON does not say which value counts."""
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    key = next(key for key in found if sum(other == key for other, _ in pairs) > 1)
    raise _RepeatedKeyError(key, *[value for other, value in pairs if other == key][:2])


def _whole(digits: str) -> float:
    return int(digits) if len(digits) <= MOST_DIGITS else float(digits)


def is_number(word: str) -> bool:
    """Whether a word of a file is one, nan and inf too."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file; InputError with line and column where it is none."""
    text = read_text(path)
    with _keys_once(path):
        try:
            data = json.loads(
                text,
                parse_int=_whole,
                parse_constant=_refuse_constant,
                object_pairs_hook=_object,
            )
        except json.JSONDecodeError as cause:
            ended = cause.pos >= len(text.rstrip()) - 1
            why = "truncated: the text ends inside it" if ended else cause.msg
            place = f"line {cause.lineno} column {cause.colno}"
            raise InputError(str(path), f"no valid JSON, {place}: {why}") from cause
        except (ValueError, RecursionError) as cause:
            raise InputError(str(path), f"no valid JSON: {cause}") from cause
    if not isinstance(data, dict):
        raise InputError(str(path), f"a JSON object is needed, got a {type(data).__name__}")
    return data


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def rings_of(coordinates: object) -> tuple[FloatArray, ...]:
    """Rings of a GeoJSON polygon as [n, 2] latitude, longitude in degrees, without closing points.

    Raises ValueError saying what is wrong, and where.
    """
    if not isinstance(coordinates, list) or not coordinates:
        raise ValueError("a polygon needs a list of rings")
    return tuple(_ring(number, ring) for number, ring in enumerate(coordinates))


def position_of(coordinates: object) -> tuple[float, float]:
    """Latitude and longitude in degrees of a GeoJSON position; ValueError saying what is wrong."""
    if not isinstance(coordinates, list) or len(coordinates) < 2:
        raise ValueError(f"a position needs longitude and latitude, got {coordinates!r}")
    longitude, latitude = coordinates[:2]
    for name, value, limit in (("latitude", latitude, 90.0), ("longitude", longitude, 180.0)):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or abs(value) > limit:
            raise ValueError(f"{name} {value!r} is no number within +-{limit:g} degrees")
    return float(latitude), float(longitude)


def _ring(number: int, ring: object) -> FloatArray:
    if not isinstance(ring, list):
        raise ValueError(f"ring {number}: a list of positions is needed")
    try:
        points = np.array([position_of(position) for position in ring]).reshape(-1, 2)
    except ValueError as cause:
        raise ValueError(f"ring {number}: {cause}") from cause
    if len(points) and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    if len(points) < 3:
        raise ValueError(f"ring {number}: {len(points)} corners; at least 3 are needed")
    return points
