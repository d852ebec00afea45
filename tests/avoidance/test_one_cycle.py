"""What looks at a moment and what decides at it go by the same cells and the same trajectories."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clearway
from clearway.avoidance.clear.hazards import PointHazards, grow_into_grid
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.evidence import evidence_of, gather_in_reach, intruder_cells
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.scene import Scene, SceneIntruder, SceneScan, assess_scene, situation_of
from clearway.base.grid_frame import GridFrame
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, simulate_scan
from clearway.traffic import Intruder
from worlds_for_tests import GRID, LIBRARY, mission, planner

FINE, FAST = planner(accuracy="fine"), planner()
MODELS = FINE.settings.intruder_models
WIDE = Lidar(
    "wide", BeamPattern.per_cell(GRID, 4, elevations_per_cell=3, max_range_m=10.0), sigma_m=0.02
)
NARROW = Lidar(
    "narrow",
    BeamPattern.from_angles(np.linspace(-0.4, 0.4, 30), np.linspace(-0.2, 0.2, 9), name="narrow"),
    sigma_m=0.05,
)
NOW_S = 7.0

EVIDENCE = ("detected", "visibility", "map_base", "intruder", "coated", "seen")


@st.composite
def moments(draw):
    """A vehicle at any attitude, not quite sure where it is, and what is around it."""
    number = st.floats(-1.0, 1.0)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    state = State(
        rng.uniform(-50.0, 50.0, 3),
        [0.8 * draw(number), 0.5 * draw(number), 3.1 * draw(number)],
        time_s=NOW_S,
        position_std_m=draw(st.sampled_from([0.0, 0.05, 0.3])),
    )

    def ahead(nearest_m):
        place = rng.uniform([nearest_m, -5.0, -3.0], [11.0, 5.0, 3.0])
        return state.position_m + state.world_from_body @ place

    def balls(count):
        return [Obstacle.ball(ahead(3.0), rng.uniform(0.3, 1.5)) for _ in range(count)]

    mapped = balls(draw(st.integers(0, 3)))
    there = ObstacleMap(mapped[1:] + balls(draw(st.integers(0, 3))))
    intruders = [
        Intruder(
            ahead(2.0),
            rng.uniform(-3.0, 3.0, 3),
            spread_rad=rng.uniform(0.0, 0.3, 2),
            radius_m=0.4,
            name=f"i{n}",
            time_s=NOW_S - rng.uniform(0.0, 2.0),
            position_std_m=0.2,
            velocity_std_mps=0.1,
            acceleration_bound_mps2=0.3,
        )
        for n in range(draw(st.integers(0, 2)))
    ]
    lidars = draw(st.sampled_from([(), (WIDE,), (WIDE, NARROW)]))
    return state, ObstacleMap(mapped), there, intruders, lidars, int(rng.integers(1000))


def scene_at(state, mapped, intruders, scans, remembered=None):
    return Scene(
        "any",
        GRID,
        state,
        mapped,
        tuple(SceneScan(lidar, scan, "stated") for lidar, scan in scans),
        tuple(SceneIntruder(intruder, MODELS) for intruder in intruders),
        remembered,
    )


def test_what_the_door_assesses_is_what_a_decision_with_the_same_settings_goes_by():
    """Every setting counts, not the usual ones alone."""
    own = replace(
        FINE.settings, rating="visible", safety_margin_m=0.4, sigmas=2.0, point_sigmas=5.0,
        intruder_models=("line",), threshold=0.6, unknown=0.5,
    )  # fmt: skip
    careful = Planner.of(LIBRARY, own)
    here = State([3.0, 0.0, 1.0], [0.3, 0.1, 0.2], time_s=NOW_S, position_std_m=0.2)
    world = ObstacleMap([Obstacle.ball([9.0, 1.0, 1.0], 1.0)])
    known = ObstacleMap([Obstacle.ball([8.0, 3.0, 1.0], 1.0)])
    report = Intruder([9.0, -4.0, 1.0], [0.0, 1.0, 0.0], radius_m=0.3, name="a", time_s=NOW_S - 1.5)
    scan = simulate_scan(WIDE, world, here, 1)
    scene = clearway.assess(
        scan, GRID, lidar=WIDE, state=here, obstacle_map=known, intruders=[report], settings=own
    )
    ahead = replace(situation_of(scene.scene), target_m=np.array([30.0, 0.0, 0.0]))
    assert_same(scene, decide(careful, ahead))
    assert scene.cells.evidence.intruder.max() > 0.0
    with pytest.raises(ValueError, match="a is of 5"):
        clearway.assess(scan, GRID, lidar=WIDE, state=replace(here, time_s=1e6), intruders=[report])


def scanned(lidars, world, state, seed):
    return [(lidar, simulate_scan(lidar, world, state, seed)) for lidar in lidars]


def assert_same(scene, decision):
    """Cell by cell and node by node, to the last bit."""
    seen, decided = scene.cells.evidence, decision.cells.evidence
    for name in EVIDENCE:
        one, other = getattr(seen, name), getattr(decided, name)
        np.testing.assert_array_equal(one, other, err_msg=name)
    for name in ("map", "obstacle", "rating"):
        np.testing.assert_array_equal(getattr(scene.cells, name), getattr(decision.cells, name))
    assert scene.reach_set.start_pitch_rad == decision.prepared.reach_set.start_pitch_rad
    for name in ("node_rating", "reachability", "passed", "trajectories"):
        np.testing.assert_array_equal(getattr(scene.reach, name), getattr(decision.reach, name))


@given(moments())
@settings(max_examples=40, deadline=None)
def test_a_scene_means_for_cells_and_trajectories_what_a_decision_goes_by(moment):
    state, mapped, there, intruders, lidars, seed = moment
    scene = scene_at(state, mapped, intruders, scanned(lidars, there, state, seed))
    target = state.position_m + np.array([20.0, 3.0, 1.0])
    assert_same(assess_scene(scene), decide(FINE, replace(situation_of(scene), target_m=target)))


@given(moments())
@settings(max_examples=25, deadline=None)
def test_a_scene_means_what_the_live_system_decides_by_with_all_that_it_remembers(moment):
    state, mapped, there, intruders, lidars, seed = moment
    live = AvoidanceSystem(FINE, mission((300.0, 0.0, 0.0)), lidars=lidars, obstacle_map=mapped)
    turned = State(
        state.position_m - [0.3, 0.1, 0.0],
        state.attitude_rad + np.array([0.1, 0.0, 0.4]),
        time_s=NOW_S - 0.5,
    )
    scans = []
    for at in (turned, state):
        live.update(at)
        scans = scanned(lidars, there, at, seed)
        for _, scan in scans:
            live.update(scan)
    for intruder in intruders:
        live.update(intruder)
    assert all(live.trust.values()), "nobody is contradicted"
    remembered = live.situation(NOW_S)[0].remembered
    scene = assess_scene(scene_at(state, mapped, intruders, scans, remembered))
    assert_same(scene, live.decide(NOW_S).decision)


@given(moments())
@settings(max_examples=15, deadline=None)
def test_looking_more_coarsely_as_flight_does_changes_little(moment):
    state, mapped, there, intruders, lidars, seed = moment
    scene = scene_at(state, mapped, intruders, scanned(lidars, there, state, seed))
    situation = situation_of(scene)
    near = [gather_in_reach(terms, situation) for terms in (FINE, FAST)]
    fine, fast = (
        evidence_of(terms, situation, around, intruder_cells(terms, around))
        for terms, around in zip((FINE, FAST), near, strict=True)
    )
    for name in ("detected", "visibility", "seen"):
        np.testing.assert_array_equal(getattr(fine, name), getattr(fast, name))
    np.testing.assert_allclose(fast.map_base, fine.map_base, atol=0.03)
    np.testing.assert_allclose(fast.intruder, fine.intruder, atol=0.03)
    assert not np.any(fine.coated & ~fast.coated), "merged balls cover those that they stand for"


@given(
    roll=st.floats(-3.0, 3.0),
    pitch=st.floats(-1.5, 1.5),
    yaw=st.floats(-3.0, 3.0),
    place=st.lists(st.floats(-1e4, 1e4), min_size=3, max_size=3),
)
def test_the_frame_of_the_grid_is_that_of_the_body_without_its_roll(roll, pitch, yaw, place):
    state = State(place, [roll, pitch, yaw])
    frame = GridFrame.of(state)
    level = State(place, [0.0, pitch, yaw])
    np.testing.assert_allclose(frame.world_from_grid, level.world_from_body, atol=1e-12)
    assert frame.world_from_grid[:, 0] == pytest.approx(state.world_from_body[:, 0], abs=1e-12)
    assert frame.world_from_grid[2, 1] == pytest.approx(0.0, abs=1e-12), "its y axis is level"
    assert GridFrame.of(level).grid_from_body(level) is None
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 9.0]])
    np.testing.assert_allclose(frame.grid_points(frame.world_points(points)), points, atol=1e-7)
    other = State([1.0, 2.0, 3.0], [0.3, -0.2, 1.0])
    rotation, translation = frame.grid_from_body(other)
    world = points @ other.world_from_body.T + other.position_m
    np.testing.assert_allclose(
        points @ rotation.T + translation, frame.grid_points(world), atol=1e-7
    )


def test_balls_grow_and_come_into_the_grid_where_its_frame_says():
    rng = np.random.default_rng(3)
    frame = GridFrame.of(State([40.0, -7.0, 12.0], [0.4, -0.3, 2.2]))
    place_m, radius_m = rng.uniform(-90.0, 90.0, (50, 3)), rng.uniform(0.1, 2.0, 50)
    balls = grow_into_grid(place_m, radius_m, 0.25, frame.origin_m, frame.world_from_grid)
    np.testing.assert_allclose(balls.position_m, frame.grid_points(place_m), atol=1e-12)
    np.testing.assert_array_equal(balls.radius_m, radius_m + 0.25)


def test_of_two_start_pitches_as_near_scene_and_decision_take_the_flatter_one():
    for pitch in (-7.5, 7.5, 22.5, -22.5):
        state = State(np.zeros(3), np.radians([0.0, pitch, 0.0]))
        scene = assess_scene(scene_at(state, ObstacleMap(), [], []))
        decision = decide(FINE, replace(situation_of(scene.scene), target_m=np.array([20.0, 0, 0])))
        assert_same(scene, decision)


def test_an_uncertain_place_coats_more_of_a_scene():
    ball = ObstacleMap([Obstacle.ball([6.0, 0.0, 0.0], 0.5)])
    sure, unsure = (
        assess_scene(scene_at(State(np.zeros(3), position_std_m=std), ball, [], []))
        for std in (0.0, 0.4)
    )
    assert unsure.cells.evidence.coated.sum() > sure.cells.evidence.coated.sum()


def test_what_is_remembered_coats_a_scene_too():
    points = PointHazards(np.array([[4.0, 0.0, 0.0]]), np.array([0.1]))
    scene = assess_scene(scene_at(State(np.zeros(3)), ObstacleMap(), [], [], points))
    assert scene.cells.evidence.coated[int(GRID.cell_of(np.array([[3.9, 0.0, 0.0]]))[0])]


def test_no_accuracy_but_the_three_is_taken():
    with pytest.raises(ValueError, match="'rough' is none of"):
        Planner.of(LIBRARY, replace(FINE.settings, accuracy="rough"))
