"""Looking for ways out at one decision, see `way_out`, with what is known at that moment."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property

import numpy as np

from clearway.avoidance.escape_search import (
    EscapeTerms,
    chain_keeps,
    corners_of,
    first_escape,
    leg_keeps,
    loop_places,
    pose_after,
    was_seen,
)
from clearway.avoidance.evidence import InReach
from clearway.avoidance.floor import with_ground
from clearway.avoidance.hazards import nothing_moving
from clearway.avoidance.planner import Planner
from clearway.avoidance.situation import Situation, margin_slope
from clearway.avoidance.way_out import Escape, WayOut
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray, State
from clearway.reach.escapes import SAMPLES, EscapeLibrary, Legs, names_of
from clearway.reach.lattice import grid_from_level
from clearway.sensors.free_space import NOTHING_SEEN

STANDING = np.zeros(4)
"""The pose of a decision in its own level frame."""


class WaysOut:
    """Looks for ways out at one decision; what is found out is kept until it is over."""

    def __init__(
        self, planner: Planner, library: EscapeLibrary, situation: Situation, near: InReach
    ) -> None:
        state, settings = situation.state, planner.settings
        roll, pitch, yaw = state.attitude_rad.tolist()
        self.library = library
        self._start, self._tilt = library.nearest(roll, pitch), (roll, pitch)
        self._full_m = near.margin_m
        grown = near.margin_m - settings.safety_margin_m
        seen = situation.seen
        self.strict = settings.escape == Escape.STRICT and seen is not None
        self._terms = EscapeTerms(
            *(NOTHING_SEEN if seen is None else seen),
            self.strict,
            settings.body_radius_m + grown,
            near.margin_m,
            margin_slope(settings, situation),
            state.position_m,
            yaw,
            np.ascontiguousarray(grid_from_level(pitch)),
            near.hazards.bins,
            with_ground(near.hazards.shapes, near.frame, situation.floor_m, near.margin_m),
            near.hazards.moving,
            nothing_moving(),
        )
        self._loops: dict[int, FloatArray] = {}
        self._after: dict[tuple[int, bool], WayOut | None] = {}

    @cached_property
    def _legs(self) -> Legs:
        """Where movements lead from the attitude of the decision."""
        return self.library.legs_at(*self._tilt)

    def standing_turns(self) -> dict[int, float]:
        """Movements that turn on the spot from here, and by how much; none for most vehicles."""
        ends = np.abs(self._legs.path[self._start, :, :, :3]).max(axis=(1, 2))
        turns = self._legs.path[self._start, :, -1, 3]
        stands = (ends <= 1e-9) & (np.abs(turns) > 1e-6)
        return {int(m): float(turns[m]) for m in np.flatnonzero(stands)}

    def after(self, movement: int, *, strict: bool = True) -> WayOut | None:
        """The way out from the end of a movement that begins now; None where there is none."""
        key = (movement, strict and self.strict)
        if key not in self._after:
            self._after[key] = self._find_after(movement, self._with(strict, self._full_m))
        return self._after[key]

    def _find_after(self, movement: int, terms: EscapeTerms) -> WayOut | None:
        legs, at = self._legs, self._start
        then = int(legs.following[at, movement])
        if then < 0:
            return None
        path = legs.path[at, movement]
        end_s = float(legs.duration_s[movement])
        if not leg_keeps(STANDING, path, legs.sagitta_m[at, movement], 0.0, end_s, terms):
            return None
        return self._first(then, pose_after(STANDING, path), end_s, terms)

    def now(self, *, strict: bool = True, share: float = 1.0) -> WayOut | None:
        """A way out that begins now and keeps a share of the margin."""
        return self._first(self._start, STANDING, 0.0, self._with(strict, share * self._full_m))

    def holds(self, way: WayOut, *, after: int | None = None, share: float = 1.0) -> WayOut | None:
        """A way out as it is known now, if it is still safe; after a movement, or from now on.

        share: of the margin that it has to keep.
        """
        terms = self._with(True, share * self._full_m)
        movements = self._numbers(way.movements)
        if after is not None:
            movements = np.concatenate([[after], movements])
        if not chain_keeps(movements, self._start, STANDING, 0.0, self._legs, terms):
            return None
        first = 0 if after is None else 1
        places = self._places(movements, self._start, STANDING, self._legs)[first * SAMPLES :]
        return replace(way, margin_m=share * self._full_m, path_m=places)

    def was_seen(self, corners_m: FloatArray, sagitta_m: float) -> bool:
        """Whether the body stays in space that was seen to be free, where that is asked for, on its
        way through corners [n, 3] of the world."""
        level = self._level(corners_m)
        return not self.strict or was_seen(level, sagitta_m, self._terms)

    def after_flight(self, there: State, start_s: float) -> WayOut | None:
        """The way out from where something ends that is no movement, so long from now."""
        roll, pitch, yaw = there.attitude_rad.tolist()
        start, legs = self.library.nearest(roll, pitch), self.library.legs_at(roll, pitch)
        place = self._level(there.position_m[None])[0]
        pose = np.array([*place, yaw - self._terms.yaw_rad])
        loops = loop_places(self.library.ways[start], legs)
        terms = self._with(True, self._full_m)
        return self._first_of(start, pose, start_s, terms, legs, loops)

    def _level(self, places_m: FloatArray) -> FloatArray:
        """[n, 3] places of the world, in the level frame of the decision."""
        cosine, sine = np.cos(self._terms.yaw_rad), np.sin(self._terms.yaw_rad)
        turned = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        return np.ascontiguousarray((places_m - self._terms.origin_m) @ turned)

    def saw(self, samples_m: FloatArray, sagitta_m: FloatArray) -> bool:
        """Whether movements on from here, [n, samples, 3] in the grid frame, lead through space
        that was seen to be free."""
        corners = samples_m @ self._terms.grid_from_level
        before = np.zeros(3)
        for along, sagitta in zip(corners, sagitta_m.tolist(), strict=True):
            if not was_seen(np.vstack([before, along]), sagitta, self._terms):
                return False
            before = along[-1]
        return True

    def _first(
        self, start: int, pose: FloatArray, start_s: float, terms: EscapeTerms
    ) -> WayOut | None:
        if start not in self._loops:
            self._loops[start] = loop_places(self.library.ways[start], self._legs)
        return self._first_of(start, pose, start_s, terms, self._legs, self._loops[start])

    def _first_of(
        self,
        start: int,
        pose: FloatArray,
        start_s: float,
        terms: EscapeTerms,
        legs: Legs,
        loops: FloatArray,
    ) -> WayOut | None:
        ways = self.library.ways[start]
        escape, room_m = -1, 0.0
        for unseen_m in self._aloof(terms):
            wary = terms._replace(unseen_m=unseen_m)
            escape, room_m = first_escape(ways, legs, loops, start, pose, start_s, wary)
            if escape >= 0:
                break
        if escape < 0:
            return None
        begins, loop = names_of(self.library, start, escape)
        places = self._places(self._numbers(begins + loop), start, pose, legs)
        certain = terms.must_see or not self.strict
        return WayOut(begins, loop, terms.margin_m, certain, places, room_m)

    def _aloof(self, terms: EscapeTerms) -> tuple[float, ...]:
        """Distances from the unseen, the best first: what shows there then costs no margin."""
        if terms.must_see and terms.margin_m > terms.unseen_m:
            return terms.margin_m, terms.unseen_m
        return (terms.unseen_m,)

    def _with(self, strict: bool, margin_m: float) -> EscapeTerms:
        must_see = strict and self.strict
        if must_see == self._terms.must_see and margin_m == self._terms.margin_m:
            return self._terms
        return self._terms._replace(must_see=must_see, margin_m=margin_m)

    def _numbers(self, names: Iterable[str]) -> IntArray:
        number = self.library.automaton.names.index
        return np.array([number(name) for name in names], dtype=np.int64)

    def _places(self, movements: IntArray, start: int, pose: FloatArray, legs: Legs) -> FloatArray:
        """[n, 3] world frame."""
        corners, at = [], start
        for m in movements.tolist():
            path = legs.path[at, m]
            corners.append(corners_of(pose, path)[1:])
            pose, at = pose_after(pose, path), int(legs.following[at, m])
        places = np.concatenate(corners) if corners else np.zeros((0, 3))
        cosine, sine = np.cos(self._terms.yaw_rad), np.sin(self._terms.yaw_rad)
        turned = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        world: FloatArray = places @ turned.T + self._terms.origin_m
        return world
