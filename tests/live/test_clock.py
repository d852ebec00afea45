"""Clocks that jump, readings late, repeated or ahead: where the vehicle is thought to be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.plan.situation import margin_m
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.inputs.clock import LEAPT, LONGEST_SILENCE_S, SET_BACK, Clock
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Scan
from clearway.traffic import Intruder
from worlds_for_tests import LIDAR, mission, planner

PLANNER = planner()
TICK_S = 0.1
NO_RETURNS = np.zeros((0, 3))


class Flight:
    """A vehicle that flies what is decided, and a clock that may show anything."""

    def __init__(self, **system: object) -> None:
        there = mission((400.0, 0.0, 0.0))
        self.live = AvoidanceSystem(PLANNER, there, lidars=(LIDAR,), **system)  # type: ignore[arg-type]
        self.truth = np.zeros(6)
        self.shown_s = 100.0

    @property
    def state(self) -> State:
        return State(self.truth[:3], self.truth[3:], time_s=self.shown_s)

    def tick(self, *readings: object, silent: bool = False) -> None:
        """Tell the own state unless silent, and other readings; decide if due; fly on."""
        live = self.live
        if not silent:
            live.update(self.state)
        for reading in readings:
            live.update(reading)  # type: ignore[arg-type]
        if live.due(self.shown_s) is not None:
            live.decide(self.shown_s)
        movement = live.movement_at(self.shown_s)
        assert movement is not None
        automaton = PLANNER.automaton
        self.truth = automaton.fly(self.truth, [(movement, TICK_S)], np.inf, 0.0).states[-1]
        self.shown_s += TICK_S

    def fly(self, seconds: float, **more: bool) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.tick(**more)

    def off_m(self) -> float:
        """How far from the truth the vehicle is thought to be."""
        situation, _ = self.live.situation(self.shown_s)
        return float(np.linalg.norm(situation.state.position_m - self.truth[:3]))

    def covered_m(self) -> float:
        """By how much the margin is widened for it."""
        situation, _ = self.live.situation(self.shown_s)
        kept = margin_m(PLANNER.settings, situation)
        return kept - PLANNER.settings.safety_margin_m

    def said(self) -> str:
        return " ".join(self.live.counts)


@pytest.mark.parametrize("jump_s", [-95.0, -1.0, -0.3, 0.7, 20.0, 1e4])
def test_a_clock_that_is_set_is_told_and_known_again_with_the_next_true_state(jump_s):
    flight = Flight()
    flight.fly(4.0)
    flight.shown_s += jump_s
    before = flight.live.counts.copy()
    flight.live.catch_up(flight.shown_s)
    assert flight.off_m() <= flight.covered_m() + 1e-6, "until a state comes the margin is wider"
    assert flight.live.counts != before or flight.covered_m() > 0.3
    flight.tick()
    assert flight.off_m() < 1e-6
    flight.fly(2.0)
    assert flight.covered_m() < 0.02


def test_a_clock_set_back_is_said_and_no_plan_leads_into_a_ball():
    ball = Obstacle.ball([14.0, 0.0, 0.0], 1.5)
    flight = Flight(obstacle_map=ObstacleMap([ball]))
    flight.fly(4.0)
    flight.shown_s = 5.0
    told = flight.live.decide(flight.shown_s)
    assert told.counts[SET_BACK] == 1
    assert told.counts["state: stale"] == 1
    assert "clock jumped" in told.explanation
    assert told.time_s == told.state.time_s == 5.0
    assert flight.live.buffer.start_s == pytest.approx(5.0)
    nearest = np.inf
    for _ in range(250):
        flight.tick()
        nearest = min(nearest, float(np.linalg.norm(flight.truth[:3] - ball.position_m)) - 1.5)
    assert nearest >= PLANNER.settings.safety_margin_m


@pytest.mark.parametrize("apart_s", [0.0, 0.1])
def test_an_own_state_far_ahead_bears_itself_out_in_no_way(apart_s):
    flight = Flight()
    flight.fly(2.0)
    wrong = np.array([70.0, 9.0, 0.0])
    flight.tick(State(wrong, time_s=160.0), State(wrong, time_s=160.0 + apart_s))
    flight.fly(0.5)
    assert flight.off_m() < 1e-6
    assert flight.live.counts["state: from the future"] == 2
    assert not flight.live.counts["state: late or repeated"]


@pytest.mark.parametrize("ahead_s", [0.3, 4.9, 1e6])
def test_a_scan_or_a_report_ahead_of_the_clock_shuts_nothing_out(ahead_s):
    flight = Flight()
    flight.fly(1.0)
    now = flight.shown_s
    real = {"radius_m": 0.5, "name": "i"}
    flight.tick(
        Scan(NO_RETURNS, now + ahead_s, sensor="lidar"),
        Intruder([90.0, 0.0, 0.0], [1.0, 0.0, 0.0], time_s=now + ahead_s, **real),
    )
    flight.tick(
        Scan(NO_RETURNS, flight.shown_s, sensor="lidar"),
        Intruder([9.0, 3.0, 0.0], [-1.0, 0.0, 0.0], time_s=flight.shown_s, **real),
    )
    assert flight.live.counts["scan: from the future"] == 1
    assert flight.live.counts["intruder: from the future"] == 1
    situation, age_s = flight.live.situation(flight.shown_s)
    assert age_s == pytest.approx(TICK_S)
    (known,) = situation.intruders
    assert known.position_m[0] == 9.0


def test_a_reading_a_little_ahead_counts_when_its_time_has_come_and_is_unsure():
    flight = Flight()
    flight.fly(1.0)
    now = flight.shown_s
    flight.live.update(State([8.0, 0.0, 0.0], time_s=now + 0.2))
    assert flight.live.situation(now)[0].state.position_m[0] < 2.0
    situation, _ = flight.live.situation(now + 0.2)
    assert situation.state.position_m[0] == 8.0
    assert margin_m(PLANNER.settings, situation) >= 0.6 + 0.2


def test_readings_without_any_question_are_kept_bounded_and_in_order():
    live = AvoidanceSystem(PLANNER, mission((90.0, 0.0, 0.0)), lidars=(LIDAR,))
    for n in range(3000):
        live.update(State([0.001 * n, 0.0, 0.0], time_s=0.01 * n))
        if n % 10 == 0:
            live.update(Scan(NO_RETURNS, 0.01 * n, sensor="lidar"))
    assert len(live._known.waiting._readings) <= 600
    assert live.situation(29.99)[0].state.position_m[0] == pytest.approx(2.999)
    assert not live.counts


@given(
    steps_s=st.lists(
        st.one_of(st.floats(0.0, 2.0), st.floats(-1e5, 1e5), st.floats(-0.3, 0.0)), max_size=40
    )
)
def test_own_time_never_runs_back_and_never_leaps_far(steps_s):
    clock, told, before = Clock(1.5), 0.0, -np.inf
    for step in steps_s:
        told += step
        now, jumped = clock.ask(told)
        assert now >= before
        assert not np.isfinite(before) or now - before <= max(
            LONGEST_SILENCE_S, 2.0 * LONGEST_SILENCE_S
        )
        assert clock.to_stated(clock.own(told)) == pytest.approx(told, abs=1e-6)
        assert jumped in (None, SET_BACK, LEAPT)
        before = now


@settings(max_examples=4, deadline=None)
@given(data=st.data())
def test_the_margin_covers_what_late_repeated_and_shuffled_readings_and_jumps_do(data):
    assert_covered(data)


@pytest.mark.nightly
@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_the_margin_covers_at_length_what_readings_and_jumps_do(data):
    assert_covered(data)


def assert_covered(data):
    """The vehicle flies as decided; each own state comes late, twice, out of order, or not at all.

    The clock jumps twice, either way. A clock that is set forward by less than two ticks shows
    nothing of it, so jumps are zero or larger.
    """
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    jump = st.one_of(st.floats(-200.0, -0.13), st.floats(0.6, 200.0))
    jumps = {data.draw(st.integers(10, 30)): data.draw(jump), 45: data.draw(jump)}
    latest_s = data.draw(st.floats(0.0, 0.6))
    flight, under_way = Flight(), []
    flight.tick()
    for n in range(70):
        flight.shown_s += jumps.get(n, 0.0)
        if rng.random() < 0.8:
            for _ in range(1 + (rng.random() < 0.3)):
                under_way.append((n + rng.uniform(0.0, latest_s) / TICK_S, flight.state))
        arrived = [state for due, state in under_way if due <= n]
        under_way = [entry for entry in under_way if entry[0] > n]
        rng.shuffle(arrived)
        for state in arrived:
            flight.live.update(state)
        off, covered = flight.off_m(), flight.covered_m()
        stale = flight.live.counts["state: stale"]
        flight.live.situation(flight.shown_s)
        is_stale = flight.live.counts["state: stale"] > stale
        assert off <= covered + 1e-6 or is_stale, (n, off, covered)
        flight.tick(silent=True)
