"""The wind that own states tell, and what is carried by it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ball_world import BallWorld
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import CALM, Situation
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.inputs.wind import LEAST_OF_SPEED, SURE, WindEstimate, line_through
from clearway.live.mission import Mission
from clearway.reach.drifted import drift_reach_set
from clearway.reach.store import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
from clearway.sim import SimulationSettings, simulate
from clearway.vehicle.automaton import MovementAutomaton

WINDS = st.tuples(*[st.floats(-0.6, 0.6)] * 3).map(np.array)


@pytest.fixture(scope="module")
def planner() -> Planner:
    automaton = MovementAutomaton.plane(speed_mps=1.0)
    library = ReachLibrary.load_or_build(automaton, AvoidanceGrid.uniform())
    return Planner.of(library, AvoidanceSettings())


def told_by(wind, seconds: int = 8, sigma_m: float = 0.0, seed: int = 0) -> WindEstimate:
    """An estimate after states a second apart, of a vehicle that flies straight on."""
    estimate, rng = WindEstimate(1.0), np.random.default_rng(seed)
    states = [
        State(
            time * (np.array([1.0, 0.0, 0.0]) + wind) + sigma_m * rng.normal(size=3),
            time_s=float(time),
            position_std_m=sigma_m,
        )
        for time in range(seconds + 1)
    ]
    for before, after in pairwise(states):
        estimate.take(before, after, before.position_m + np.array([1.0, 0.0, 0.0]))
    return estimate


@given(wind=WINDS)
def test_an_even_wind_is_told_exactly_and_hardly_any_is_none(wind):
    told = told_by(wind).wind_mps
    if np.linalg.norm(wind) > 0.031:
        np.testing.assert_allclose(told, wind, atol=1e-9)
    elif np.linalg.norm(wind) < 0.029:
        assert told is CALM


def test_noise_is_no_wind_and_a_wind_in_noise_is_told_as_well_as_it_says():
    for seed in range(40):
        assert told_by(np.zeros(3), 20, sigma_m=0.2, seed=seed).wind_mps is CALM
        estimate = told_by(np.array([0.3, -0.4, 0.0]), 20, sigma_m=0.05, seed=seed)
        off = estimate.wind_mps - [0.3, -0.4, 0.0]
        assert np.abs(off).max() < 4.0 * estimate.sigma_mps < 0.2


@given(sigma_m=st.floats(0.0, 0.2), share=st.floats(0.5, 1.5), seed=st.integers(0, 99))
def test_what_no_step_shows_the_line_through_all_of_them_does_not_either(sigma_m, share, seed):
    estimate = told_by(np.array([0.03 * share, 0.0, 0.0]), 12, sigma_m=sigma_m, seed=seed)
    slope, sigma_mps = line_through(estimate.steps)
    counts = np.linalg.norm(slope) > max(SURE * sigma_mps, LEAST_OF_SPEED)
    assert estimate.wind_mps.tolist() == (slope.tolist() if counts else [0.0] * 3)
    assert estimate.sigma_mps == sigma_mps


def test_what_was_told_before_take_off_counts_until_own_states_say_more():
    estimate = WindEstimate(1.0, (0.0, 0.5, 0.0))
    here = State([0.0, 0.0, 0.0])
    assert estimate.wind_mps.tolist() == [0.0, 0.5, 0.0]
    for time in range(1, 6):
        after = State([float(time), 0.0, 0.0], time_s=float(time))
        estimate.take(here, after, here.position_m + np.array([1.0, 0.0, 0.0]))
        here = after
    assert estimate.wind_mps is CALM
    with pytest.raises(ClearwayError, match="wind_mps: must be three finite numbers"):
        WindEstimate(1.0, (0.0, np.nan, 0.0))


@given(wind=WINDS)
def test_places_of_a_carried_reach_set_move_on_with_their_time(planner, wind):
    at_rest = planner.prepare(0.0).reach_set
    carried = drift_reach_set(at_rest, wind)
    np.testing.assert_allclose(
        carried.states[:, :3], at_rest.states[:, :3] + wind * at_rest.end_time_s[:, None]
    )
    first = at_rest.parent < 0
    share = (np.arange(4) + 1) / 4
    by_wind = at_rest.end_time_s[first][:, None, None] * share[:, None] * wind
    np.testing.assert_allclose(carried.samples_m[first], at_rest.samples_m[first] + by_wind)


def test_without_wind_the_cells_looked_up_anew_are_those_of_the_set(planner):
    at_rest = planner.prepare(0.0).reach_set
    carried = drift_reach_set(at_rest, np.zeros(3))
    kept = 0
    for n in range(at_rest.nodes):
        was = set(at_rest.cell_index[at_rest.cell_start[n] : at_rest.cell_start[n + 1]].tolist())
        now = set(carried.cell_index[carried.cell_start[n] : carried.cell_start[n + 1]].tolist())
        kept += was == now
    assert kept >= 0.95 * at_rest.nodes  # All but corners cut between two places looked up.


def test_a_plan_is_carried_by_the_wind_that_it_was_decided_with(planner):
    wind = np.array([0.1, 0.4, 0.0])
    situation = Situation(State(np.zeros(3)), np.array([30.0, 0.0, 0.0]), wind_mps=wind)
    windy = decide(planner, situation)
    assert windy.wind_mps is situation.wind_mps
    first = windy.prepared.reach_set.path(windy.choice.node)[0]
    end = windy.prepared.reach_set.states[first]
    calm = planner.prepare(0.0).reach_set
    same = np.flatnonzero((calm.parent < 0) & (calm.movement == calm.movement[first]))[0]
    np.testing.assert_allclose(end[:3], calm.states[same, :3] + wind)


@pytest.mark.parametrize(
    ("wind", "escape"),
    [
        pytest.param((0.0, 0.5, 0.0), "strict", marks=pytest.mark.nightly),
        ((-0.4, -0.3, 0.0), "off"),
        pytest.param((-0.4, -0.3, 0.0), "strict", marks=pytest.mark.nightly),
    ],
)
def test_in_half_the_airspeed_of_wind_the_margin_is_kept(planner, wind, escape):
    """Against the wind a way out takes so much room that strict flight keeps the margin, but does
    not get past two balls in time."""
    planner = planner.with_values(escape=escape)
    balls = BallWorld.of(((9.0, 0.4, 0.0), 1.5), ((18.0, -1.0, 0.5), 1.5))
    mission = Mission("windy", State(np.zeros(3)), waypoints_m=np.array([[26.0, 0.0, 0.0]]))
    lidar = Lidar("lidar", BeamPattern.per_cell(planner.grid, max_range_m=10.0))
    system = AvoidanceSystem(planner, mission, lidars=[lidar])
    run = simulate(system, balls, lidars=[lidar], settings=SimulationSettings(wind_mps=wind))
    assert run.reached or (escape == "strict" and wind[0] < 0.0)
    assert run.crashed_s is None
    assert run.metrics.margin_violations == 0
    np.testing.assert_allclose(run.decisions[-1].flight.decision.wind_mps, wind, atol=1e-6)
    assert not any("jumped" in reason for reason in run.counts)


LONG_S = 4.0


@pytest.fixture(scope="module")
def slow_planner() -> Planner:
    """Of a plane whose movements take four seconds: its own states come as far apart."""
    automaton = MovementAutomaton.plane(speed_mps=10.0, duration_s=LONG_S)
    library = ReachLibrary.load_or_build(automaton, AvoidanceGrid.uniform(range_m=400.0))
    return Planner.of(library, AvoidanceSettings(escape="off", safety_margin_m=10.0))


@pytest.mark.parametrize("share", [0.2, 0.5])
@pytest.mark.parametrize("course", [0.0, 2.0, 4.0])
def test_wind_that_nobody_told_is_known_at_the_third_decision(slow_planner, course, share):
    """Also where it carries the vehicle farther than the margin between two own states."""
    wind = share * 10.0 * np.array([np.cos(course), np.sin(course), 0.0])
    mission = Mission("windy", State(np.zeros(3)), waypoints_m=np.array([[900.0, 0.0, 0.0]]))
    system = AvoidanceSystem(slow_planner, mission)
    settings = SimulationSettings(wind_mps=tuple(wind), time_limit_s=6.0 * LONG_S)
    run = simulate(system, BallWorld.of(((0.0, 500.0, 0.0), 1.0)), lidars=[], settings=settings)
    winds = [entry.flight.decision.wind_mps for entry in run.decisions]
    assert not winds[0].any()
    for known in winds[3:]:
        np.testing.assert_allclose(known, wind, atol=1e-6)


def test_one_leap_is_no_wind() -> None:
    estimate, place = WindEstimate(10.0), np.zeros(3)
    for number in range(8):
        before = State(place, time_s=LONG_S * number)
        flown = place + np.array([10.0 * LONG_S, 0.0, 0.0])
        place = flown + np.array([0.0, 30.0 if number == 2 else 0.0, 0.0])
        after = State(place, time_s=LONG_S * (number + 1))
        estimate.take(before, after, flown, jumped=number == 2)
        assert not estimate.wind_mps.any()
