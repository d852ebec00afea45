"""PX4's estimate of its own state: into own motion, and whether it may be trusted.

PX4's local frame is north, east, down (`ned`), its body ahead, right, down (`frd`); the world here
is east, north, up, and the body ahead, left, up.
"""

from __future__ import annotations

from collections import Counter
from typing import Any, Final

import numpy as np

from clearway.base.frames import FloatArray, attitude_from_rotation, enu_from_geodetic, enu_from_ned
from clearway.io.poses.pose_track import convert_quaternion
from clearway.io.poses.ulog import ENU_FROM_NED, FRD_FROM_FLU
from clearway.live.link.own_motion import OwnMotion

NED = 1
BODY_FRD = 3
"""VehicleOdometry's POSE_FRAME_NED, VELOCITY_FRAME_NED and VELOCITY_FRAME_BODY_FRD."""
FARTHEST_M = 1e6
FASTEST_MPS = 1e4
SAMPLED_S: Final = 0.5
"""A state was sampled at most so long before it was reported."""
MOVED_M: Final = 0.1
"""The origin of the local frame is reported in float32: what moves it by less is rounding."""
VALID = {
    "xy_valid": "position", "z_valid": "height", "v_xy_valid": "velocity",
    "v_z_valid": "climb rate", "heading_good_for_control": "heading",
}  # fmt: skip
COUNTERS = ("xy_reset_counter", "z_reset_counter", "heading_reset_counter")
NO_POSE = "own position: no pose in north, east, down"
NO_ORIGIN = "own position: no origin of the local frame yet; the mission has origin_geodetic"


class Px4OwnState:
    """Feed it with both messages; `flaw` says why the estimate may not be flown by now.

    mission_origin: [3] of the world on Earth; None takes PX4's local frame for it.
    """

    def __init__(self, mission_origin: FloatArray | None, counts: Counter[str]) -> None:
        self.flaw = "PX4 has not told its local position yet"
        self.resets = 0
        """How often the estimate has jumped."""
        self.why_reset = ""
        self._counts, self._mission_origin = counts, mission_origin
        self._counters: dict[str, int] = {}
        self.world_from_local_m: FloatArray | None = np.zeros(3) if mission_origin is None else None
        """[3] PX4's origin in the world; None until it is known."""

    def take_local(self, message: Any) -> None:
        """VehicleLocalPosition: what is valid, what was reset, and where the frame lies."""
        wrong = [what for field, what in VALID.items() if not getattr(message, field)]
        self.flaw = f"PX4's {', '.join(wrong)} is not valid" if wrong else ""
        for counter in COUNTERS:
            self._count(counter, int(getattr(message, counter)))
        if self._mission_origin is None:
            return
        told = [float(message.ref_lat), float(message.ref_lon), float(message.ref_alt)]
        if message.xy_global and message.z_global and np.all(np.isfinite(told)):
            there, before = enu_from_geodetic(told, self._mission_origin), self.world_from_local_m
            if before is None or float(np.linalg.norm(there - before)) > MOVED_M:
                self.world_from_local_m = there
                if before is not None:
                    self._note_reset("the origin of its local frame")

    def take_odometry(self, message: Any, *, with_attitude: bool) -> OwnMotion | None:
        """VehicleOdometry as own motion; None, and counted, where nothing can be made of it.

        with_attitude: of the body, for sensors that are fixed to it; else how far it is tilted.
        """
        self._count("reset_counter", int(message.reset_counter))
        place_ned, turn = np.array(message.position, float), np.array(message.q, float)
        velocity = np.array(message.velocity, float)
        usable = message.pose_frame == NED and message.velocity_frame in (NED, BODY_FRD)
        usable = usable and bool(np.all(np.abs(place_ned) <= FARTHEST_M))
        usable = usable and bool(np.all(np.abs(velocity) <= FASTEST_MPS))
        size = float(np.sqrt((turn**2).sum()))
        if not (usable and 0.5 < size < 2.0):
            self._counts[NO_POSE] += 1
            return None
        if self.world_from_local_m is None:
            self._counts[NO_ORIGIN] += 1
            return None
        ned_from_frd = convert_quaternion(turn / size)
        if message.velocity_frame == BODY_FRD:
            velocity = ned_from_frd @ velocity
        world_from_body = ENU_FROM_NED @ ned_from_frd @ FRD_FROM_FLU
        attitude = attitude_from_rotation(world_from_body)
        return OwnMotion(
            _find_sampling_s(message),
            enu_from_ned(place_ned) + self.world_from_local_m,
            enu_from_ned(velocity),
            float(attitude[2]),
            _deviation(message.position_variance),
            _deviation(message.orientation_variance) if with_attitude else 0.0,
            attitude if with_attitude else None,
            tilt_rad=float(np.arccos(np.clip(world_from_body[2, 2], -1.0, 1.0))),
        )

    def _count(self, counter: str, value: int) -> None:
        before = self._counters.get(counter)
        self._counters[counter] = value
        if before is not None and before != value:
            self._note_reset(counter.removesuffix("_counter").replace("_", " "))

    def _note_reset(self, what: str) -> None:
        self.resets += 1
        self.why_reset = f"PX4's estimator has jumped ({what})"


def _find_sampling_s(message: Any) -> float:
    told_s, sampled_s = 1e-6 * int(message.timestamp), 1e-6 * int(message.timestamp_sample)
    return sampled_s if 0.0 <= told_s - sampled_s <= SAMPLED_S else told_s


def _deviation(variances: Any) -> float:
    """Of the worst axis; 0 where it is not reported."""
    told = np.asarray(variances, dtype=np.float64)
    return float(np.sqrt(np.where((told >= 0.0) & (told < FARTHEST_M), told, 0.0).max()))
