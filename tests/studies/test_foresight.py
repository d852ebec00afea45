"""What could be avoided at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.studies.risk.encounter import ModelEncounter
from clearway.studies.risk.foresight import foreseen
from clearway.studies.risk.settings import RiskSettings

KIND = RiskSettings.real_scale("copter", "perfect", 4000.0)


def head_on(range_m: float, speed_mps: float = 60.0, height_m: float = 0.0) -> ModelEncounter:
    time = np.arange(0.0, 120.0, 0.25)
    velocity = np.array([-speed_mps, 0.0, 0.0])
    path = np.array([range_m, 0.0, height_m]) + time[:, None] * velocity
    return ModelEncounter(0, 1.0, time, path, np.tile(velocity, (len(time), 1)), 80.0, 0, 500.0)


def test_what_is_heard_of_in_time_is_avoided() -> None:
    """Climbing 250 ft at 2.5 m/s takes 31 s and the onsets; going aside is not faster."""
    found = foreseen(head_on(5000.0), KIND)
    assert found.well_clear
    assert found.near_collision
    assert found.heard_s == pytest.approx(1000.0 / 75.0, abs=2.0)


def test_what_is_heard_of_too_late_is_not() -> None:
    for range_m in (500.0, 1000.0, 1400.0):
        assert not foreseen(head_on(5000.0), replace(KIND, range_m=range_m)).well_clear
    # A near miss is 100 ft high: that takes seconds.
    assert foreseen(head_on(5000.0), replace(KIND, range_m=1400.0)).near_collision
    assert not foreseen(head_on(5000.0), replace(KIND, range_m=300.0)).near_collision


def test_who_is_never_heard_of_meets_whom_straight_flight_meets() -> None:
    deaf = replace(KIND, range_m=1.0)
    assert not foreseen(head_on(4000.0), deaf).well_clear
    assert foreseen(head_on(4000.0, height_m=100.0), deaf).well_clear
