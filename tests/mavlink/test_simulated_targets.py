"""What the simulated autopilot makes of set-points: places, holds and velocities."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.live.link.set_point import SetPoint
from clearway.mavlink.set_points import FOLLOW, HOLD
from clearway.mavlink.simulated_targets import VelocityTarget, target_of
from clearway.mavlink.simulated_vehicle import VehicleLimits, VehicleTruth
from clearway.mavlink.wishes import VELOCITY


def told(mask: int, frame: int = 1, velocity: Any = (1.0, 0.5, -0.2), rate: float = 0.3) -> Any:
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, frame, mask, 4.0, 5.0, -6.0, *velocity, 0.0, 0.0, 0.0, 0.0, rate
    )


def test_places_are_followed_and_held() -> None:
    follows, holds = target_of(told(FOLLOW), 0.0, 1.0), target_of(told(HOLD), 0.0, 1.0)
    assert isinstance(follows, SetPoint)
    assert follows.position_m == pytest.approx([5.0, 4.0, 7.0])
    assert follows.velocity_mps == pytest.approx([0.5, 1.0, 0.2])
    assert follows.yaw_rad == pytest.approx(math.pi / 2)
    assert isinstance(holds, SetPoint)
    assert holds.velocity_mps is None


@pytest.mark.parametrize(("frame", "east_north"), [(1, (0.5, 1.0)), (8, (0.5, 1.0))])
def test_velocities_are_those_of_the_world_or_of_the_body(
    frame: int, east_north: tuple[float, float]
) -> None:
    """With the nose in the north, ahead is north and right is east."""
    flies = target_of(told(VELOCITY, frame), math.pi / 2, 0.0)
    assert isinstance(flies, VelocityTarget)
    assert flies.velocity_mps == pytest.approx([*east_north, 0.2])
    assert flies.yaw_rate_rps == pytest.approx(-0.3)


def test_nothing_is_made_of_the_rest() -> None:
    assert target_of(told(VELOCITY, frame=5), 0.0, 0.0) is None
    assert target_of(told(HOLD | VELOCITY), 0.0, 0.0) is None


def test_a_velocity_is_flown_with_lag_and_no_faster_than_it_can() -> None:
    truth = VehicleTruth(np.zeros(3), np.zeros(3), 0.0)
    for _ in range(200):
        truth = truth.after(
            0.02, VelocityTarget(np.array([0.0, 9.0, 0.0]), 0.5), VehicleLimits(1.0)
        )
    assert truth.velocity_mps == pytest.approx([0.0, 1.3, 0.0], abs=1e-3)
    assert truth.yaw_rad == pytest.approx(2.0)
