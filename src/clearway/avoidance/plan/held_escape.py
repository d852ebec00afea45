"""The escape: what a decision holds so that no later decision is needed to stay safe.

A trajectory is good only as far as it is known, and a plan that ends before a wall is a promise
that somebody will think of something. So every decision takes along an escape: movements, and then
a loop or a stop that can be flown for ever, through space that was seen to be free, from where its
first movement ends. It is verified now, flown if no later decision finds anything better, and never
given up for something unverified. After FASTER (Tordesillas et al. 2019) and the emergency
manoeuvre library of Arora, Choudhury, Althoff and Scherer (2015).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from clearway.base.brief import one_line, runs
from clearway.base.frames import FloatArray

LESSER_MARGINS = (0.75, 0.5, 0.25, 0.0)
"""Shares of the margin at which the held escape is still flown before anything unverified."""


class Escape(StrEnum):
    """What must be known of an escape."""

    STRICT = "strict"
    """It leads through space that was seen to be free: no collision with what stands still."""
    BUDGETED = "budgeted"
    """As strict while that finds one; else up to `AvoidanceSettings.unobserved_m` metres of it may
    lead through unobserved space. What was seen or mapped to stand is kept clear of all the
    same."""
    MAPPED = "mapped"
    """As strict, but where a map is declared complete nothing needs to be seen."""
    KNOWN = "known"
    """It keeps clear of what is known; unobserved space counts as free. A flight whose sensors see
    enough is strict first, until that leads no further (`live.recovery.risk_level`)."""
    OFF = "off"
    """None is asked for."""


BY_SIGHT = (Escape.STRICT, Escape.BUDGETED)
"""Escapes that rest on what sensors see alone."""
SEES = (*BY_SIGHT, Escape.MAPPED)
"""Escapes that lead through what was seen to be free, but for what the last two allow."""


class Narrow(StrEnum):
    """What becomes of places that leave no escape because a vehicle cannot turn there."""

    REFUSE = "refuse"
    """They are entered only where an escape leads on through them."""
    ALLOW = "allow"
    """They are flown through, without one, where every way that leaves one is longer by the cost of
    no room to turn."""


class UnderWay(NamedTuple):
    """The movement that is being flown where a decision is taken in the middle of one."""

    movement: str
    left_s: float


def nowhere() -> FloatArray:
    """The places of a way of which nobody knows any."""
    return np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class WayOut:
    """Movements that can be flown from some moment on, for ever."""

    begins: tuple[str, ...]
    """Flown first."""
    loop: tuple[str, ...]
    """Flown again and again after that, at least one movement."""
    margin_m: float
    """Distance that it keeps from what is known."""
    certain: bool
    """Whether it is what was asked for; in strict mode, whether it was seen to be free."""
    room_m: float = np.inf
    """Distance from intruders on the first round, no more than twice the margin; inf without any,
    and through unobserved space."""
    for_s: float = np.inf
    """For how long it was verified: for ever where it comes back to where it began, which wind does
    not allow."""
    unsure: int = 0
    """How many decisions in a row found none that is certain."""
    under_way_s: float | None = None
    """What is left of its first movement, where that is being flown already; else None."""
    unobserved_m: float = 0.0
    """Metres of it that lead through unobserved space; 0 where none may."""
    leads: Callable[[], FloatArray] = field(default=nowhere, repr=False)
    """Tells `path_m`."""

    def __repr__(self) -> str:
        return one_line("WayOut", (runs(self.begins + self.loop), f"{self.margin_m:.3g} m clear"))

    @cached_property
    def path_m(self) -> FloatArray:
        """[n, 3] its places up to the end of the first round, world frame, as they were found; few
        decisions are looked at so closely."""
        return self.leads()

    @property
    def movements(self) -> tuple[str, ...]:
        """One round of it."""
        return self.begins + self.loop

    @property
    def after_one(self) -> WayOut:
        """What is left of it after its first movement."""
        return self.after(1)

    def after(self, movements: int) -> WayOut:
        """What is left of it after so many movements."""
        if movements == 0:
            return self
        begun = (movements - len(self.begins)) % len(self.loop)
        if movements <= len(self.begins):
            return replace(self, begins=self.begins[movements:], under_way_s=None)
        under_way_s = None if self.begins else self.under_way_s
        loop = self.loop[begun:] + self.loop[:begun]
        return replace(self, begins=(), loop=loop, under_way_s=under_way_s)
