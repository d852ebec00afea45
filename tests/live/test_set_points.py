"""Set-points for vehicles that take velocities alone, their lead, and who crosses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live.guard.aircraft_ahead import LOOKS_S, AircraftAhead
from clearway.live.inputs.tracking import HEADROOM, WINDOW_S, Tracking
from clearway.live.link.lead import EARLIEST_S, LeadTime, OwnSpeed
from clearway.live.link.set_point import SetPoint
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.reference import Reference

COPTER = MovementAutomaton.multirotor(speed_mps=5.0)


def test_a_velocity_is_drawn_to_the_place_and_turns_the_nose() -> None:
    point = SetPoint(np.array([3.0, 1.0, 0.0]), np.array([2.0, 0.0, 0.0]), 0.5, yaw_rate_rps=0.2)
    velocity, rate = point.as_velocity(np.array([3.0, 0.0, 0.0]), 0.0, 5.0)
    assert velocity == pytest.approx([2.0, 1.0, 0.0])
    assert rate > 0.2
    far, _ = point.as_velocity(np.array([-90.0, 0.0, 0.0]), 0.0, 5.0)
    assert np.linalg.norm(far - point.velocity_mps) == pytest.approx(0.3 * 5.0)
    # The last message may be flown on: to hold is to stand still.
    standing, turning = point.hold().as_velocity(np.zeros(3), 0.0, 5.0)
    assert not standing.any()
    assert turning == 0.0


def late_by(seconds: float, after_s: float) -> float:
    """What is learned of a vehicle that is late along its way by as much as it is told late."""
    lead, time_s = LeadTime(0.0), 0.0
    while time_s < after_s:
        time_s += 0.05
        asked = Reference(
            np.array([4.0 * time_s, 0.0, 0.0]), np.array([4.0, 0.0, 0.0]), np.zeros(3), 0.0, 0.0
        )
        own = asked.position_m - [4.0 * (seconds - lead.seconds), 0.0, 0.0]
        lead.take(time_s, own, asked)
    return lead.seconds


def test_a_vehicle_that_is_late_is_told_earlier() -> None:
    assert late_by(0.2, 40.0) == pytest.approx(0.2, abs=0.01)
    assert late_by(3.0, 40.0) == EARLIEST_S
    assert 0.0 < late_by(0.2, 1.0) < 0.1  # Not at once: it takes time to answer.


def test_what_was_seen_outside_the_tube_counts_for_a_while() -> None:
    tracking = Tracking()
    assert tracking.excess_m(0.0) == 0.0
    for time_s, beyond_m in ((1.0, 0.2), (2.0, 0.5), (3.0, 0.1)):
        tracking.take(time_s, beyond_m)
    assert tracking.excess_m(3.0) == pytest.approx(HEADROOM * 0.5)
    assert tracking.excess_m(2.5 + WINDOW_S) == pytest.approx(HEADROOM * 0.1)
    assert tracking.excess_m(4.0 + WINDOW_S) == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_the_velocity_that_takes_a_wishs_place_keeps_clear_until_all_have_passed(seed: int) -> None:
    """Held against small steps of both, the own velocity changing at its acceleration."""
    rng = np.random.default_rng([seed, 41])
    bearing = rng.uniform(-np.pi, np.pi)
    velocity = rng.uniform(5.0, 25.0) * np.array([np.cos(bearing), np.sin(bearing), 0.0])
    own, wished = np.array([*rng.uniform(-4.0, 4.0, 2), 0.0]), np.array([4.0, 0.0, 0.0])
    meets_s = rng.uniform(6.0, 13.0)
    other = Intruder(wished * meets_s - velocity * meets_s, velocity, radius_m=2.0, name="a")
    ahead = AircraftAhead(np.zeros(3), own, [other], 5.0, 3.0, 3.0)
    found = ahead.nearest_clear(wished, COPTER)
    # Some own velocities put the wish beside the meeting place: then it stays.
    assert least_m(own, wished if found is None else found, other) >= 7.0
    higher_m = other.position_m + np.array([0.0, 0.0, 60.0])
    harmless = Intruder(higher_m, velocity, radius_m=2.0, name="b")
    alone = AircraftAhead(np.zeros(3), own, [harmless], 5.0, 3.0, 3.0)
    assert alone.nearest_clear(wished, COPTER) is None


def least_m(own: np.ndarray, asked: np.ndarray, other: Intruder) -> float:
    place, velocity, least, step_s = np.zeros(3), own.copy(), np.inf, 0.01
    for n in range(round(LOOKS_S / step_s)):
        change = asked - velocity
        size = float(np.linalg.norm(change))
        velocity = velocity + change * min(1.0, 3.0 * step_s / max(size, 1e-12))
        place = place + step_s * velocity
        there = other.position_m + (n + 1) * step_s * other.velocity_mps
        least = min(least, float(np.linalg.norm(there - place)))
    return least


@pytest.mark.parametrize("flown_mps", [1.5, 3.0, 3.4])
def test_a_place_ahead_is_where_a_vehicle_at_its_own_speed_is_when_it_counts(
    flown_mps: float,
) -> None:
    own = State(np.array([2.0, 1.0, 7.0]), time_s=5.0)
    along = np.array([1.0, 0.0, 0.0])
    asked = SetPoint(own.position_m + 9.0 * along, 3.0 * along, 0.0, 2.0 * along)
    limited = OwnSpeed(3.0).limit(asked, own, flown_mps * along, 5.05)
    ahead_m = limited.position_m - own.position_m
    assert limited.acceleration_mps2 is not None
    if flown_mps < 3.0:
        assert 0.4 * 3.0 < ahead_m[0] < 0.5 * 3.0
        assert limited.acceleration_mps2 == pytest.approx(2.0 * along)
    else:
        assert ahead_m == pytest.approx(0.05 * 3.0 * along)
        assert limited.acceleration_mps2 == pytest.approx(np.zeros(3))
    near = replace(asked, position_m=own.position_m - 0.1 * along)
    behind = OwnSpeed(3.0).limit(near, own, flown_mps * along, 5.05)
    assert behind.position_m == pytest.approx(near.position_m)  # As the plan asks.


def test_one_that_answers_late_and_stays_slower_is_led_farther_ahead() -> None:
    speed, along = OwnSpeed(3.0), np.array([1.0, 0.0, 0.0])
    leads = []
    for tick, flown_mps in enumerate([2.7] * 60 + [3.3] * 60):
        own = State(np.zeros(3), time_s=0.1 * tick)
        asked = SetPoint(9.0 * along, 3.0 * along, 0.0)
        limited = speed.limit(asked, own, flown_mps * along, own.time_s + 0.05)
        leads.append(float(limited.position_m[0]))
    slow, fast = leads[:60], leads[60:]
    assert np.diff(slow).min() > -1e-9
    assert slow[-1] - slow[0] > 0.1 * 3.0
    assert max(leads) <= 0.45 * 3.0 + 1e-9
    assert np.diff(fast).max() < 1e-9
    assert fast[-1] == pytest.approx(0.05 * 3.0)


def test_a_place_to_hold_draws_no_faster_than_the_own_speed() -> None:
    own, far = State(np.zeros(3)), np.array([0.0, 4.0, 0.0])
    limited = OwnSpeed(1.0).limit(SetPoint.holding(far, 0.0), own, np.zeros(3), 0.05)
    assert limited.velocity_mps is None
    assert limited.position_m == pytest.approx(0.25 * far)
