"""Ways to stay safe for ever: short beginnings, and what can be flown on and on after them.

A vehicle that can stop holds its place; one that cannot flies loops that close. Loops are found,
not written down: of all turning movements, level circles, ovals, and circles that climb on one half
and sink on the other, which closes as exactly in less room. Whatever closes from an attitude may
follow any beginning that leads to that attitude.

Everything is kept as movements between attitudes, not as places: `legs_at` says where they lead
from the attitude that the vehicle really has.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from clearway.base.brief import one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.escapes.legs import LEG_SAMPLES, SAME_RAD, Legs, legs_from_level, legs_of
from clearway.reach.escapes.loops import CLOSES
from clearway.reach.escapes.store import FoundWays, load_or_search
from clearway.reach.escapes.ways import Ways
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.paths import movement_paths

MOST_LIBRARIES = 64
"""Kept in a process."""


@dataclass(frozen=True, eq=False)
class EscapeLibrary:
    """All ways of an automaton to stay safe for ever, by the attitude that they begin from."""

    automaton: MovementAutomaton
    attitudes: FloatArray
    """[attitudes, 2] roll and pitch."""
    legs: Legs
    ways: tuple[Ways, ...]
    """[attitudes]"""
    reach_m: float
    """How far an escape may lead from where it begins."""

    @classmethod
    def of(cls, automaton: MovementAutomaton) -> EscapeLibrary:
        """Load them, or search and store them where they are not kept (`escape_store`)."""
        attitudes, legs = legs_from_level(automaton)
        key = _content(automaton, legs)
        if key not in _found:
            while len(_found) >= MOST_LIBRARIES:
                del _found[next(iter(_found))]
            _found[key] = load_or_search(automaton, legs)
        ways, reach = _found[key]
        reach_m = reach * automaton.step_m
        return cls(automaton, attitudes, legs, ways, reach_m)

    def __repr__(self) -> str:
        count = [len(ways.begins) for ways in self.ways]
        facts = (f"{len(count)} attitudes", f"{min(count)} to {max(count)} escapes from each")
        return one_line("EscapeLibrary", facts)

    @cached_property
    def key(self) -> bytes:
        """Equal where the same escapes are found."""
        return _content(self.automaton, self.legs)

    @property
    def exists(self) -> bool:
        """Whether there is any way to stay safe for ever, from level flight on."""
        return bool(len(self.ways[0].begins))

    def nearest(self, roll_rad: float, pitch_rad: float) -> int:
        """The attitude that is nearest."""
        return _nearest(self, roll_rad, pitch_rad)

    def legs_at(self, roll_rad: float, pitch_rad: float) -> Legs:
        """Where movements lead if the nearest attitude is really this one, and all others are off
        by as much."""
        roll, pitch = self.attitudes[self.nearest(roll_rad, pitch_rad)].tolist()
        if abs(roll_rad - roll) <= SAME_RAD and abs(pitch_rad - pitch) <= SAME_RAD:
            return self.legs
        off = np.array([roll_rad - roll, pitch_rad - pitch])
        paths = movement_paths(self.automaton, LEG_SAMPLES)
        attitudes = self.attitudes + off
        return legs_of(paths, attitudes, self._within_limit(attitudes), self.automaton)

    def closes_along(self, legs: Legs) -> bool:
        """Whether loops lead back to where they begin where movements lead along these: always from
        the attitudes of the library, and from others where tilt does not matter."""
        if legs is self.legs:
            return True
        off_m = float(np.abs(legs.path - self.legs.path).max())
        return off_m <= CLOSES * max(self.automaton.step_m, 1e-9)

    def _within_limit(self, attitudes: FloatArray) -> IntArray:
        """[attitudes, movements] as of the legs, without what does not lead back from beyond the
        limit; where nothing leads back, without what leads farther beyond it."""
        following, limit = self.legs.following, self.automaton.pitch_limit_rad
        if limit is None:
            return following
        ends = np.abs(attitudes[following, 1])
        starts = np.abs(attitudes[:, 1])[:, None]
        beyond = ends > limit + SAME_RAD
        back = np.where(beyond & (ends >= starts - SAME_RAD), -1, following)
        stays = np.where(beyond & (ends > starts + SAME_RAD), -1, following)
        return np.where((back >= 0).any(axis=1, keepdims=True), back, stays)


@lru_cache(maxsize=256)
def _nearest(library: EscapeLibrary, roll_rad: float, pitch_rad: float) -> int:
    """A decision asks several times, mostly of attitudes that movements lead to."""
    away = np.hypot(library.attitudes[:, 0] - roll_rad, library.attitudes[:, 1] - pitch_rad)
    return int(np.argmin(away))


_found: dict[bytes, FoundWays] = {}
"""What this process knows already: planners of one vehicle differ mostly by their settings."""


def _content(automaton: MovementAutomaton, legs: Legs) -> bytes:
    """Equal where the same escapes are found."""
    flown = [(each.name, each.inputs.tolist()) for each in automaton.movements]
    told = repr((flown, sorted(automaton.forbidden), automaton.pitch_limit_rad))
    digest = hashlib.sha256(told.encode())
    for array in legs:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.digest()


def names_of(
    library: EscapeLibrary, ways: Ways, escape: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Movements of an escape, of the library's or others: its beginning, and its loop."""
    names = library.automaton.names
    if not 0 <= escape < len(ways.begins):
        raise ClearwayError(f"escape {escape}: there are {len(ways.begins)}")
    begins: list[str] = []
    at = ways.begins.item(escape)
    while ways.parent.item(at) >= 0:
        begins.insert(0, names[ways.movement.item(at)])
        at = ways.parent.item(at)
    first, last = ways.loop_at[ways.loop.item(escape) :][:2].tolist()
    return tuple(begins), tuple([names[m] for m in ways.loop_movement[first:last].tolist()])
