"""What moves is kept clear of for as long as any trajectory is looked at, and after a stop."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from clearway.avoidance.choose.candidates import STANDING_IS_WANTED, Candidates, Commitment
from clearway.avoidance.choose.lasting import AHEAD, Lasting, lasting_among
from clearway.avoidance.clear.hazards import MovingHazards, nothing_moving
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.reach import ReachLibrary
from clearway.sensors.observed.free_space import FreeSpace
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import planner as plane_planner

AUTOMATON = MovementAutomaton.multirotor(speed_mps=4.0, acceleration_mps2=5.0)
MARGIN_M = 0.5
SPARE_M = 0.05
RESTS, MOVES = "rests", "moves"


@cache
def planner() -> Planner:
    library = ReachLibrary.load_or_build(AUTOMATON, AvoidanceGrid.uniform(range_m=20.0))
    return Planner.of(library, AvoidanceSettings(escape="mapped", safety_margin_m=MARGIN_M))


@cache
def prepared(begins: str) -> PreparedReachSet:
    classes = AUTOMATON.classes
    assert classes is not None
    at = classes.first if begins == RESTS else int(np.argmax(classes.speed_mps))
    return planner().prepared_sets[at][1]


def all_of(ready: PreparedReachSet) -> Candidates:
    nodes = np.arange(ready.reach_set.nodes)
    zero, no = np.zeros(len(nodes)), np.zeros(len(nodes), dtype=np.int64)
    return Candidates(nodes, zero, no, no == 0, zero, no)


def ball(place_m: FloatArray, velocity_mps: FloatArray, radius_m: float) -> MovingHazards:
    none = np.zeros(1)
    return MovingHazards(
        place_m[None], velocity_mps[None], np.array([radius_m]), none, none, np.ones(1)
    )


def lasting(begins: str, moving: MovingHazards) -> Lasting:
    ready = prepared(begins)
    found = lasting_among(all_of(ready), ready, moving, MARGIN_M)
    assert found is not None
    return found


def stopped_m(ready: PreparedReachSet, node: int) -> FloatArray:
    """[3] where braking at the full rate after a node ends, by arithmetic."""
    classes = AUTOMATON.classes
    assert classes is not None
    state = ready.reach_set.states[node]
    at = classes.class_at(float(state[3]))
    speed, flown = float(classes.speed_mps[at]), 0.0
    while speed > 1e-9:
        flown += 0.4 * (speed - min(speed, 2.0) / 2.0)
        speed -= min(speed, 2.0)
    ahead = np.array([np.cos(state[5]), np.sin(state[5]), 0.0])
    return np.asarray(state[:3] + flown * ahead)


@pytest.mark.parametrize("begins", [RESTS, MOVES])
@pytest.mark.parametrize("seed", range(5))
def test_nothing_comes_near_where_a_vehicle_stops(begins: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    meets_m, course = rng.uniform(-2.0, 4.0, 3) * [1.0, 1.0, 0.1], rng.uniform(-np.pi, np.pi)
    velocity = rng.uniform(1.0, 5.0) * np.array([np.cos(course), np.sin(course), 0.0])
    moving = ball(meets_m - rng.uniform(1.0, 4.0) * velocity, velocity, rng.uniform(0.3, 1.0))
    ready, found = prepared(begins), lasting(begins, moving)
    stops = set(found.stops.nodes.tolist())
    assert 0 < len(stops) < ready.reach_set.nodes
    until_s = AHEAD * float(ready.reach_set.end_time_s.max())
    classes = AUTOMATON.classes
    assert classes is not None
    for node in range(ready.reach_set.nodes):
        at = classes.class_at(float(ready.reach_set.states[node, 3]))
        if classes.climb_mps[at] != 0.0:
            continue
        times = np.linspace(ready.reach_set.end_time_s[node], until_s, 200)
        track = moving.position_m[0] + times[:, None] * moving.velocity_mps[0]
        away = np.linalg.norm(track - stopped_m(ready, node), axis=1).min() - moving.radius_m[0]
        away -= ready.paths.sagitta_m[node]
        if node in stops:
            assert away >= MARGIN_M - SPARE_M
        elif away > MARGIN_M + SPARE_M:
            pytest.fail(f"node {node} stops {away:.2f} m away, and does not count")


def test_what_goes_on_lasts_as_long_as_any() -> None:
    found = lasting(RESTS, ball(np.array([9.0, 0.0, 0.0]), np.array([-3.0, 0.0, 0.0]), 0.8))
    reach_set = prepared(RESTS).reach_set
    assert len(found.goes_on.nodes)
    assert reach_set.end_time_s[found.goes_on.nodes].min() == reach_set.end_time_s.max()


def test_it_is_not_asked_where_nothing_moves_or_of_planes() -> None:
    ready = prepared(RESTS)
    assert lasting_among(all_of(ready), ready, nothing_moving(), MARGIN_M) is None
    plane = plane_planner().prepare(0.0)
    comes = ball(np.array([9.0, 0.0, 0.0]), np.array([-3.0, 0.0, 0.0]), 0.8)
    assert lasting_among(all_of(plane), plane, comes, MARGIN_M) is None


def stays_at(state: State, comes: Intruder, way_out: WayOut | None = None) -> Decision:
    """Of a copter that holds, since no way leads on, where all is known to be free."""
    box_m = np.array([[-60.0, -60.0, -60.0], [60.0, 60.0, 60.0]])
    free = FreeSpace(0.3, np.zeros(3), 1.0, reach_m=20.0, complete_m=box_m, finds_all=True)
    commitment = Commitment(stays=True, stood=STANDING_IS_WANTED, way_out=way_out, had_certain=True)
    goal_m = np.array([30.0, 0.0, 0.0])
    situation = Situation(state, goal_m, intruders=[comes], seen=free.seen)
    return decide(planner(), situation, commitment=commitment)


def stays(past_m: float) -> bool:
    """Whether it does where a ball passes at a distance, in two seconds."""
    velocity_mps = np.array([-1.0, 3.0, 0.0])
    across = np.array([3.0, 1.0, 0.0]) / np.sqrt(10.0)
    comes = Intruder(past_m * across - 2.0 * velocity_mps, velocity_mps, name="comes")
    decision = stays_at(State(np.zeros(3), velocity_mps=np.zeros(3)), comes)
    places = AUTOMATON.rollout(decision.state.vector, decision.movements).states[:, :3]
    return bool(np.abs(places).max() < 1e-9)


@pytest.mark.parametrize("course", np.radians([0.0, 60.0, 135.0, 180.0, -90.0]))
@pytest.mark.parametrize("speed_mps", [1.5, 3.0, 5.0])
def test_who_holds_is_not_run_over(course: float, speed_mps: float) -> None:
    """Decision after decision, until the ball has passed: the margin is kept throughout."""
    ahead = np.array([np.cos(course), np.sin(course), 0.0])
    comes = Intruder(-6.0 * speed_mps * ahead, speed_mps * ahead, name="comes", radius_m=0.6)
    state, way_out = State(np.zeros(3), velocity_mps=np.zeros(3)), None
    least_m, moved, now = np.inf, False, 0.0
    while now < 10.0:
        decision = stays_at(state, comes, way_out)
        (movement,) = AUTOMATON.chain(decision.movements[:1])
        for share in np.linspace(0.0, 1.0, 9):
            place_m = AUTOMATON.predict(state.vector, movement, share * movement.duration_s)[:3]
            there_m = comes.position_m + (now + share * movement.duration_s) * comes.velocity_mps
            least_m = min(least_m, float(np.linalg.norm(place_m - there_m)) - comes.radius_m)
        after = AUTOMATON.predict(state.vector, movement)
        moved = moved or bool(np.abs(after[:3]).max() > 0.1)
        now += movement.duration_s
        state, way_out = State(after[:3], after[3:], time_s=now), decision.way_out
    assert moved
    assert least_m >= MARGIN_M


def test_who_holds_stays_where_what_comes_passes_at_a_distance() -> None:
    assert stays(past_m=3.0)
    assert not stays(past_m=0.3)
