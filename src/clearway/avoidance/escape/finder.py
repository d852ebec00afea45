"""Looking for escapes at one decision, see `way_out`, with what is known at that moment."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from clearway.avoidance.escape.chains import chain_room, rounds
from clearway.avoidance.escape.legs import (
    EscapeTerms,
    carry_leg,
    leg_keeps,
    leg_room,
    leg_unseen_m,
    pose_after,
    unsure_after,
    was_seen,
)
from clearway.avoidance.escape.library_search import (
    Beginning,
    WayOutSearch,
    world_from_level,
)
from clearway.avoidance.escape.standoff import keeps_aloof
from clearway.avoidance.escape.terms import in_wind_s, make_escape_terms
from clearway.avoidance.escape.too_near import too_near
from clearway.avoidance.escape.wide_space import wide_space
from clearway.avoidance.plan.evidence import InReach
from clearway.avoidance.plan.held_escape import LESSER_MARGINS, UnderWay, WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.reach.escapes.legs import LEG_SAMPLES, Legs
from clearway.reach.escapes.library import EscapeLibrary
from clearway.sensors.observed.seen_space import SeenSpace

STANDING = np.zeros(4)
"""The pose of a decision in its own level frame."""
CLOSES_RAD = 1e-3
"""Attitude off those of the library by which its loops still close."""
SURFACE = 1.0 + 0.5 * np.sqrt(3.0)
"""Voxels before what is hit that beams may leave unobserved, to their middles and in any
direction."""


class WaysOut:
    """Looks for escapes at one decision; what is found out is kept until it is over.

    under_way: the movement in the middle of which the decision is taken; None between two.
    """

    def __init__(
        self,
        planner: Planner,
        library: EscapeLibrary,
        situation: Situation,
        near: InReach,
        under_way: UnderWay | None = None,
    ) -> None:
        roll, pitch, _ = situation.state.attitude_rad.tolist()
        self.library = library
        self.under_way = under_way
        self._start = library.nearest(roll, pitch)
        self._tilt = (roll, pitch)
        # A movement under way that ends where loops close is flown to its end first. One that ends
        # off those attitudes as well, of a vehicle that began off them, is not worth waiting for:
        # who always asks a moment late would wait for ever.
        self._closes = (
            under_way is None
            or self._is_one_of(roll, pitch)
            or not self._is_one_of(*self._rest(under_way)[2])
        )
        self._terms = make_escape_terms(planner, library, situation, near)
        self._full_m, self.strict = near.margin_m, self._terms.must_see
        self._search = WayOutSearch(
            library,
            bool(situation.wind_mps.any()),
            planner.speed_mps,
            in_wind_s(library),
            self.strict,
            too_near(near.margin_m),
            wide_space(),
        )
        self._surface_m = SURFACE / self._terms.seen.window[3] + 3.0 * situation.range_sigma_m
        self._aloof: dict[int, bool] = {}
        self._after: dict[tuple[int, bool, float], WayOut | None] = {}
        self._now: dict[tuple[bool, float], WayOut | None] = {}
        self._left: dict[int, bool] = {}

    def _is_one_of(self, roll_rad: float, pitch_rad: float) -> bool:
        """Whether an attitude is one of the library's, with which loops close."""
        nearest = self.library.attitudes[self.library.nearest(roll_rad, pitch_rad)]
        return bool(np.all(np.abs(nearest - [roll_rad, pitch_rad]) <= CLOSES_RAD))

    @property
    def can_stop(self) -> bool:
        """Whether the vehicle can stay where it is."""
        return self.library.automaton.can_stop

    @property
    def seen(self) -> SeenSpace:
        """What was seen to be free; later scans change it."""
        return self._terms.seen

    @property
    def shunned(self) -> tuple[int, ...]:
        """Movements that were found to come nearer to unobserved space than there is need for."""
        return tuple(movement for movement, keeps in self._aloof.items() if not keeps)

    @property
    def margin_m(self) -> float:
        """The whole margin."""
        return self._full_m

    def for_less(self, share: float) -> WaysOut:
        """The same for escapes that are verified for a share of the time, where they drift."""
        less = copy(self)
        less._search = replace(self._search, lasts_s=share * self._search.lasts_s)
        less._after, less._left, less._now = {}, {}, {}
        return less

    @property
    def as_predicted(self) -> WaysOut | None:
        """The same for escapes that are flown just as predicted; None where all are anyway."""
        terms = self._terms
        if len(terms.tube_m) == 0 and terms.unsure_mps == 0.0:
            return None
        exact = copy(self)
        exact._terms = terms._replace(tube_m=np.zeros(0), unsure_mps=0.0)
        exact._after, exact._left, exact._now, exact._aloof = {}, {}, {}, {}
        return exact

    @cached_property
    def _legs(self) -> Legs:
        """Where movements lead from the attitude of the decision."""
        return self.library.legs_at(*self._tilt)

    @property
    def _here(self) -> Beginning:
        return Beginning(self._start, STANDING, 0.0, self._legs)

    @property
    def drift(self) -> bool:
        """Whether escapes from here come back only nearly to where they begin: in wind, and where
        the vehicle is tilted otherwise than its movements tilt it."""
        return self._search.drifts(self._legs)

    def standing_turns(self) -> dict[int, float]:
        """Movements that turn on the spot from here, and by how much; none for most vehicles."""
        ends = np.abs(self._legs.path[self._start, :, :, :3]).max(axis=(1, 2))
        turns = self._legs.path[self._start, :, -1, 3]
        stands = (ends <= 1e-9) & (np.abs(turns) > 1e-6)
        return {int(m): float(turns[m]) for m in np.flatnonzero(stands)}

    def room_m(self, way: WayOut, least_s: float = 0.0) -> float:
        """Distance from intruders at equal times on the first round of an escape that begins now,
        and on as many more as take so long; no more than twice the margin."""
        terms, loop = self._terms, self._search.numbers(way.loop)
        again = rounds(loop, self._legs, least_s) if least_s > 0.0 else loop
        movements = np.concatenate([self._search.numbers(way.begins), again])
        most, at = 2.0 * terms.margin_m, self._start
        return float(chain_room(movements, at, STANDING, 0.0, self._legs, terms, most, -np.inf))

    def stands(self, way: WayOut) -> bool:
        """Whether an escape is to stay where the vehicle is."""
        paths = self._legs.path[self._start, self._search.numbers(way.movements), :, :3]
        return bool(np.abs(paths).max() <= 1e-9)

    def after(self, movement: int, *, strict: bool = True, share: float = 1.0) -> WayOut | None:
        """The escape from the end of a movement that begins now; None where there is none.

        share: of the margin that it has to keep.
        """
        key = (movement, strict and self.strict, share)
        if key not in self._after:
            terms = self._with(strict, share * self._full_m)
            self._after[key] = self._find_after(movement, terms)
        return self._after[key]

    def leaves(self, movement: int) -> bool:
        """Whether there is an escape from the end of a movement that begins now, with the whole
        margin: of intruders depends which one is taken, not whether there is one."""
        asked = (movement, self.strict, 1.0)
        if asked in self._after:
            return self._after[asked] is not None
        if movement not in self._left:
            terms = self._with(True, self._full_m)._replace(moving=self._terms.nothing)
            self._left[movement] = self._find_after(movement, terms) is not None
        return self._left[movement]

    def _find_after(self, movement: int, terms: EscapeTerms) -> WayOut | None:
        legs, at = self._legs, self._start
        then = int(legs.following[at, movement])
        if then < 0 or not self._closes:
            return None
        path = legs.path[at, movement]
        end_s = float(legs.duration_s[movement])
        if not leg_keeps(STANDING, path, legs.sagitta_m[at, movement], 0.0, end_s, terms):
            return None
        return self._first(Beginning(then, pose_after(STANDING, path), end_s, legs), terms)

    def aloof(self, movement: int) -> bool:
        """Whether a movement that begins now keeps the margin from unobserved space, or as much of
        it as is kept here; asked of who can stop and look, since others would find no way.

        What lies at something known counts as that. About the start, where nobody could look
        before, any movement does.
        """
        if not (self.strict and self.library.automaton.can_stop):
            return True
        if movement not in self._aloof:
            self._aloof[movement] = self._comes_no_nearer(movement)
        return self._aloof[movement]

    def _comes_no_nearer(self, movement: int) -> bool:
        share = self._aloof_here
        if share == 0.0:
            return True
        legs, at, terms = self._legs, self._start, self._terms
        end_s = float(legs.duration_s[movement])
        corners = carry_leg(STANDING, legs.path[at, movement], (0.0, end_s), terms)
        around_m = float(legs.sagitta_m[at, movement]) + unsure_after(end_s, terms)
        return bool(keeps_aloof(corners, around_m, share * self._full_m, self._surface_m, terms))

    @cached_property
    def _aloof_here(self) -> float:
        """Share of the margin that is kept here from unobserved space."""
        terms, here = self._terms, np.zeros((1, 3))
        start_m, free_m = terms.seen.start
        if np.linalg.norm(terms.origin_m - start_m) < free_m:
            return 0.0
        for share in (1.0, *LESSER_MARGINS[:-1]):
            if keeps_aloof(here, 0.0, share * self._full_m, self._surface_m, terms):
                return share
        return 0.0

    def now(self, *, strict: bool = True, share: float = 1.0) -> WayOut | None:
        """An escape that begins now and keeps a share of the margin."""
        if not self._closes:
            return None
        key = (strict and self.strict, share)
        if key not in self._now:
            terms = self._with(strict, share * self._full_m)
            self._now[key] = self._first(self._here, terms)
        return self._now[key]

    def holds(
        self, way: WayOut, *, after: int | None = None, strict: bool = True, share: float = 1.0
    ) -> WayOut | None:
        """An escape as it is known now, if it is still safe; after a movement, or from now on.

        share: of the margin that it has to keep.
        """
        terms = self._with(strict, share * self._full_m)
        begins = self._search.numbers(way.begins)
        if after is None:
            return self._search.keep_held(way, begins, self._here, terms)
        return self._search.keep_held(way, np.append(after, begins), self._here, terms, skipped=1)

    def finish_movement(
        self, way: WayOut | None, *, strict: bool = True, share: float = 1.0
    ) -> WayOut | None:
        """An escape that begins with what is left of the movement under way: goes on with one that
        is held after it, if that is still safe, or with a fresh one for None."""
        under_way, terms = self.under_way, self._with(strict, share * self._full_m)
        if under_way is None:
            return None
        path, sagitta_m, attitude = self._rest(under_way)
        left_s, spent_m = under_way.left_s, 0.0
        if terms.must_see:
            about = (terms.unseen_m, terms, leg_room(len(path), terms.shapes), terms.unobserved_m)
            spent_m = leg_unseen_m(STANDING, path, sagitta_m, (0.0, left_s), *about)
        if spent_m > terms.unobserved_m:
            return None
        terms = terms._replace(unobserved_m=terms.unobserved_m - spent_m)
        if not leg_keeps(STANDING, path, sagitta_m, 0.0, left_s, terms._replace(must_see=False)):
            return None
        at, legs = self.library.nearest(*attitude), self.library.legs_at(*attitude)
        there = Beginning(at, pose_after(STANDING, path), left_s, legs)
        if way is None:
            found = self._first(there, terms)
        else:
            found = self._search.keep_held(way, self._search.numbers(way.begins), there, terms)
        if found is None:
            return None
        return replace(
            found,
            begins=(under_way.movement, *found.begins),
            under_way_s=left_s,
            unobserved_m=spent_m + found.unobserved_m,
        )

    @property
    def finish_m(self) -> FloatArray:
        """[3] where the movement under way ends, in the grid frame."""
        assert self.under_way is not None
        path, _, _ = self._rest(self.under_way)
        end: FloatArray = self._terms.grid_from_level @ path[-1, :3]
        return end

    def lasts_s(self, movement: str) -> float:
        """How long a movement takes."""
        (at,) = self._search.numbers((movement,))
        return float(self._legs.duration_s[at])

    def end_m(self, movement: str) -> FloatArray:
        """[3] where a movement that begins now ends, in the grid frame."""
        (at,) = self._search.numbers((movement,))
        end: FloatArray = self._terms.grid_from_level @ self._legs.path[self._start, at, -1, :3]
        return end

    def _rest(self, under_way: UnderWay) -> tuple[FloatArray, float, tuple[float, float]]:
        """What is left of a movement: its path [SAMPLES, 4], how far that may lie from its chords,
        and roll and pitch at its end."""
        automaton = self.library.automaton
        movement = automaton[under_way.movement]
        start = np.array([0.0, 0.0, 0.0, *self._tilt, 0.0])
        shares = under_way.left_s * np.arange(1, LEG_SAMPLES + 1) / LEG_SAMPLES
        along = np.array([automaton.predict(start, movement, float(share)) for share in shares])
        length = np.linalg.norm(np.diff(along[:, :3], axis=0, prepend=0.0), axis=1).sum()
        bend = np.hypot(along[-1, 5], along[-1, 4] - self._tilt[1])
        sagitta_m = float(length * bend / (8.0 * LEG_SAMPLES**2))
        path = np.ascontiguousarray(along[:, [0, 1, 2, 5]])
        return path, sagitta_m, (float(along[-1, 3]), float(along[-1, 4]))

    def was_seen(self, corners_m: FloatArray, sagitta_m: float) -> bool:
        """Whether the body stays in space that was seen to be free, where that is asked for, on its
        way through corners [n, 3] of the world."""
        level = self._level(corners_m)
        return not self.strict or was_seen(level, sagitta_m, self._terms)

    def after_flight(
        self, there: State, start_s: float, *, aloof: bool
    ) -> tuple[WayOut | None, bool]:
        """The escape from where something ends that is no movement, so long from now, and whether
        it stands off: keeps the whole margin from unobserved space as well.

        aloof: such a one is looked for first; otherwise the first is taken that will do.
        """
        roll, pitch, yaw = there.attitude_rad.tolist()
        start, legs = self.library.nearest(roll, pitch), self.library.legs_at(roll, pitch)
        # Poses are those in still air, by which wind has not carried the vehicle yet.
        place = self._level(there.position_m[None])[0] - start_s * self._terms.wind_mps
        pose = np.array([*place, yaw - self._terms.yaw_rad])
        terms = self._with(True, self._full_m)
        from_unseen_m = self._aloof_m(terms) if aloof else self._aloof_m(terms)[-1:]
        way, kept_m = self._search.first(
            Beginning(start, pose, start_s, legs), terms, from_unseen_m
        )
        return way, aloof and kept_m == float(from_unseen_m[0])

    def _level(self, places_m: FloatArray) -> FloatArray:
        """[n, 3] places of the world, in the level frame of the decision."""
        turned = world_from_level(self._terms.yaw_rad)
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

    def _first(self, at: Beginning, terms: EscapeTerms) -> WayOut | None:
        return self._search.first(at, terms, self._aloof_m(terms))[0]

    def _aloof_m(self, terms: EscapeTerms) -> FloatArray:
        """Distances from unobserved space, the best first: what shows there then costs no
        margin."""
        if terms.must_see and terms.margin_m > terms.unseen_m:
            return np.array([terms.margin_m, terms.unseen_m])
        return np.array([terms.unseen_m])

    def _with(self, strict: bool, margin_m: float) -> EscapeTerms:
        must_see = strict and self.strict
        if must_see == self._terms.must_see and margin_m == self._terms.margin_m:
            return self._terms
        return self._terms._replace(must_see=must_see, margin_m=margin_m)
