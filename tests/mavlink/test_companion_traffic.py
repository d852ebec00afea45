"""Aircraft past which a companion computer leads, told as real autopilots tell of them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from clearway.live.link.aircraft import AircraftReport
from clearway.mavlink.simulated_habits import Habits
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from clearway.sim.scripted import ScriptedIntruder
from companion_missions import mission
from mavlink_for_tests import Bench, attitude, distances, heartbeat, origin, position
from simulated_flight import SimulatedFlight

MARGIN_M, RADIUS_M = 5.0, 6.0
"""11 m between centres are asked for."""


def crossing(high: Any, habits: Habits, seed: int = 0) -> SimulatedFlight:
    """One aircraft at 20 m/s, 13 s before it would hit."""
    file, setup = high
    r = np.random.default_rng(seed)
    angle = r.uniform(-2.2, -0.9) * r.choice([-1.0, 1.0])
    velocity = 20.0 * np.array([math.cos(angle), math.sin(angle), 0.0])
    meets = np.array([3.0 * 14.0 + r.uniform(-3.0, 3.0), 0.0, 40.0])
    who = ScriptedIntruder("FAST", 1.0, meets - 13.0 * velocity, velocity, radius_m=RADIUS_M,
                           spawn="world")  # fmt: skip
    flight = SimulatedFlight(file, replace(setup, script=(who,)), habits)
    flight.run(30.0)
    return flight


@pytest.fixture(scope="module")
def high() -> tuple[MissionFile, FlightSetup]:
    return mission(
        mission={"name": "high", "waypoints_m": [[120, 0, 40]], "reach_radius_m": 4},
        vehicle={"position_m": [0, 0, 40], "speed_mps": 3.0},
    )


def changes_of_side(flight: SimulatedFlight) -> int:
    sides = [o.flight.decision.passings[0].aside for o in flight.outcomes
             if o.flight is not None and o.flight.decision.passings]  # fmt: skip
    return sum(float(one @ next_) < 0.999 for one, next_ in pairwise(sides))


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2, 3))]
)
def test_an_aircraft_whose_age_jitters_is_passed_on_one_side(high: Any, seed: int) -> None:
    flight = crossing(high, Habits(traffic_late_s=1.0, acceleration_mps2=3.0, seed=seed), seed)
    assert flight.autopilot.nearest_intruder_m >= MARGIN_M
    assert changes_of_side(flight) <= 1


@pytest.mark.nightly
def test_a_hundred_aircraft_whose_ages_jitter(high: Any) -> None:
    for seed in range(100):
        flight = crossing(high, Habits(traffic_late_s=1.0, acceleration_mps2=3.0, seed=seed), seed)
        assert flight.autopilot.nearest_intruder_m >= MARGIN_M, seed
        assert changes_of_side(flight) <= 1, seed


def test_old_positions_told_again_keep_their_time(high: Any) -> None:
    habits = Habits(traffic_every_s=3.0, acceleration_mps2=3.0)
    flight = crossing(high, habits, 1)
    assert flight.counts["traffic: an old position again"] >= 4
    assert flight.autopilot.nearest_intruder_m >= MARGIN_M


def test_an_aircraft_heard_no_more_flies_on_where_it_was_last(high: Any) -> None:
    habits = Habits(lost_from_s=6.0, acceleration_mps2=3.0)
    flight = crossing(high, habits, 2)
    assert flight.counts["traffic: an old position again"] >= 4
    assert flight.autopilot.nearest_intruder_m >= MARGIN_M


@pytest.mark.parametrize("velocity", ["told", "jumps too"])
def test_a_transponder_that_jumps_20_times_a_second_makes_no_emergencies(velocity: str) -> None:
    bench, rng = Bench(waypoints=((200.0, 0.0, 0.0),)), np.random.default_rng(0)
    modes: set[str] = set()
    for tick in range(150):
        time_s = 1.0 + 0.1 * tick
        where = position(time_s, (0, 0.1 * tick, 0))
        bench.tell(1000.0 + time_s, heartbeat(), origin(), attitude(time_s), where)
        bench.tell(1000.0 + time_s, distances(time_s))
        for number in range(2):
            place = np.array([0.1 * tick, 300.0, 0.0]) + 1000.0 * rng.normal(size=3) * (1, 1, 0.02)
            speeds = 60.0 * rng.normal(size=3) * (1, 1, 0.02)
            told = np.array([0.0, -30.0, 0.0]) if velocity == "told" else speeds
            report = AircraftReport(0xABC123, place, told, 3.0, 0.0, (tick, number))
            bench.session.core.hear_aircraft(report, 1000.0 + time_s + 0.05 * number)
        outcome = bench.session.tick(1000.0 + time_s)
        if outcome.flight is not None:
            modes.add(str(outcome.flight.mode))
    assert "emergency" not in modes
    assert bench.session.core.left_out["intruder: implausible jump"] > 30
