"""What a guardian says: what is to be flown now, whether it is the wish, and why."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import WayOut
from clearway.base.brief import one_line
from clearway.base.frames import FloatArray
from clearway.live.link.set_point import SetPoint


@dataclass(frozen=True, eq=False)
class Guarded:
    """What is to be flown now, and why."""

    time_s: float
    passed: bool
    """Whether it is what was wished, unchanged."""
    set_point: SetPoint
    """Where to be, how fast, and where to point now; world frame."""
    velocity_mps: FloatArray
    """[3] to be flown, world frame: of a wish that passed the wished one."""
    yaw_rate_rps: float
    """Of the nose, left positive."""
    why: str
    margin_m: float
    """That is asked now."""
    way_out: WayOut | None
    """What is flown if nothing better is found from now on."""
    slowed: bool = False
    """Whether it is the wish, only slower: the vehicle is not that fast."""
    evades: bool = False
    """Whether it is another velocity, past an aircraft that the wish would meet."""
    nearest: bool = False
    """Whether it is the velocity nearest to the wished one of those that are safe."""
    changed_mps: float | None = None
    """By how much it is off the wish, once what is flown has been reached; None without a wish."""
    decision: Decision | None = None
    """That took the place of the wish, where one was taken now."""

    @property
    def is_wish(self) -> bool:
        """Whether what was wished is flown, at its speed or slower."""
        return self.passed or self.slowed

    @property
    def is_velocity(self) -> bool:
        """Whether a velocity is flown, and not a plan with places and times."""
        return self.is_wish or self.evades or self.nearest

    @property
    def what(self) -> str:
        """What became of the wish, in a word."""
        marks = (("passed", self.passed), ("slowed", self.slowed), ("nearest", self.nearest))
        return next((word for word, holds in marks if holds), "replaced")

    def __repr__(self) -> str:
        return one_line("Guarded", (f"{self.time_s:g} s", self.what, self.why))
