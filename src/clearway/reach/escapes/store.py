"""Ways to stay safe for ever, kept in the user's cache between runs as reach sets are.

A file holds numbers of movements, attitudes and beginnings, and the widest loop in steps, so that
vehicles that differ by their size and speed alone share one. What is loaded equals what was
searched; whatever does not fit is searched anew, never used.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from clearway.base.cache_folder import cache_folder
from clearway.base.errors import ClearwayError
from clearway.base.kept_file import KeptKind, read_kept, write_kept
from clearway.reach.escapes.braking import braking_ways, measure_reach
from clearway.reach.escapes.legs import Legs
from clearway.reach.escapes.loops import extent_m, loops_from
from clearway.reach.escapes.ways import BEGINNINGS, MOST_DEPTH, MOST_ESCAPES, Ways, ways_from
from clearway.reach.store import SHIPPED
from clearway.vehicle.automaton import MovementAutomaton

KIND = KeptKind(b"clearway ways out\n", 2)
"""Its version is raised whenever the file's layout or what is found changes."""
FINENESS = 1e6
"""Parts of a step to which the widest loop is rounded up: machines differ in the last digit."""
_REACH = struct.Struct("<d")


class FoundWays(NamedTuple):
    """What is found of an automaton, whatever its size."""

    ways: tuple[Ways, ...]
    """[attitudes]"""
    reach: float
    """How far any leads from where it begins, in steps of the automaton."""


def load_or_search(
    automaton: MovementAutomaton, legs: Legs, folder: Path | None = None
) -> FoundWays:
    """Load from what ships or from the cache `folder` (default: the user's); search and store what
    is not there. A folder that cannot be written only means searching again the next time."""
    key = hash_escapes(automaton, legs)
    name, place = name_of(key), folder or cache_folder()
    for path in [each / name for each in (SHIPPED, place) if each is not None]:
        try:
            return _parse(read_kept(path, KIND, key), len(legs.following))
        except (OSError, ClearwayError):
            continue
    found = search_escapes(automaton, legs)
    if place is not None:
        store(place / name, key, found)
    return found


def search_escapes(automaton: MovementAutomaton, legs: Legs) -> FoundWays:
    """Search them; takes a fraction of a second."""
    step_m = automaton.step_m or 1.0
    classes = automaton.classes
    if automaton.has_inertia and classes is not None:
        ways = tuple(braking_ways(classes, at) for at in range(len(classes.classes)))
        reach_m = max(measure_reach(each, legs) for each in ways)
        return FoundWays(ways, _round_up(reach_m / step_m))
    attitudes = range(len(legs.following))
    loops = [tuple(loops_from(automaton, legs, at)) for at in attitudes]
    ways = tuple(ways_from(automaton, legs, loops, at) for at in attitudes)
    widest_m = max(
        (extent_m(legs, at, loop) for at, each in enumerate(loops) for loop in each), default=0.0
    )
    return FoundWays(ways, MOST_DEPTH + _round_up(widest_m / step_m))


def _round_up(steps: float) -> float:
    return float(np.ceil(FINENESS * steps)) / FINENESS


def hash_escapes(automaton: MovementAutomaton, legs: Legs) -> bytes:
    """Hash of all that the search follows from, lengths in steps and rounded: no file holds any."""
    pitch_limit = automaton.pitch_limit_rad
    limit = None if pitch_limit is None else round(pitch_limit, 9)
    told = (automaton.names, sorted(automaton.forbidden), limit, BEGINNINGS, MOST_ESCAPES)
    digest = hashlib.sha256(repr(told).encode())
    size = np.array([*[automaton.step_m or 1.0] * 3, 1.0])
    digest.update((np.round(legs.path / size, 9) + 0.0).tobytes())
    digest.update(np.ascontiguousarray(legs.following).tobytes())
    return digest.digest()


def name_of(key: bytes) -> str:
    """Of the file for a key."""
    return f"ways-{key.hex()[:32]}.bin"


def store(
    path: Path, key: bytes, found: FoundWays, refused: Callable[[OSError], None] | None = None
) -> None:
    """Write into a file; where that cannot be done, `refused` is reported."""
    numbers = [array.astype("<i4") for ways in found.ways for array in ways]
    lengths = np.array([len(array) for array in numbers], dtype="<i4")
    whole = lengths.tobytes() + b"".join(array.tobytes() for array in numbers)
    try:
        write_kept(path, KIND, key, _REACH.pack(found.reach) + zlib.compress(whole, 9))
    except OSError as cause:
        if refused is not None:
            refused(cause)


def _parse(payload: bytes, attitudes: int) -> FoundWays:
    (reach,) = _REACH.unpack_from(payload)
    numbers = np.frombuffer(zlib.decompress(payload[_REACH.size :]), dtype="<i4")
    fields = len(Ways._fields)
    ends = attitudes * fields + np.concatenate([[0], np.cumsum(numbers[: attitudes * fields])])
    arrays = [
        numbers[first:last].astype(np.int64)
        for first, last in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
    ]
    ways = tuple(Ways(*arrays[n : n + fields]) for n in range(0, len(arrays), fields))
    return FoundWays(ways, reach)
