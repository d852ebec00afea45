"""What every safety filter takes and gives: one protocol for the guardian and its rivals.

A filter stands between whoever commands a copter and its autopilot. It is told where the copter
is, which velocity is wished, and what is known around it. It gives what the autopilot is sent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.live.link.set_point import SetPoint
from clearway.mavlink.simulated_targets import Target, VelocityTarget
from clearway.sensors import Scan

TICK_S = 0.05
"""Between two commands."""


@dataclass(frozen=True, slots=True, eq=False)
class Own:
    """The copter's state, which every filter is told without error."""

    time_s: float
    position_m: FloatArray
    """[3] world frame, z up."""
    velocity_mps: FloatArray
    """[3]"""
    yaw_rad: float


class Copter(NamedTuple):
    """What every filter knows of the vehicle, and must keep."""

    acceleration_mps2: float
    """At which it surely changes its velocity."""
    speed_mps: float
    margin_m: float
    """To keep between its middle and any surface."""
    body_m: float
    """Radius of its body: nearer is a contact."""


class Surroundings(Protocol):
    """What is known of the world: the same for every filter that asks for it."""

    @property
    def news(self) -> Sequence[Scan]:
        """Scans that came since the last command."""
        ...

    def catch_up(self, own: Own, /) -> None:
        """Take in what has come, as it is seen from the own position."""
        ...

    def clearances_m(self, places_m: FloatArray) -> FloatArray:
        """Return the distance [n] from places [n, 3] to the nearest known surface."""
        ...

    def nearest(self, places_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the middle [n, 3] and radius [n] of the ball that is nearest to each place."""
        ...

    def nearest_balls(self, place_m: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
        """Return the balls nearest to a place [3], at most `count` of them."""
        ...

    def were_seen(self, places_m: FloatArray) -> BoolArray:
        """Return whether the body at places [n, 3] lies in space that was seen to be free."""
        ...


class Command(NamedTuple):
    """What the autopilot is sent."""

    target: Target
    passed: bool
    """Whether it is the wish, unchanged."""
    took_ms: float | None = None
    """CPU, where another process answered."""


class SafetyFilter(Protocol):
    """One flight's filter: it may remember."""

    def look(self, own: Own, known: Surroundings, /) -> None:
        """Take in what has come; not timed."""
        ...

    def command(self, own: Own, wish_mps: FloatArray, known: Surroundings, /) -> Command:
        """Return what is flown from now on, for a wished velocity [3], world frame."""
        ...


def check_wish(wish_mps: FloatArray) -> FloatArray:
    """Return a wish [3] if it is one; raises InputError for what is not three finite numbers."""
    wish = np.asarray(wish_mps, dtype=np.float64)
    if wish.shape != (3,) or not np.all(np.isfinite(wish)):
        raise InputError("wish", ["must be three finite numbers"])
    return wish


def pass_on(wish_mps: FloatArray) -> Command:
    """Return the wish, unchanged."""
    return Command(VelocityTarget(wish_mps, 0.0), True)


def accelerate(own: Own, acceleration_mps2: FloatArray) -> Command:
    """Return an acceleration [3] as a set-point from the own state on."""
    return Command(
        SetPoint(own.position_m, own.velocity_mps, own.yaw_rad, acceleration_mps2), False
    )


def stand() -> Command:
    """Return a command to stand still."""
    return Command(VelocityTarget(np.zeros(3), 0.0), False)


class Looker:
    """Takes in what has come by the shared knowledge, and keeps nothing of its own."""

    def look(self, own: Own, known: Surroundings) -> None:
        """See `SafetyFilter`."""
        known.catch_up(own)


class Unfiltered:
    """No filter: every wish passes."""

    def look(self, _own: Own, _known: Surroundings) -> None:
        """Take nothing in."""

    def command(self, _own: Own, wish_mps: FloatArray, _known: Surroundings) -> Command:
        """Return the wish."""
        return pass_on(check_wish(wish_mps))
