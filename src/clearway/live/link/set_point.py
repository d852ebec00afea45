"""Set-points, whatever the link makes of them: follow a plan, hold a place, an escape ahead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray, measure_length, world_from_body, wrap_angle
from clearway.base.state import State
from clearway.hand.handover import MOST_MOMENTS
from clearway.vehicle.reference import Reference

SINKING_MPS2 = 0.5
"""By which sinking is stopped above the floor: half of what ArduCopter brakes by."""
SINKS_AHEAD_S = 0.5
"""How far below the vehicle a place near the floor is, at the fastest that it may sink there."""
PULL_PER_S = 1.0
"""Speed of a vehicle that takes velocities only towards its place, for every metre off it."""
MOST_PULL = 0.3
"""That speed at most, in own speeds."""
TURN_PER_S = 1.5
"""Yaw rate of such a vehicle, for every radian that its nose is off."""
MOST_TURN_RPS = 1.0
"""That yaw rate at most."""
HOLDS = 3
"""How often a last set-point to hold is sent: one may get lost."""


@dataclass(frozen=True, slots=True, eq=False)
class SetPoint:
    """Where to be, how fast, and where to point; world frame, z up."""

    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray | None
    """[3] None holds the place."""
    yaw_rad: float
    """Left positive from x."""
    acceleration_mps2: FloatArray | None = None
    """[3] of a vehicle with inertia; None where none is asked for."""
    yaw_rate_rps: float = 0.0

    @classmethod
    def following(
        cls, state: State, speed_mps: float, climb_mps: float = 0.0, yaw_rate_rps: float = 0.0
    ) -> SetPoint:
        """On a plan that has the vehicle in a state.

        climb_mps: beside the speed along the nose, of what climbs without pitching.
        """
        velocity = speed_mps * world_from_body(np.ascontiguousarray(state.attitude_rad))[:, 0]
        velocity[2] += climb_mps
        yaw = float(state.attitude_rad[2])
        return cls(state.position_m, velocity, yaw, yaw_rate_rps=yaw_rate_rps)

    @classmethod
    def of_reference(cls, asked: Reference) -> SetPoint:
        """Of a vehicle with inertia: with the acceleration, so that it need not lag."""
        return cls(
            asked.position_m,
            asked.velocity_mps,
            float(wrap_angle(np.asarray(asked.yaw_rad))),
            asked.acceleration_mps2,
            asked.yaw_rate_rps,
        )

    @classmethod
    def holding(cls, place_m: FloatArray, yaw_rad: float) -> SetPoint:
        return cls(place_m, None, yaw_rad)

    def earlier_by(self, seconds: float) -> SetPoint:
        """Where it was before, at the same velocity."""
        if self.velocity_mps is None or seconds <= 0.0:
            return self
        return replace(self, position_m=self.position_m - seconds * self.velocity_mps)

    def hold(self) -> SetPoint:
        """The same place, to stay at."""
        return replace(self, velocity_mps=None, acceleration_mps2=None, yaw_rate_rps=0.0)

    def as_velocity(
        self, own_m: FloatArray, heading_rad: float, speed_mps: float
    ) -> tuple[FloatArray, float]:
        """Velocity [3] and yaw rate for a vehicle that takes nothing else: drawn to the place.

        To hold is to stand still, since the last one may be flown on. own_m, heading_rad: where it
        is and points; speed_mps: its greatest.
        """
        if self.velocity_mps is None:
            return np.zeros(3), 0.0
        pull = PULL_PER_S * (self.position_m - own_m)
        pull *= min(1.0, MOST_PULL * speed_mps / max(measure_length(pull), 1e-9))
        turn = TURN_PER_S * float(wrap_angle(np.asarray(self.yaw_rad - heading_rad)))
        turn = min(max(turn, -MOST_TURN_RPS), MOST_TURN_RPS)
        return self.velocity_mps + pull, self.yaw_rate_rps + turn

    def above(self, floor_m: float, own_m: FloatArray) -> SetPoint:
        """No lower than a height, and on the way down there no faster than can be stopped.

        own_m: [3] where the vehicle is.
        """
        room_m = max(0.0, float(min(self.position_m[2], own_m[2])) - floor_m)
        fastest = float(np.sqrt(2.0 * SINKING_MPS2 * room_m))
        lowest_m = max(floor_m, float(own_m[2]) - fastest * SINKS_AHEAD_S)
        place, velocity, faster = self.position_m, self.velocity_mps, self.acceleration_mps2
        if place[2] < lowest_m and (velocity is not None or place[2] < floor_m):
            place = np.array([*place[:2], lowest_m])
        if velocity is not None and velocity[2] < -fastest:
            velocity = np.array([*velocity[:2], -fastest])
            faster = None if faster is None else np.array([*faster[:2], max(0.0, faster[2])])
        return replace(self, position_m=place, velocity_mps=velocity, acceleration_mps2=faster)


class SetPointAhead(NamedTuple):
    """A set-point, and how long after the present one it is due; by the vehicle's clock."""

    later_s: float
    set_point: SetPoint


def sample_escape(
    present: SetPoint,
    lasts_s: float | None,
    later: Callable[[float], SetPoint | None],
    period_s: float,
    floor_m: float,
) -> list[SetPointAhead]:
    """The present set-point, those of an escape to its end, and holds at its end.

    lasts_s: None where there is no escape. later: of an escape, by the time after now.
    """
    if lasts_s is None:
        return []
    step_s = max(period_s, lasts_s / (MOST_MOMENTS - HOLDS - 2))
    found, due_s = [SetPointAhead(0.0, present)], step_s
    while due_s < lasts_s + step_s and lasts_s > 0.0:
        point = later(min(due_s, lasts_s))
        if point is None:
            break
        found.append(SetPointAhead(due_s, point.above(floor_m, point.position_m)))
        due_s += step_s
    held, ended_s = found[-1].set_point.hold(), found[-1].later_s
    return found + [SetPointAhead(ended_s + n * step_s, held) for n in range(1, HOLDS + 1)]
