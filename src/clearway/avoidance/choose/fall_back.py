"""What is flown where no choice leaves an escape.

Where none is left, the held escape is flown: it was verified when there was still time. Only where
that has been lost too, what is less sure follows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance.choose.candidates import Candidates, Commitment, among
from clearway.avoidance.choose.chosen import Basis, Choice
from clearway.avoidance.choose.leaving import Leaving, Taken
from clearway.avoidance.clear.hazards import Cause, Hazards
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.plan.held_escape import LESSER_MARGINS, UnderWay, WayOut
from clearway.avoidance.plan.prepared import PreparedReachSet

SHORTER = (0.25, 0.125, 0.0625)
"""Shares of the time for which escapes that drift are verified, where none lasts half of it."""
STANDS_WITHIN_M = 1e-3
"""Movements from rest that lead farther to the side gain speed."""
TO_AND_FRO = 8
"""Decisions in a row that led nowhere, after which a vehicle looks all round: as many as an eighth
of a turn each needs for a whole one."""


@dataclass(frozen=True, eq=False)
class FallBack:
    """One decision's escape, where nothing else leaves one."""

    leaving: Leaving
    ways: WaysOut

    @property
    def before(self) -> Commitment:
        """What binds this decision."""
        return self.leaving.before

    @property
    def held(self) -> WayOut | None:
        """The held escape."""
        return self.leaving.before.way_out

    @property
    def prepared(self) -> PreparedReachSet:
        """What can be flown."""
        return self.leaving.rated.prepared

    @property
    def _hazards(self) -> Hazards:
        """All that is around, with all that intruders may do."""
        return self.leaving.rated.hazards

    def stay(self) -> Taken | None:
        """The held escape, or a fresh one, flown for its own sake: where nothing leads on, and
        where nobody sees what is ahead. None where that is not so, or where none keeps the whole
        margin, of intruders too; of who is blind, a lesser one. What moves off in time flies on.

        Who is blind stays where escapes lead through what was seen, too: what stands beside space
        that was seen to be free may have been forgotten."""
        ways = self.ways
        if not (self.before.stays or self.before.blind):
            return None
        for share in (1.0, *LESSER_MARGINS) if self.before.blind else (1.0,):
            for way in self._with_share(ways, share):
                taken = self._fly_escape(way, ())
                if taken.good and self.leaving.room_ahead_m(way) >= share * ways.margin_m:
                    return taken
        return None

    def instead_of(self, taken: Taken) -> Taken:
        """What is flown where no candidate leaves an escape; `taken` is the best that does not."""
        ways = self.ways
        look = self._looks_round(taken.banned)
        if look is not None:
            return look
        if self._waits():
            known = self._choose_across_unobserved(taken)
            if known.good and known.way_out is not None and known.choice.basis is not Basis.NARROW:
                return known
        too_near: Taken | None = None
        beside = self._beside_intruders(taken)
        for way in self._ways_out():
            flown = self._fly_escape(way, taken.banned)
            if flown.good:
                if beside is not None and self._is_farther_off(beside, way):
                    return beside
                return self._no_nearer(flown) or flown
            too_near = too_near or flown
        beside = beside or too_near
        if beside is not None:
            return beside
        return self._choose_across_unobserved(taken) if ways.strict else taken

    def look_all_round(self, taken: Taken) -> Taken:
        """A turn on the spot, always to the same side, in place of a movement that stands where
        many before have come to nothing: to look to and fro, or to hold, shows nothing new. Where
        something moves, holding may be worth its time."""
        ways = self.ways
        if self.before.stood <= TO_AND_FRO or len(taken.hazards.moving.radius_m):
            return taken
        turns = ways.standing_turns()
        stands = ways.library.automaton.stands[self.prepared.first_movement[taken.choice.node]]
        if not (turns and stands and taken.good) or taken.finishes is not None:
            return taken
        left = max(turns, key=lambda movement: turns[movement])
        allowed = among(
            self.leaving.candidates,
            self.prepared.first_movement[self.leaving.candidates.nodes] == left,
        )
        way = ways.after(left)
        if way is None or not len(allowed.nodes):
            return taken
        choice = self.leaving.pick(taken.hazards, allowed)
        if choice.basis is Basis.EMERGENCY:
            return taken
        return Taken(choice, way, taken.banned)

    def _no_nearer(self, stays: Taken) -> Taken | None:
        """What leads on from a place that noise has brought too near to something, and comes no
        nearer: who stays there because nothing keeps the whole margin, stays for ever. What moves
        off has a wider tube than what stands: by so much its paths may seem to."""
        near_m, way = stays.choice.clearance_m, stays.way_out
        near_m -= self._wider_m(near_m)
        ways, full_m = self.ways, self.ways.margin_m
        if way is None or not 0.0 < near_m < full_m or not ways.stands(way):
            return None
        all_of_them = self.leaving.candidates
        leads_m = self.prepared.paths.samples_m[all_of_them.nodes, -1, :2]
        moves_off = among(all_of_them, np.hypot(*leads_m.T) > STANDS_WITHIN_M)
        # What only turns would turn to and fro for ever, but shows unobserved space.
        for allowed in (moves_off, all_of_them):
            taken = self._first_no_nearer(allowed, stays, near_m / full_m)
            if taken is not None:
                return taken
        return None

    def _first_no_nearer(self, allowed: Candidates, stays: Taken, share: float) -> Taken | None:
        """The best of some candidates that keeps a share of the margin, and leaves an escape that
        does."""
        while len(allowed.nodes):
            choice = self.leaving.pick(stays.hazards, allowed, share)
            if choice.basis is Basis.EMERGENCY:
                return None
            first = int(self.prepared.first_movement[choice.node])
            leaves = self.ways.after(first, share=share)
            if leaves is not None:
                choice = replace(choice, basis=Basis.NO_NEARER)
                return Taken(choice, leaves, stays.banned)
            allowed = among(allowed, self.prepared.first_movement[allowed.nodes] != first)
        return None

    def _wider_m(self, near_m: float) -> float:
        """By how much the least tube of a movement that gains speed is wider than at rest, as far
        as the body leaves room: no such path comes nearer by that."""
        prepared, planner = self.leaving.prepared, self.leaving.planner
        if not planner.automaton.has_inertia:
            return 0.0
        first = prepared.reach_set.parent < 0
        tubes_m = prepared.paths.sagitta_m[first]
        gains = np.hypot(*prepared.paths.samples_m[first, -1, :2].T) > STANDS_WITHIN_M
        wider_m = max(float(min(tubes_m[gains], default=0.0) - tubes_m.min()), 0.0)
        return min(wider_m, max(near_m - planner.settings.body_radius_m, 0.0))

    def _beside_intruders(self, taken: Taken) -> Taken | None:
        """What keeps away best from intruders that leave no margin, of all that leaves an escape
        past what stands: nobody dodges an aircraft into a wall."""
        if not len(self._hazards.moving.radius_m):
            return None
        lasting = self.leaving.lasting(self._hazards)
        found = [self._leading_past(some, taken) for some in lasting or ()]
        past = [each for each in found if each is not None]
        if not past:
            return self._leading_past(self.leaving.candidates, taken)
        return max(past, key=lambda each: each.choice.clearance_m)

    def _leading_past(self, candidates: Candidates, taken: Taken) -> Taken | None:
        """What keeps away best from intruders, of some candidates that leave an escape."""
        ways = self.ways
        firsts = self.prepared.first_movement[candidates.nodes]
        leave = [
            m
            for m in np.unique(firsts).tolist()
            if ways.leaves(m) or self.leaving.after(ways, m, strict=True) is not None
        ]
        allowed = among(candidates, np.isin(firsts, leave))
        if not len(allowed.nodes):
            return None
        choice = self.leaving.pick(self._hazards, allowed)
        first = int(self.prepared.first_movement[choice.node])
        way = self.leaving.after(ways, first, strict=True)
        return Taken(choice, way, taken.banned)

    def _is_farther_off(self, beside: Taken, way: WayOut) -> bool:
        """Whether what leads past intruders, though with less than the margin, stays farther off
        them than an escape does in its first round: who circles is caught up with by the faster."""
        choice, ways = beside.choice, self.ways
        if choice.limited_by is not Cause.INTRUDER or ways.under_way is not None:
            return False
        room_m = self.leaving.room_ahead_m(way)
        return room_m < ways.margin_m and choice.clearance_m > room_m

    def _looks_round(self, banned: tuple[str, ...]) -> Taken | None:
        """A turn on the spot, towards the goal if that is to the side: who only held would hold for
        ever, since nothing new comes into view."""
        ways, turns = self.ways, self.ways.standing_turns()
        aside = float(np.arctan2(self.leaving.goal.target_m[1], self.leaving.goal.target_m[0]))
        for movement in sorted(turns, key=lambda m: abs(aside - turns[m])):
            way = ways.after(movement)
            if way is not None:
                whole = replace(way, begins=(self.leaving.name(movement), *way.begins))
                if self.leaving.room_ahead_m(whole) >= ways.margin_m:
                    return self._fly_escape(whole, banned)
        return None

    def _choose_across_unobserved(self, taken: Taken) -> Taken:
        """What leaves an escape if unobserved space is free; else what was taken.

        Who has had no certain one for longer than it takes where nothing stands in the way stays
        for a round and looks about: what stands there would close in on the way ahead. Who sees
        nothing at all stays for as long as that is so.
        """
        before, unsure = self.before, 1 if self.held is None else self.held.unsure + 1
        late = before.certain_within is not None and unsure > before.certain_within
        # Who can stop, and has had a certain one, was brought out of it by an unsure place.
        waits = self.leaving.had_certain and self.ways.can_stop
        stays = self._stays(taken.banned) if late or waits or before.blind else None
        if stays is not None and stays.way_out is not None and not before.blind:
            stays = None if self._has_looked_round(stays.way_out, unsure) else stays
        found = stays or self._goes_on() or self._stays(taken.banned)
        if found is None or found.way_out is None:
            return found or taken
        return replace(found, way_out=replace(found.way_out, unsure=unsure))

    def _waits(self) -> bool:
        """Whether the first certain escape is waited for until one keeps the whole margin: where
        thin things are declared, for as long as it takes to look round. Of those nothing is seen
        from afar, so that the first one to be had leads near what is seen next. Where one was lost
        in flight, a lesser certain one is safer than none."""
        ways, held = self.ways, self.held
        declared = self.leaving.planner.settings.smallest_object_m is not None
        if not declared or not ways.strict or ways.drift or self.leaving.had_certain:
            return False
        if held is not None and self._has_looked_round(held, held.unsure + 1):
            return False
        return ways.now() is None

    def _has_looked_round(self, way: WayOut, unsure: int) -> bool:
        """Whether a round has been flown, which shows no more a second time."""
        return unsure > (self.before.certain_within or 0) + len(way.movements)

    def _goes_on(self) -> Taken | None:
        """The best that leaves an escape as far as is known."""
        known = self.leaving.choose(self._hazards, strict=False)
        return known if known.good else None

    def _stays(self, banned: tuple[str, ...]) -> Taken | None:
        """The held escape, or a fresh one, as far as is known."""
        ways = self.ways
        held = self.held if self.held is not None and not self.held.certain else None
        if ways.under_way is not None:
            way = ways.finish_movement(held, strict=False)
        else:
            way = None if held is None else ways.holds(held, strict=False)
        way = way or ways.now(strict=False)
        return None if way is None else self._fly_escape(way, banned)

    def _ways_out(self) -> Iterator[WayOut]:
        """Escapes that begin now, the surest first.

        One that was verified with all that the vehicle may be off, and holds no more from where it
        is off, leads through less unobserved space than any that is not verified at all. Of
        those that drift even one that lasts for seconds does: meanwhile the next may be found.
        """
        ways, in_hand = self.ways, self.held is not None and self.held.certain
        exact = ways.as_predicted if in_hand else None
        kinds = (ways, exact) if exact is not None else (ways,)
        for surely in kinds:
            for share in (1.0, *LESSER_MARGINS):
                for looked in (surely, surely.for_less(0.5)) if surely.drift else (surely,):
                    yield from self._with_share(looked, share)
        # The first one has to last: who is blown off the place where it began has been promised
        # nothing yet, and flies on to where there is one.
        for surely in kinds if ways.drift and self.leaving.had_certain else ():
            for shorter in SHORTER:
                for share in (1.0, *LESSER_MARGINS):
                    yield from self._with_share(surely.for_less(shorter), share)

    def _with_share(self, ways: WaysOut, share: float) -> Iterator[WayOut]:
        """Escapes with a share of the margin: the held one, else a fresh one; in the middle of a
        movement first those that finish it."""
        held = self.held if self.held is not None and self.held.certain else None
        if ways.under_way is not None:
            finished = None if held is None else ways.finish_movement(held, share=share)
            fresh = ways.finish_movement(None, share=share) if finished is None else finished
            if fresh is not None:
                yield fresh
            held = None
        again = None if held is None else ways.holds(held, share=share)
        if again is not None:
            yield again
        if again is None or share == 1.0:
            fresh = ways.now(share=share)
            if fresh is not None:
                yield fresh

    def _fly_escape(self, way: WayOut, banned: tuple[str, ...]) -> Taken:
        """An escape as what is flown now, as an emergency where an intruder is too near to it.

        Where the reach set lacks its first movement (a small one may have no room for holding),
        it is flown all the same, and told by the one that ends nearest.
        """
        reach_set, head = self.prepared.reach_set, way.movements[0]
        begins = (reach_set.parent < 0) & (
            reach_set.movement == reach_set.movement_names.index(head)
        )
        ways = self.ways
        finishes = None if way.under_way_s is None else UnderWay(head, way.under_way_s)
        if not begins.any():
            finishes = finishes or UnderWay(head, ways.lasts_s(head))
            ends_m = ways.finish_m if way.under_way_s is not None else ways.end_m(head)
            ends = reach_set.samples_m[:, -1] - ends_m
            off = np.where(reach_set.parent < 0, np.linalg.norm(ends, axis=1), np.inf)
            begins = off == off.min()
        alone = Candidates(
            np.flatnonzero(begins)[:1],
            self.prepared.path_cost_m[begins][:1],
            np.zeros(1, dtype=np.int64),
            np.ones(1, dtype=np.bool_),
            np.zeros(1),
            np.zeros(1, dtype=np.int64),
        )
        choice = Choice.of(self.leaving.rated, alone, 0, Basis.WAY_OUT, way.margin_m)
        if choice.limited_by is Cause.INTRUDER and choice.clearance_m < way.margin_m:
            choice = replace(choice, basis=Basis.EMERGENCY)
        return Taken(choice, way.after_one, banned, finishes=finishes)
