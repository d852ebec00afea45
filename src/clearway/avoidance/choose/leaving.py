"""The choice that leaves an escape.

First movements after which no escape is found are banned one by one, and the next best candidate is
asked; where none is left, see `fall_back`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from clearway.avoidance.choose.candidates import Candidates, Commitment, among
from clearway.avoidance.choose.choice import choose_by_rules, pick
from clearway.avoidance.choose.chosen import Basis, Choice
from clearway.avoidance.choose.lasting import Lasting, lasting_among, stands_for_s
from clearway.avoidance.clear.hazards import Cause, Hazards
from clearway.avoidance.clear.verify import KnownClearances
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.plan.costs import price_of
from clearway.avoidance.plan.held_escape import Narrow, UnderWay, WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.rated import Rated
from clearway.avoidance.rate.goal import Goal
from clearway.avoidance.rules.rule import Ruling


@dataclass(frozen=True, eq=False)
class Taken:
    """What a decision flies."""

    choice: Choice
    way_out: WayOut | None = None
    """From the end of its first movement on."""
    banned: tuple[str, ...] = ()
    """First movements after which no escape was found."""
    leaves: bool = True
    """Whether it leaves an escape, where one is asked for."""
    finishes: UnderWay | None = None
    """The movement under way, where that is flown to its end and then the escape."""

    @property
    def hazards(self) -> Hazards:
        """What it keeps clear of."""
        return self.choice.grounds.hazards

    @property
    def good(self) -> bool:
        """Whether it was verified, and its escape too."""
        if self.choice.basis is Basis.NARROW:
            return True
        return self.leaves and self.choice.basis is not Basis.EMERGENCY


@dataclass(frozen=True, eq=False)
class Leaving:
    """One decision's choice among what leaves an escape."""

    planner: Planner
    rated: Rated
    candidates: Candidates
    ruling: Ruling | None
    """What rules say of every trajectory; None where there are none."""
    goal: Goal
    ways: WaysOut | None
    """None where no escape is asked for."""
    before: Commitment

    @property
    def held(self) -> WayOut | None:
        """The held escape: what would be flown from now on without this decision."""
        return self.before.way_out

    @property
    def had_certain(self) -> bool:
        """Whether a certain escape is held, or was before in this flight."""
        return self.before.had_certain or (self.held is not None and self.held.certain)

    @property
    def prepared(self) -> PreparedReachSet:
        """What can be flown."""
        return self.rated.prepared

    @cached_property
    def _narrow_price_m(self) -> float:
        """What leaves no escape is flown, as far as it was seen to be free, where everything else
        costs more by this; inf where the mission does not allow it."""
        allowed = self.planner.settings.narrow == Narrow.ALLOW
        if not allowed or self.ways is None or not self.ways.strict:
            return np.inf
        return price_of(self.planner.prices.no_room) * self.prepared.step_m

    @cached_property
    def _looked(self) -> KnownClearances:
        """What was found of movements up to now."""
        return KnownClearances(self.prepared.paths)

    def pick(self, hazards: Hazards, allowed: Candidates, share: float = 1.0) -> Choice:
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
        """The best candidate that leaves an escape; where none does, the best that is verified, and
        where none is, the emergency rule's. Those come first that are clear of what moves for as
        long as any; of others, where something moves, only what leaves room to stop is good."""
        lasting = self.lasting(hazards)
        if lasting is None or self.ways is None:
            return self._choose_among(self.candidates, hazards, strict=strict)
        run_over: Taken | None = None
        for some in lasting:
            if len(some.nodes):
                taken = self._choose_among(some, hazards, strict=strict)
                if taken.good:
                    return taken
                grounds = taken.choice.basis, taken.choice.limited_by
                run_over = taken if grounds == (Basis.EMERGENCY, Cause.INTRUDER) else None
        if run_over is not None:
            return run_over
        return self._choose_among(self.candidates, hazards, strict=strict, stops=True)

    def lasting(self, hazards: Hazards) -> Lasting | None:
        """Candidates that are clear of what moves for as long as any is looked at; None where that
        is not asked."""
        margin_m = self.rated.near.margin_m
        return lasting_among(self.candidates, self.prepared, hazards.moving, margin_m)

    def room_ahead_m(self, way: WayOut) -> float:
        """Distance from intruders on an escape that begins now, inf without any. A stop is looked
        at for as long as it takes to leave it: who waits until what comes is a movement away has no
        time to move off."""
        ways, moving = self.ways, self.rated.hazards.moving
        if ways is None or not len(moving.radius_m):
            return np.inf
        return ways.room_m(way, stands_for_s(self.prepared) if ways.can_stop else 0.0)

    def _choose_among(
        self, allowed: Candidates, hazards: Hazards, *, strict: bool, stops: bool = False
    ) -> Taken:
        """The same of some candidates. stops: only those count as good of which the escape after
        the first movement keeps the margin from intruders too."""
        run_over: Taken | None = None
        banned: list[str] = []
        best: Choice | None = None
        narrow: Choice | None = None
        bold: Taken | None = None
        while len(allowed.nodes):
            choice = self.pick(hazards, allowed)
            best = best or choice
            if self.ways is None or choice.basis is Basis.EMERGENCY:
                break
            first = int(self.prepared.first_movement[choice.node])
            way = self.after(self.ways, first, strict=strict)
            if way is not None and strict and not self.ways.aloof(first):
                bold = bold or Taken(choice, way, tuple(banned))
                allowed = among(allowed, self.prepared.first_movement[allowed.nodes] != first)
                continue
            if way is not None and stops and self._is_run_over(first, way):
                run_over = run_over or Taken(choice, way, tuple(banned), leaves=False)
                allowed = among(allowed, self.prepared.first_movement[allowed.nodes] != first)
                continue
            if way is not None:
                if narrow is not None and choice.cost_m > narrow.cost_m + self._narrow_price_m:
                    break
                return Taken(choice, way, tuple(banned))
            if narrow is None and strict and self._may_be_flown(self.ways, choice.node):
                narrow = choice
            banned.append(self.name(first))
            allowed = among(allowed, self.prepared.first_movement[allowed.nodes] != first)
        assert best is not None  # There are always candidates.
        if bold is not None:
            return bold
        if run_over is not None:
            return run_over
        if narrow is not None:
            without = replace(narrow, basis=Basis.NARROW)
            return Taken(without, banned=tuple(banned), leaves=False)
        if self.ways is not None and best.basis is not Basis.EMERGENCY:
            best = replace(best, basis=Basis.NO_LOITER)
        return Taken(best, banned=tuple(banned), leaves=self.ways is None)

    def after(self, ways: WaysOut, first: int, *, strict: bool) -> WayOut | None:
        """The escape after a first movement: a fresh one, or the rest of the held one."""
        way = ways.after(first, strict=strict)
        held = self.held
        if way is not None or held is None or ways.under_way is not None:
            return way
        if held.movements[0] != self.name(first):
            return way
        if strict and not held.certain:
            return None
        return ways.holds(held.after_one, after=first, strict=strict)

    def _is_run_over(self, first: int, way: WayOut) -> bool:
        """Whether intruders come too near on the escape after a first movement."""
        whole = replace(way, begins=(self.name(first), *way.begins))
        return self.room_ahead_m(whole) < self.rated.near.margin_m

    def _may_be_flown(self, ways: WaysOut, node: int) -> bool:
        """Whether the way to a node may be flown without an escape: the mission allows it, and its
        first half leads through seen space."""
        if not self._narrow_price_m < np.inf:
            return False
        reach_set = self.prepared.reach_set
        nodes = reach_set.path(node)
        half = nodes[: (len(nodes) + 1) // 2]
        return ways.saw(reach_set.samples_m[half], reach_set.sagitta_m[half])

    def name(self, movement: int) -> str:
        """Return the name of a movement by its number."""
        return self.prepared.reach_set.movement_names[movement]
