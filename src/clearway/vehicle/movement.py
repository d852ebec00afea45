"""Movements: constant inputs held for a duration (def. 10, def. 11), and the usual sets of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.brief import brief
from clearway.base.checks import LARGEST, number_problem, shape_of
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray

HALF_TURN_DEG = 180.0


@dataclass(frozen=True)
class Movement:
    """Constant inputs (4.2) held for a duration: (3.14), def. 10, def. 11.

    Pitch rate is positive nose down, yaw rate left. `smooth` puts it into the smooth set of
    def. 25. climb_mps: rate of climb beside the speed ahead, of vehicles that climb without
    pitching; None for all that fly along their nose. Raises ClearwayError for a duration that is
    not positive (def. 12, rule 1) or inputs that are not finite.
    """

    name: str
    speed_mps: float
    roll_rate_rps: float = 0.0
    pitch_rate_rps: float = 0.0
    yaw_rate_rps: float = 0.0
    duration_s: float = 1.0
    smooth: bool = False
    climb_mps: float | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        if not (self.duration_s > 0.0 and np.isfinite(self.duration_s)):
            raise ClearwayError(f"movement {self.name}: duration must be positive and finite")
        if not (np.all(np.isfinite(self.inputs)) and self.speed_mps >= 0.0):
            raise ClearwayError(f"movement {self.name}: inputs must be finite, speed >= 0")

    @property
    def inputs(self) -> FloatArray:
        """[4] speed, roll rate, pitch rate, yaw rate; [5] with the rate of climb where it has one.

        What a vehicle's `advance` takes.
        """
        inputs = [self.speed_mps, self.roll_rate_rps, self.pitch_rate_rps, self.yaw_rate_rps]
        return np.array(inputs if self.climb_mps is None else [*inputs, self.climb_mps])

    @property
    def turn_rate_rps(self) -> float:
        """Bound of the rate at which the direction of flight turns."""
        return float(np.hypot(self.pitch_rate_rps, self.yaw_rate_rps))

    @property
    def pace_mps(self) -> float:
        """Speed along the path: ahead and up or down together."""
        climb = self.climb_mps or 0.0
        return float(np.hypot(self.speed_mps, climb)) if climb else self.speed_mps


def plane_movements(
    speed_mps: float, turn_step_deg: float, duration_s: float, *, diagonals: bool
) -> tuple[Movement, ...]:
    """The nine movements of section 4.3, or the five without diagonals.

    Raises ClearwayError naming the first number that is out of range.
    """
    _in_range("plane: speed_mps", speed_mps, 0.0, np.inf, bottom=True)
    _in_range("plane: turn_step_deg", turn_step_deg, -LARGEST, np.inf)
    _in_range("plane: duration_s", duration_s, 0.0, np.inf)
    rate = np.radians(turn_step_deg) / duration_s
    turns = {
        "Straight": (0, 0),
        "Down": (1, 0),
        "Up": (-1, 0),
        "Left": (0, 1),
        "Right": (0, -1),
        "Down-Left": (1, 1),
        "Down-Right": (1, -1),
        "Up-Left": (-1, 1),
        "Up-Right": (-1, -1),
    }
    return tuple(
        Movement(
            name,
            float(speed_mps),
            pitch_rate_rps=float(pitch * rate),
            yaw_rate_rps=float(yaw * rate),
            duration_s=float(duration_s),
            smooth=name == "Straight",
        )
        for name, (pitch, yaw) in turns.items()
        if diagonals or 0 in (pitch, yaw)
    )


def inertialess_movements(
    speed_mps: float,
    turn_step_deg: float,
    duration_s: float,
    steepest_deg: float,
    climb_mps: float | None,
    spot_turn_deg: float,
    slow_mps: Sequence[float] | None,
    *,
    diagonals: bool,
) -> tuple[Movement, ...]:
    """Ahead, climbing, turning, slower, straight up and down, on the spot, and holding.

    Raises ClearwayError naming the first number that is out of range.
    """
    _in_range("inertialess: speed_mps", speed_mps, 0.0, np.inf)
    _in_range("inertialess: duration_s", duration_s, 0.0, np.inf)
    _in_range("inertialess: turn_step_deg", turn_step_deg, 0.0, HALF_TURN_DEG, top=True)
    _in_range("inertialess: spot_turn_deg", spot_turn_deg, 0.0, HALF_TURN_DEG, top=True)
    _in_range("inertialess: steepest_deg", steepest_deg, 0.0, 90.0, bottom=True)
    steepest_mps = speed_mps * float(np.sin(np.radians(steepest_deg)))
    vertical = steepest_mps if climb_mps is None else climb_mps
    _in_range("inertialess: climb_mps", vertical, 0.0, np.inf, bottom=True)
    if slow_mps is not None and len(shape_of(slow_mps)) != 1:
        raise ClearwayError(f"inertialess: slow_mps must be several numbers, got {slow_mps!r}")
    slower = (0.5 * speed_mps,) if slow_mps is None else tuple(slow_mps)
    for slow in slower:
        _in_range("inertialess: slow_mps", slow, 0.0, speed_mps)
    if len(set(slower)) < len(slower):
        raise ClearwayError(f"inertialess: slow_mps must differ, got {slower}")
    turn = float(np.radians(turn_step_deg) / duration_s)
    spot = float(np.radians(spot_turn_deg) / duration_s)

    def movement(
        name: str, ahead: float, up: float = 0.0, yaw: float = 0.0, *, smooth: bool = False
    ) -> Movement:
        return Movement(
            name,
            float(ahead),
            yaw_rate_rps=yaw,
            duration_s=float(duration_s),
            smooth=smooth,
            climb_mps=float(up),
        )

    def all_movements() -> Iterator[Movement]:
        up = min(vertical, steepest_mps)
        ahead = float(np.sqrt(speed_mps**2 - up**2))
        yield movement("Straight", speed_mps, smooth=True)
        yield movement("Left", speed_mps, yaw=turn)
        yield movement("Right", speed_mps, yaw=-turn)
        for name, climb in (("Up", up), ("Down", -up)) if up > 0.0 else ():
            yield movement(name, ahead, climb)
            if diagonals:
                yield movement(f"{name}-Left", ahead, climb, turn)
                yield movement(f"{name}-Right", ahead, climb, -turn)
        for slow in slower:
            name = "Slow" if len(slower) == 1 else f"Slow-{slow:g}"
            yield movement(name, slow)
            yield movement(f"{name}-Left", slow, yaw=turn)
            yield movement(f"{name}-Right", slow, yaw=-turn)
        if vertical > 0.0:
            yield movement("Climb", 0.0, vertical)
            yield movement("Sink", 0.0, -vertical)
        yield movement("Turn-Left", 0.0, yaw=spot)
        yield movement("Turn-Right", 0.0, yaw=-spot)
        yield movement("Hold", 0.0)

    return tuple(all_movements())


def _in_range(
    name: str, value: float, low: float, high: float, *, bottom: bool = False, top: bool = False
) -> None:
    """Refuse what does not lie between two numbers; the ends belong to it where said."""
    inside = number_problem(name, value, -LARGEST, LARGEST) is None and (
        low < value < high or (bottom and value == low) or (top and value == high)
    )
    if not inside:
        ends = f"{'from' if bottom else 'above'} {low:g}"
        ends += "" if np.isinf(high) else f", {'at most' if top else 'below'} {high:g}"
        raise ClearwayError(f"{name} must be a number {ends}, got {value!r}")
