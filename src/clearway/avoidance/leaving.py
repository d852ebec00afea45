"""The choice that leaves a way out, and what is flown where no choice does.

First movements after which no way out is found are banned one by one, and the next best candidate
is asked. Where none is left, the way out in hand is flown: it was verified when there was still
time. Only where that has been lost too, what is less sure follows, and the emergency rule last.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from clearway.avoidance.candidates import Candidates, Commitment, among
from clearway.avoidance.choice import choose_by_rules, pick
from clearway.avoidance.chosen import Basis, Choice
from clearway.avoidance.costs import price_of
from clearway.avoidance.goal import Goal
from clearway.avoidance.hazards import Cause, Hazards
from clearway.avoidance.planner import Planner
from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.rated import Rated
from clearway.avoidance.rules.rule import Ruling
from clearway.avoidance.verify import KnownClearances
from clearway.avoidance.way_out import LESSER_MARGINS, Narrow, UnderWay, WayOut
from clearway.avoidance.ways_out import WaysOut

SHORTER = (0.25, 0.125, 0.0625)
"""Shares of the time for which ways out that drift are verified, where none lasts half of it."""
TO_AND_FRO = 8
"""Decisions in a row that led nowhere, after which a vehicle looks all round: as many as an eighth
of a turn each needs for a whole one."""


@dataclass(frozen=True, eq=False)
class Taken:
    """What a decision flies."""

    choice: Choice
    way_out: WayOut | None = None
    """From the end of its first movement on."""
    banned: tuple[str, ...] = ()
    """First movements after which no way out was found."""
    leaves: bool = True
    """Whether it leaves a way out, where one is asked for."""
    finishes: UnderWay | None = None
    """The movement under way, where that is flown to its end and then the way out."""

    @property
    def hazards(self) -> Hazards:
        """What it keeps clear of."""
        return self.choice.grounds.hazards

    @property
    def good(self) -> bool:
        """Whether it was verified, and its way out too."""
        if self.choice.basis is Basis.NARROW:
            return True
        return self.leaves and self.choice.basis is not Basis.EMERGENCY


@dataclass(frozen=True, eq=False)
class Leaving:
    """One decision's choice among what leaves a way out."""

    planner: Planner
    rated: Rated
    candidates: Candidates
    ruling: Ruling | None
    """What rules say of every trajectory; None where there are none."""
    goal: Goal
    ways: WaysOut | None
    """None where no way out is asked for."""
    before: Commitment

    @property
    def held(self) -> WayOut | None:
        """The way out in hand: what would be flown from now on without this decision."""
        return self.before.way_out

    @property
    def had_certain(self) -> bool:
        """Whether a certain way out is in hand, or was before in this flight."""
        return self.before.had_certain or (self.held is not None and self.held.certain)

    @property
    def prepared(self) -> PreparedReachSet:
        """What can be flown."""
        return self.rated.prepared

    @property
    def _declares_thin(self) -> bool:
        """Whether thin things are declared, which show late."""
        return self.planner.settings.smallest_object_m is not None

    @cached_property
    def _narrow_price_m(self) -> float:
        """What leaves no way out is flown, as far as it was seen to be free, where everything else
        costs more by this; inf where the mission does not allow it."""
        allowed = self.planner.settings.narrow == Narrow.ALLOW
        if not allowed or self.ways is None or not self.ways.strict:
            return np.inf
        return price_of(self.planner.prices.no_room) * self.prepared.step_m

    @cached_property
    def _looked(self) -> KnownClearances:
        """What was found of movements up to now."""
        return KnownClearances(self.prepared.paths)

    def _pick(self, hazards: Hazards, allowed: Candidates, share: float = 1.0) -> Choice:
        """The best of some candidates, clear of some hazards by a share of the margin."""
        rated, margin_m = self.rated.clear_of(hazards), share * self.rated.near.margin_m
        verify = self.planner.settings.verify

        def pick_among(some: Candidates, none_passes: bool) -> Choice:
            return pick(
                rated, some, margin_m, verify=verify, none_passes=none_passes, looked=self._looked
            )

        if self.ruling is None:
            return pick_among(allowed, False)
        return choose_by_rules(self.ruling, allowed, pick_among)  # fig. 7.1

    def choose(self, hazards: Hazards, *, strict: bool = True) -> Taken:
        """The best candidate that leaves a way out; where none does, the best that is verified, and
        where none is, the emergency rule's."""
        allowed = self.candidates
        banned: list[str] = []
        best: Choice | None = None
        narrow: Choice | None = None
        bold: Taken | None = None
        while len(allowed.nodes):
            choice = self._pick(hazards, allowed)
            best = best or choice
            if self.ways is None or choice.basis is Basis.EMERGENCY:
                break
            first = int(self.prepared.first_movement[choice.node])
            way = self._after(self.ways, first, strict)
            if way is not None and strict and not self.ways.aloof(first):
                bold = bold or Taken(choice, way, tuple(banned))
                allowed = among(allowed, self.prepared.first_movement[allowed.nodes] != first)
                continue
            if way is not None:
                if narrow is not None and choice.cost_m > narrow.cost_m + self._narrow_price_m:
                    break
                return Taken(choice, way, tuple(banned))
            if narrow is None and strict and self._may_be_flown(self.ways, choice.node):
                narrow = choice
            banned.append(self._name(first))
            allowed = among(allowed, self.prepared.first_movement[allowed.nodes] != first)
        assert best is not None  # There are always candidates.
        if bold is not None:
            return bold
        if narrow is not None:
            without = replace(narrow, basis=Basis.NARROW)
            return Taken(without, banned=tuple(banned), leaves=False)
        if self.ways is not None and best.basis is not Basis.EMERGENCY:
            best = replace(best, basis=Basis.NO_LOITER)
        return Taken(best, banned=tuple(banned), leaves=self.ways is None)

    def stay(self, hazards: Hazards) -> Taken | None:
        """The way out in hand, or a fresh one, flown for its own sake: where nothing leads on, and
        where nobody sees what is ahead and ways out need not lead through what was seen. None where
        that is not so, or where none keeps the whole margin, of intruders too; of who is blind, a
        lesser one."""
        ways = self.ways
        if ways is None or not (self.before.stays if ways.strict else self.before.blind):
            return None
        for share in (1.0, *LESSER_MARGINS) if self.before.blind else (1.0,):
            for way in self._with_share(ways, share):
                taken = self._flown(way, hazards, ())
                if taken.good:
                    return taken
        return None

    def fall_back(self, taken: Taken, hazards: Hazards) -> Taken:
        """What is flown where no candidate leaves a way out; `taken` is the best that does not."""
        ways = self.ways
        if ways is None:
            return taken
        look = self._looks_round(ways, hazards, taken.banned)
        if look is not None:
            return look
        if self._waits(ways):
            known = self._unseen(ways, taken, hazards)
            if known.good and known.way_out is not None and known.choice.basis is not Basis.NARROW:
                return known
        too_near: Taken | None = None
        beside = self._beside_intruders(ways, taken, hazards)
        for way in self._ways_out(ways):
            flown = self._flown(way, hazards, taken.banned)
            if flown.good:
                if beside is not None and self._is_farther_off(beside, ways, way):
                    return beside
                return self._no_nearer(ways, flown) or flown
            too_near = too_near or flown
        beside = beside or too_near
        if beside is not None:
            return beside
        return self._unseen(ways, taken, hazards) if ways.strict else taken

    def look_all_round(self, taken: Taken) -> Taken:
        """A turn on the spot, always to the same side, in place of a movement that stands where
        many before have come to nothing: to look to and fro, or to hold, shows nothing new. Where
        something moves, holding may be worth its time."""
        ways = self.ways
        if ways is None or self.before.stood <= TO_AND_FRO or len(taken.hazards.moving.radius_m):
            return taken
        turns = ways.standing_turns()
        stands = ways.library.automaton.stands[self.prepared.first_movement[taken.choice.node]]
        if not (turns and stands and taken.good) or taken.finishes is not None:
            return taken
        left = max(turns, key=lambda movement: turns[movement])
        allowed = among(
            self.candidates, self.prepared.first_movement[self.candidates.nodes] == left
        )
        way = ways.after(left)
        if way is None or not len(allowed.nodes):
            return taken
        choice = self._pick(taken.hazards, allowed)
        if choice.basis is Basis.EMERGENCY:
            return taken
        return Taken(choice, way, taken.banned)

    def _no_nearer(self, ways: WaysOut, stays: Taken) -> Taken | None:
        """What leads on from a place that noise has brought too near to something, and comes no
        nearer: who stays there because nothing keeps the whole margin, stays for ever."""
        near_m, way = stays.choice.clearance_m, stays.way_out
        full_m = ways.margin_m
        if way is None or not 0.0 < near_m < full_m or not ways.stands(way):
            return None
        share, allowed = near_m / full_m, self.candidates
        while len(allowed.nodes):
            choice = self._pick(stays.hazards, allowed, share)
            if choice.basis is Basis.EMERGENCY:
                return None
            first = int(self.prepared.first_movement[choice.node])
            leaves = ways.after(first, share=share)
            if leaves is not None:
                choice = replace(choice, basis=Basis.NO_NEARER)
                return Taken(choice, leaves, stays.banned)
            allowed = among(allowed, self.prepared.first_movement[allowed.nodes] != first)
        return None

    def _beside_intruders(self, ways: WaysOut, taken: Taken, hazards: Hazards) -> Taken | None:
        """What keeps away best from intruders that leave no margin, of all that leaves a way out
        past what stands: nobody dodges an aircraft into a wall."""
        if not len(hazards.moving.radius_m):
            return None
        firsts = self.prepared.first_movement[self.candidates.nodes]
        leave = [
            m
            for m in np.unique(firsts).tolist()
            if ways.leaves(m) or self._after(ways, m, True) is not None
        ]
        allowed = among(self.candidates, np.isin(firsts, leave))
        if not len(allowed.nodes):
            return None
        choice = self._pick(hazards, allowed)
        way = self._after(ways, int(self.prepared.first_movement[choice.node]), True)
        return Taken(choice, way, taken.banned)

    def _is_farther_off(self, beside: Taken, ways: WaysOut, way: WayOut) -> bool:
        """Whether what leads past intruders, though with less than the margin, stays farther off
        them than a way out does in its first round: who circles is caught up with by the faster."""
        choice = beside.choice
        if choice.limited_by is not Cause.INTRUDER or ways.under_way is not None:
            return False
        room_m = ways.room_m(way)
        return room_m < ways.margin_m and choice.clearance_m > room_m

    def _looks_round(
        self, ways: WaysOut, hazards: Hazards, banned: tuple[str, ...]
    ) -> Taken | None:
        """A turn on the spot, towards the goal if that is aside: who only held would hold for ever,
        since nothing new comes into view."""
        turns = ways.standing_turns()
        aside = float(np.arctan2(self.goal.target_m[1], self.goal.target_m[0]))
        for movement in sorted(turns, key=lambda m: abs(aside - turns[m])):
            way = ways.after(movement)
            if way is not None:
                whole = replace(way, begins=(self._name(movement), *way.begins))
                return self._flown(whole, hazards, banned)
        return None

    def _unseen(self, ways: WaysOut, taken: Taken, hazards: Hazards) -> Taken:
        """What leaves a way out if what nobody has seen is free; else what was taken.

        Who has had no certain one for longer than it takes where nothing stands in the way stays
        for a round and looks about: what stands there would close in on the way ahead. Who sees
        nothing at all stays for as long as that is so.
        """
        before, unsure = self.before, 1 if self.held is None else self.held.unsure + 1
        late = before.certain_within is not None and unsure > before.certain_within
        # Who can stop, and has had a certain one, was brought out of it by an unsure place.
        waits = self.had_certain and ways.can_stop
        stays = None
        if late or waits or before.blind:
            stays = self._stays(ways, hazards, taken.banned)
        if stays is not None and stays.way_out is not None and not before.blind:
            stays = None if self._has_looked_round(stays.way_out, unsure) else stays
        found = stays or self._goes_on(hazards) or self._stays(ways, hazards, taken.banned)
        if found is None or found.way_out is None:
            return found or taken
        return replace(found, way_out=replace(found.way_out, unsure=unsure))

    def _waits(self, ways: WaysOut) -> bool:
        """Whether the first certain way out is waited for until one keeps the whole margin: where
        thin things are declared, for as long as it takes to look round. Of those nothing is seen
        from afar, so that the first one to be had leads near what is seen next. Where one was lost
        in flight, a lesser certain one is safer than none."""
        held = self.held
        if not self._declares_thin or not ways.strict or ways.drift or self.had_certain:
            return False
        if held is not None and self._has_looked_round(held, held.unsure + 1):
            return False
        return ways.now() is None

    def _has_looked_round(self, way: WayOut, unsure: int) -> bool:
        """Whether a round has been flown, which shows no more a second time."""
        return unsure > (self.before.certain_within or 0) + len(way.movements)

    def _goes_on(self, hazards: Hazards) -> Taken | None:
        """The best that leaves a way out as far as is known."""
        known = self.choose(hazards, strict=False)
        return known if known.good else None

    def _stays(self, ways: WaysOut, hazards: Hazards, banned: tuple[str, ...]) -> Taken | None:
        """The way out in hand, or a fresh one, as far as is known."""
        held = self.held if self.held is not None and not self.held.certain else None
        if ways.under_way is not None:
            way = ways.finished(held, strict=False)
        else:
            way = None if held is None else ways.holds(held, strict=False)
        way = way or ways.now(strict=False)
        return None if way is None else self._flown(way, hazards, banned)

    def _ways_out(self, ways: WaysOut) -> Iterator[WayOut]:
        """Ways out that begin now, the surest first.

        One that was verified with all that the vehicle may be off, and holds no more from where it
        is off, leads through less that nobody has seen than any that is not verified at all. Of
        those that drift even one that lasts for seconds does: meanwhile the next may be found.
        """
        in_hand = self.held is not None and self.held.certain
        exact = ways.as_predicted if in_hand else None
        kinds = (ways, exact) if exact is not None else (ways,)
        for surely in kinds:
            for share in (1.0, *LESSER_MARGINS):
                for looked in (surely, surely.for_less(0.5)) if surely.drift else (surely,):
                    yield from self._with_share(looked, share)
        # The first one has to last: who is blown off the place where it began has been promised
        # nothing yet, and flies on to where there is one.
        for surely in kinds if ways.drift and self.had_certain else ():
            for shorter in SHORTER:
                for share in (1.0, *LESSER_MARGINS):
                    yield from self._with_share(surely.for_less(shorter), share)

    def _with_share(self, ways: WaysOut, share: float) -> Iterator[WayOut]:
        """Ways out with a share of the margin: the one in hand, else a fresh one; in the middle of
        a movement first those that finish it."""
        held = self.held if self.held is not None and self.held.certain else None
        if ways.under_way is not None:
            finished = None if held is None else ways.finished(held, share=share)
            fresh = ways.finished(None, share=share) if finished is None else finished
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

    def _after(self, ways: WaysOut, first: int, strict: bool) -> WayOut | None:
        """The way out after a first movement: a fresh one, or the rest of the one in hand."""
        way = ways.after(first, strict=strict)
        held = self.held
        if way is not None or held is None or ways.under_way is not None:
            return way
        if held.movements[0] != self._name(first):
            return way
        if strict and not held.certain:
            return None
        return ways.holds(held.after_one, after=first, strict=strict)

    def _may_be_flown(self, ways: WaysOut, node: int) -> bool:
        """Whether the way to a node may be flown without a way out: the mission allows it, and its
        first half leads through seen space."""
        if not self._narrow_price_m < np.inf:
            return False
        reach_set = self.prepared.reach_set
        nodes = reach_set.path(node)
        half = nodes[: (len(nodes) + 1) // 2]
        return ways.saw(reach_set.samples_m[half], reach_set.sagitta_m[half])

    def _name(self, movement: int) -> str:
        return self.prepared.reach_set.movement_names[movement]

    def _flown(self, way: WayOut, hazards: Hazards, banned: tuple[str, ...]) -> Taken:
        """A way out as what is flown now, as an emergency where an intruder is too near to it.

        Where the reach set lacks its first movement (a small one may have no room for holding),
        it is flown all the same, and told by the one that ends nearest.
        """
        reach_set, head = self.prepared.reach_set, way.movements[0]
        begins = (reach_set.parent < 0) & (
            reach_set.movement == reach_set.movement_names.index(head)
        )
        finishes, ways = None, self.ways
        assert ways is not None  # Or there would be no way out.
        if way.under_way_s is not None:
            finishes = UnderWay(head, way.under_way_s)
        elif not begins.any():
            finishes = UnderWay(head, ways.lasts_s(head))
        if not begins.any():
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
        choice = Choice.of(self.rated.clear_of(hazards), alone, 0, Basis.WAY_OUT, way.margin_m)
        if choice.limited_by is Cause.INTRUDER and choice.clearance_m < way.margin_m:
            choice = replace(choice, basis=Basis.EMERGENCY)
        return Taken(choice, way.after_one, banned, finishes=finishes)
