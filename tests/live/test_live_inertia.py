"""A copter with inertia, asked at any time: its plan has no steps and bends to what is measured."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.inputs.own_states import Flown
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.reference import Reference

AUTOMATON = MovementAutomaton.multirotor(speed_mps=5.0)
START = np.array([0.0, 0.0, 10.0])
PERIOD_S = 0.1
MASTS = ObstacleMap(
    [Obstacle.line_between([x, y, 0.0], [x, y, 30.0], radius_m=0.2) for x, y in ((15, 1), (28, -1))]
)


@cache
def planner() -> Planner:
    library = ReachLibrary.load_or_build(AUTOMATON, AvoidanceGrid.uniform(range_m=20.0))
    return Planner.of(library, AvoidanceSettings(safety_margin_m=0.6))


def system_among_masts(goal_m: float = 45.0) -> AvoidanceSystem:
    goal = np.array([[goal_m, 0.0, 10.0]])
    mission = Mission("masts", State(START), waypoints_m=goal)
    system = AvoidanceSystem(planner(), mission, obstacle_map=MASTS)
    system.ahead_s = 1.5 * PERIOD_S
    return system


def asked_of(system: AvoidanceSystem, time_s: float) -> Reference:
    asked = system.reference_at(time_s)
    assert asked is not None
    return asked


class Follower:
    """A vehicle that tells its own states at a rate, and goes where it is asked to be, or lags."""

    def __init__(self, lag_s: float = 0.0) -> None:
        self.system, self.lag_s, self.time_s = system_among_masts(), lag_s, 0.0
        self.position_m, self.velocity_mps, self.yaw_rad = START, np.zeros(3), 0.0
        self.whys: list[str] = []
        self.margins_m: list[float] = []
        self.track: list[FloatArray] = []

    def fly(self, until_s: float) -> Iterator[Reference]:
        """What is asked at every hundredth of a second."""
        while self.time_s < until_s and not self.system.progress.is_done(self.system.mission):
            attitude = np.array([0.0, 0.0, self.yaw_rad])
            own = State(
                self.position_m, attitude, time_s=self.time_s, velocity_mps=self.velocity_mps
            )
            self.system.update(own)
            why = self.system.due(self.time_s)
            if why is not None:
                self.whys.append(why)
                decision = self.system.decide(self.time_s).decision
                self.margins_m.append(decision.margin_m)
            for _ in range(10):
                self.time_s += PERIOD_S / 10
                yield self._go()

    def _go(self) -> Reference:
        asked, step_s = asked_of(self.system, self.time_s), PERIOD_S / 10
        self.yaw_rad = asked.yaw_rad
        if self.lag_s:
            wished = asked.velocity_mps + 1.5 * (asked.position_m - self.position_m)
            share = 1.0 - np.exp(-step_s / self.lag_s)
            self.velocity_mps = self.velocity_mps + share * (wished - self.velocity_mps)
            self.position_m = self.position_m + step_s * self.velocity_mps
        else:
            self.position_m, self.velocity_mps = asked.position_m, asked.velocity_mps
        self.track.append(self.position_m)
        return asked


def test_what_is_asked_has_no_steps_in_place_or_velocity() -> None:
    """Decisions come at any time, and are taken for the end of the movement under way."""
    flight = Follower()
    asked = list(flight.fly(30.0))
    assert flight.system.progress.is_done(flight.system.mission)
    assert MASTS.distance_m(np.array(flight.track)).min() > 0.6
    velocity = np.array([each.velocity_mps for each in asked])
    steps = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
    # Nowhere more than the acceleration: 3 m/s2, and that of climbs beside it.
    assert steps.max() < 1.5 * 3.0 * PERIOD_S / 10
    place = np.array([each.position_m for each in asked])
    middle = 0.5 * (velocity[1:] + velocity[:-1]) * PERIOD_S / 10
    assert np.abs(np.diff(place, axis=0) - middle).max() < 1e-3
    assert velocity.max() > 4.0


def test_own_states_are_carried_exactly_in_the_middle_of_a_movement() -> None:
    flown = Flown(AUTOMATON, 10.0)
    names = ("Accelerate", "Accelerate-Left", "Keep-Right-Up", "Brake-Half-Left")
    flown.then(MovementBuffer.of(AUTOMATON.chain(names), 2.0), 0)
    ways, state, begins_s = [], np.array([5.0, 1.0, 10.0, 0.0, 0.0, 0.4]), 2.0
    for movement in AUTOMATON.chain(names):
        assert AUTOMATON.is_allowed(state, movement)
        ways.append((begins_s, state, movement))
        state, begins_s = AUTOMATON.predict(state, movement), begins_s + movement.duration_s

    def there(time_s: float) -> Reference:
        begins, at, movement = [way for way in ways if way[0] <= time_s + 1e-9][-1]
        return Reference.of(AUTOMATON, at, movement, time_s - begins)

    rng = np.random.default_rng(3)
    for _ in range(30):
        first_s, last_s = np.sort(rng.uniform(2.0, begins_s, 2)).tolist()
        first, last = there(first_s), there(last_s)
        own = State(first.position_m, [0.0, 0.0, first.yaw_rad], time_s=first_s)
        carried = flown.carry(own, last_s)
        # Kept positions lie on the way, chords between them 5 mm off it.
        np.testing.assert_allclose(carried.position_m, last.position_m, atol=0.01)
        assert carried.attitude_rad[2] == pytest.approx(last.yaw_rad, abs=1e-6)
        motion = flown.motion_at(last_s)
        assert motion is not None
        level = float(np.hypot(*last.velocity_mps[:2]))
        assert motion == pytest.approx((level, last.velocity_mps[2]), abs=1e-4)


def test_beyond_the_tube_it_begins_anew_at_what_is_measured() -> None:
    """At the place, course and class that are measured, with a wider margin, and it is said."""
    flight = Follower()
    for _ in flight.fly(3.0):
        pass
    system, now_s = flight.system, flight.time_s
    before_m = flight.margins_m[-1]
    off = flight.position_m + np.array([0.0, 2.0, 0.0])
    system.update(State(off, np.zeros(3), time_s=now_s, velocity_mps=np.array([1.6, 1.2, 0.0])))
    why = system.due(now_s)
    assert why is not None
    assert "outside the tube" in why
    assert "margin grows by" in why
    decision = system.decide(now_s).decision
    np.testing.assert_allclose(decision.state.position_m, off)
    assert decision.state.attitude_rad[2] == pytest.approx(np.arctan2(1.2, 1.6))
    classes = AUTOMATON.classes
    assert classes is not None
    at = classes.class_at(float(decision.state.attitude_rad[0]))
    assert classes.speed_mps[at] == pytest.approx(2.0, abs=0.5 * np.diff(classes.speed_mps).max())
    assert decision.margin_m > before_m + 1.5
    assert system.counts["state: outside the tube of its plan"] >= 1


def test_where_others_fly_it_decides_from_what_is_measured() -> None:
    system = system_among_masts()
    system.followed = False
    for now_s in (0.0, 0.5, 1.0):
        place, velocity = np.array([0.0, 4.0 * now_s, 10.0]), np.array([0.0, 4.0, 0.0])
        system.update(State(place, np.zeros(3), time_s=now_s, velocity_mps=velocity))
        state = system.decide(now_s).decision.state
        np.testing.assert_allclose(state.position_m, place)
        assert state.attitude_rad[2] == pytest.approx(np.pi / 2)


def test_a_vehicle_that_lags_gets_a_wider_margin_and_touches_nothing() -> None:
    exact, lagging = Follower(), Follower(lag_s=0.5)
    for flight in (exact, lagging):
        for _ in flight.fly(60.0):
            pass
        assert flight.system.progress.is_done(flight.system.mission)
        assert MASTS.distance_m(np.array(flight.track)).min() > 0.3
    assert max(exact.margins_m) == pytest.approx(0.6)
    assert max(lagging.margins_m) > 0.7
    assert lagging.system.counts["state: outside the tube of its plan"] > 0
    assert exact.system.counts["state: outside the tube of its plan"] == 0
