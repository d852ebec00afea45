"""Set-points, whatever the link makes of them: follow a plan, or hold a place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.base.frames import FloatArray, world_from_body
from clearway.base.state import State

SINKING_MPS2 = 0.5
"""By which sinking is stopped above the floor: half of what ArduCopter brakes by."""
SINKS_AHEAD_S = 0.5
"""How far below the vehicle a place near the floor is, at the fastest that it may sink there."""


@dataclass(frozen=True, slots=True, eq=False)
class SetPoint:
    """Where to be, how fast, and where to point; world frame, z up."""

    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray | None
    """[3] None holds the place."""
    yaw_rad: float
    """Left positive from x."""

    @classmethod
    def following(cls, state: State, speed_mps: float, climb_mps: float = 0.0) -> SetPoint:
        """On a plan that has the vehicle in a state.

        climb_mps: beside the speed along the nose, of what climbs without pitching.
        """
        velocity = speed_mps * world_from_body(np.ascontiguousarray(state.attitude_rad))[:, 0]
        velocity[2] += climb_mps
        return cls(state.position_m, velocity, float(state.attitude_rad[2]))

    @classmethod
    def holding(cls, place_m: FloatArray, yaw_rad: float) -> SetPoint:
        return cls(place_m, None, yaw_rad)

    def held(self) -> SetPoint:
        """The same place, to stay at."""
        return replace(self, velocity_mps=None)

    def led_by_at_most(self, own_m: FloatArray, lead_m: float) -> SetPoint:
        """No farther ahead of the vehicle than that: autopilots chase what is far away, fast."""
        ahead = self.position_m - own_m
        apart = float(np.linalg.norm(ahead))
        if apart <= lead_m:
            return self
        return replace(self, position_m=own_m + ahead * (lead_m / apart))

    def above(self, floor_m: float, own_m: FloatArray) -> SetPoint:
        """No lower than a height, and on the way down there no faster than can be stopped.

        own_m: [3] where the vehicle is.
        """
        room_m = max(0.0, float(min(self.position_m[2], own_m[2])) - floor_m)
        fastest = float(np.sqrt(2.0 * SINKING_MPS2 * room_m))
        lowest_m = max(floor_m, float(own_m[2]) - fastest * SINKS_AHEAD_S)
        place, velocity = self.position_m, self.velocity_mps
        if place[2] < lowest_m and (velocity is not None or place[2] < floor_m):
            place = np.array([*place[:2], lowest_m])
        if velocity is not None and velocity[2] < -fastest:
            velocity = np.array([*velocity[:2], -fastest])
        return replace(self, position_m=place, velocity_mps=velocity)
