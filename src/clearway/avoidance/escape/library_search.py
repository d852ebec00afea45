"""The search for one escape in the library's order, and one held verified again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from clearway.avoidance.escape.beginnings import Tips, tips_of
from clearway.avoidance.escape.chains import (
    chain_corners,
    chain_keeps,
    measure_unobserved,
    rounds,
)
from clearway.avoidance.escape.legs import EscapeTerms
from clearway.avoidance.escape.places import loop_places
from clearway.avoidance.escape.search import first_escape
from clearway.avoidance.escape.too_near import TooNear
from clearway.avoidance.escape.wide_space import WideSpace
from clearway.avoidance.plan.held_escape import WayOut
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.escapes.legs import LEG_SAMPLES, Legs
from clearway.reach.escapes.library import EscapeLibrary, names_of
from clearway.reach.escapes.upwind import ways_in_wind
from clearway.reach.escapes.ways import Ways
from clearway.vehicle.automaton import MovementAutomaton


class Beginning(NamedTuple):
    """Where and when an escape begins."""

    attitude: int
    """One of the library's."""
    pose: FloatArray
    """[4] place and yaw in the level frame of the decision."""
    start_s: float
    legs: Legs
    """Where movements lead from attitudes there."""


class LaidOut(NamedTuple):
    """Escapes from an attitude, and where they lead."""

    ways: Ways
    loops: FloatArray
    """By `loop_places`."""
    tips: Tips

    @classmethod
    def of(cls, ways: Ways, legs: Legs, tips: Tips | None = None) -> LaidOut:
        """tips: of the same beginnings, where they are at hand."""
        return cls(ways, loop_places(ways, legs), tips or tips_of(ways))


@lru_cache(maxsize=64)
def _lay_out(library: EscapeLibrary, attitude: int) -> LaidOut:
    """Those of a library, where movements lead from its attitudes: the same at all decisions."""
    return LaidOut.of(library.ways[attitude], library.legs)


@dataclass(frozen=True, slots=True, eq=False)
class WayOutSearch:
    """One decision's search; what is found out about loops is kept until it is over."""

    library: EscapeLibrary
    windy: bool
    speed_mps: float
    lasts_s: float
    """For how long escapes are verified that drift."""
    strict: bool
    """Whether they have to lead through what was seen to be free to be certain."""
    near: TooNear
    """Of what stands at that decision."""
    wide: WideSpace
    """Of what was seen up to then."""
    _laid_out: dict[tuple[int, int], tuple[Legs, LaidOut]] = field(default_factory=dict)

    def drifts(self, legs: Legs) -> bool:
        """Whether escapes come back only nearly to where they begin: in wind, and where the vehicle
        is tilted otherwise than its movements tilt it."""
        return self.windy or not self.library.closes_along(legs)

    def numbers(self, names: Iterable[str]) -> IntArray:
        """The movements of some names."""
        number = self.library.automaton.names.index
        return np.array([number(name) for name in names], dtype=np.int64)

    def first(
        self, at: Beginning, terms: EscapeTerms, from_unseen_m: FloatArray
    ) -> tuple[WayOut | None, float]:
        """The first escape, and which of some distances it keeps from unobserved space."""
        attitude, pose, start_s, legs = at
        terms = self._lasting(terms, legs)
        ways, loops, tips = self._lay_out_from(attitude, float(pose[3]), legs, terms.wind_mps)
        for held_to in _strict_first(terms):
            # Where a budget is spent, the body's distance will do.
            keeps_m = from_unseen_m[-1:] if held_to.unobserved_m > 0.0 else from_unseen_m
            about = (attitude, pose, start_s, held_to, keeps_m, self.near, self.wide)
            escape, room_m, kept_m = first_escape(ways, legs, loops, tips, *about)
            if escape >= 0:
                break
        else:
            return None, kept_m
        begins, loop = names_of(self.library, ways, escape)
        certain, leads = terms.must_see or not self.strict, self._path(begins + loop, at, terms)
        lasts_s = _for_s(terms)
        found = WayOut(begins, loop, held_to.margin_m, certain, room_m, lasts_s, leads=leads)
        whole = (self.numbers(begins), rounds(self.numbers(loop), legs, terms.least_s))
        return replace(
            found, unobserved_m=_measure_unobserved_m(np.concatenate(whole), at, terms)
        ), kept_m

    def keep_held(
        self, way: WayOut, begins: IntArray, at: Beginning, terms: EscapeTerms, skipped: int = 0
    ) -> WayOut | None:
        """A held escape, if it is still safe.

        begins: movements before its loop. skipped: so many of them are flown before it begins.
        """
        terms = self._lasting(terms, at.legs)
        loop = self.numbers(way.loop)
        whole = np.concatenate([begins, repeat_loop(loop, at.legs, terms.least_s)])
        about = (whole, at.attitude, at.pose, at.start_s, at.legs)
        kept = (one.margin_m for one in _strict_first(terms) if chain_keeps(*about, one))
        margin_m = next(kept, None)
        if margin_m is None:
            return None
        names = self.library.automaton.names
        leads = self._path((*(names[m] for m in begins), *way.loop), at, terms, skipped)
        unobserved_m = _measure_unobserved_m(whole, at, terms)
        return replace(
            way,
            margin_m=margin_m,
            leads=leads,
            for_s=_for_s(terms),
            unobserved_m=unobserved_m,
        )

    def _lay_out_from(
        self, attitude: int, yaw_rad: float, legs: Legs, wind_mps: FloatArray
    ) -> LaidOut:
        """Escapes from an attitude, and where they lead, where places of them are looked up."""
        ways, tips = self.library.ways[attitude], None
        if legs is self.library.legs:
            laid_out = _lay_out(self.library, attitude)
            if not self.windy:
                return laid_out
            tips = laid_out.tips
        if self.windy:
            x, y, z = wind_mps.tolist()
            cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
            turned = np.array([cosine * x + sine * y, cosine * y - sine * x, z])
            ways = ways_in_wind(self.library, attitude, turned, self.speed_mps)
        key = id(ways), id(legs)  # Of what is kept along with them.
        if key not in self._laid_out:
            self._laid_out[key] = legs, LaidOut.of(ways, legs, tips)
        return self._laid_out[key][1]

    def _path(
        self, names: tuple[str, ...], at: Beginning, terms: EscapeTerms, skipped: int = 0
    ) -> Callable[[], FloatArray]:
        """Tells where movements lead, but for the first few, once somebody asks."""
        about = (terms.wind_mps, terms.yaw_rad, terms.origin_m)
        return partial(_path, self.library.automaton, names, at, about, skipped)

    def _lasting(self, terms: EscapeTerms, legs: Legs) -> EscapeTerms:
        """For so long as is to be verified: one round where that leads back, else some time."""
        return terms._replace(least_s=self.lasts_s) if self.drifts(legs) else terms


def repeat_loop(loop: IntArray, legs: Legs, least_s: float) -> IntArray:
    """A loop as often as it takes to fly for so long; of one that drifts, no more than that."""
    ends_s = np.cumsum(legs.duration_s[loop])
    if 0.0 < least_s < ends_s[-1]:
        return loop[: int(np.searchsorted(ends_s, least_s - 1e-9)) + 1]
    return rounds(loop, legs, least_s)


def world_from_level(yaw_rad: float) -> FloatArray:
    """Rotation [3, 3] from the level frame of a decision."""
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _strict_first(terms: EscapeTerms) -> tuple[EscapeTerms, ...]:
    """Return what escapes are held to, one after the other.

    Nothing is spent of a budget where one is all seen. Where it is, the body keeps off all that is
    known, however little of the margin is asked for: what was seen to be free is that far from
    anything, unobserved space is not. Less than that is better than nothing verified.
    """
    if not (terms.must_see and terms.unobserved_m > 0.0):
        return (terms,)
    all_seen = terms._replace(unobserved_m=0.0, unseen_places=0)
    if terms.margin_m >= terms.unseen_m:
        return all_seen, terms
    return all_seen, terms._replace(margin_m=terms.unseen_m), terms


def _measure_unobserved_m(movements: IntArray, at: Beginning, terms: EscapeTerms) -> float:
    """Return the metres of an escape that cross unobserved space, 0 where none may."""
    if not (terms.must_see and terms.unobserved_m > 0.0):
        return 0.0
    about = (at.attitude, at.pose, at.start_s, at.legs, terms)
    return float(measure_unobserved(movements, *about))


def _for_s(terms: EscapeTerms) -> float:
    return terms.least_s if terms.least_s > 0.0 else np.inf


def _path(
    automaton: MovementAutomaton,
    names: Sequence[str],
    at: Beginning,
    about: tuple[FloatArray, float, FloatArray],
    skipped: int,
) -> FloatArray:
    """[n, 3] places along movements but for the first few, world frame.

    about: wind [3] in the level frame, and where that lies: its yaw and its origin [3].
    """
    wind_mps, yaw_rad, origin_m = about
    movements = np.array([automaton.names.index(name) for name in names], dtype=np.int64)
    places = chain_corners(movements, at.attitude, at.pose, at.start_s, at.legs, wind_mps)
    world: FloatArray = places @ world_from_level(yaw_rad).T + origin_m
    return world[skipped * LEG_SAMPLES :]
