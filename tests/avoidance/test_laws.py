"""Laws of decisions, on situations drawn at random; long ones run by `make nightly`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.clear.verify import path_clearance
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Scan, detect
from clearway.traffic import Intruder
from situations_for_tests import outcomes
from worlds_for_tests import GRID, LIBRARY, LIDAR, planner

PLANNER = planner()
HERE = State(np.zeros(3))
SEEDS = st.integers(0, 2**32 - 1)
SETS = [prepared for _, prepared in PLANNER.prepared_sets]


def rotation(yaw: float, pitch: float) -> FloatArray:
    """Yaw after pitch, nose down positive; written for these tests alone."""
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    turn = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    tilt = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    return turn @ tilt


# --- nothing impossible gets in -----------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("poison", [0.0, 0.002, 0.02])
def test_no_impossible_value_ends_in_a_decision(poison: float) -> None:
    came = outcomes(PLANNER, LIDAR, range(150), poison)
    assert came["refused"] > 0 or poison == 0.0
    assert came["RATED"] + came["VERIFIED"] > 0


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("poison", [0.0, 0.002, 0.01, 0.05])
def test_no_impossible_value_ends_in_a_decision_at_length(poison: float) -> None:
    assert sum(outcomes(PLANNER, LIDAR, range(1000, 26_000), poison).values()) == 25_000


# --- clearance is never overstated --------------------------------------------------------------


def gap_to_ball(path: FloatArray, center: FloatArray, radius: float) -> float:
    return float(np.linalg.norm(path - center, axis=1).min() - radius)


def gap_to_segment(path: FloatArray, a: FloatArray, b: FloatArray, radius: float) -> float:
    share = np.clip(((path - a) @ (b - a)) / ((b - a) @ (b - a)), 0.0, 1.0)
    return float(np.linalg.norm(path - a - share[:, None] * (b - a), axis=1).min() - radius)


def gap_to_box(
    path: FloatArray, center: FloatArray, turn: FloatArray, size: FloatArray, radius: float
) -> float:
    outside = np.abs((path - center) @ turn) - 0.5 * size
    away = np.linalg.norm(np.maximum(outside, 0.0), axis=1)
    return float((away + np.minimum(outside.max(axis=1), 0.0)).min() - radius)


def flown(decision: Decision) -> tuple[FloatArray, FloatArray]:
    """Times and places [n, 3] of a decision, as the automaton predicts them."""
    run = PLANNER.automaton.rollout(decision.state.vector, decision.movements, 0.02)
    return run.time_s, run.states[:, :3]


@settings(max_examples=25)
@given(seed=SEEDS)
def test_claimed_clearance_never_exceeds_the_exact_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    state = State(rng.normal(0.0, 30.0, 3), [rng.uniform(-0.5, 0.5), *rng.uniform(-0.7, 0.7, 2)])
    ahead = state.position_m + 6.0 * state.world_from_body[:, 0]
    obstacles, gaps = [], []
    for _ in range(rng.integers(0, 4)):
        center, radius = ahead + rng.normal(0.0, 6.0, 3), rng.uniform(0.01, 1.0)
        yaw, pitch = rng.uniform(-3.0, 3.0), rng.uniform(-1.5, 1.5)
        turn, size = rotation(yaw, pitch), rng.uniform(0.1, 8.0, 3)
        attitude = (0.0, pitch, yaw)
        obstacles.append(Obstacle.ball(center, radius))
        gaps.append(lambda path, c=center, r=radius: gap_to_ball(path, c, r))
        center = center + rng.normal(0.0, 5.0, 3)
        half = 0.5 * size[0] * turn[:, 0]
        obstacles.append(Obstacle.line(center, size[0], radius_m=radius, orientation_rad=attitude))
        gaps.append(
            lambda path, a=center - half, b=center + half, r=radius: gap_to_segment(path, a, b, r)
        )
        center = center + rng.normal(0.0, 5.0, 3)
        obstacles.append(
            Obstacle.cuboid(center, tuple(size), radius_m=0.1, orientation_rad=attitude)
        )
        gaps.append(lambda path, c=center, t=turn, s=size: gap_to_box(path, c, t, s, 0.1))
    count = int(rng.integers(0, 40))
    places, radii = ahead + rng.normal(0.0, 5.0, (count, 3)), rng.uniform(0.01, 0.3, count)
    velocity = rng.normal(0.0, 1.0, 3)
    mover = Intruder(ahead + rng.normal(0.0, 8.0, 3), velocity, radius_m=0.4)
    told = Situation(
        state,
        state.position_m + rng.normal(0.0, 20.0, 3),
        remembered=PointHazards(places, radii),
        obstacle_map=ObstacleMap(obstacles),
        intruders=[mover],
    )
    decision = decide(PLANNER, told)
    times, path = flown(decision)
    exact = [gap(path) for gap in gaps]
    exact += [gap_to_ball(path, place, r) for place, r in zip(places, radii, strict=True)]
    apart = np.linalg.norm(path - mover.position_m - times[:, None] * velocity, axis=1)
    exact.append(float(apart.min()) - 0.4)
    assert decision.choice.clearance_m <= min(exact) + 1e-9


@settings(max_examples=20)
@given(seed=SEEDS)
def test_more_evidence_never_raises_the_claimed_clearance_of_a_trajectory(seed: int) -> None:
    rng = np.random.default_rng(seed)
    state = State(np.zeros(3), [0.0, rng.uniform(-0.5, 0.5), 0.0])
    prepared = PLANNER.prepare_at(state)
    nodes = rng.choice(prepared.reach_set.trajectories, 12)
    places, radii = rng.normal(0.0, 6.0, (60, 3)), rng.uniform(0.01, 0.3, 60)
    balls = [Obstacle.ball(rng.normal(0.0, 7.0, 3), 0.5) for _ in range(6)]
    movers = [Intruder(rng.normal(0.0, 9.0, 3), rng.normal(0.0, 1.0, 3)) for _ in range(3)]
    before = np.full(len(nodes), np.inf)
    for share in (0.0, 0.3, 0.6, 1.0):
        told = Situation(
            state,
            np.array([30.0, 0.0, 0.0]),
            remembered=PointHazards(places[: int(60 * share)], radii[: int(60 * share)]),
            obstacle_map=ObstacleMap(balls[: int(6 * share)]),
            intruders=movers[: int(3 * share)],
        )
        hazards = decide(PLANNER, told).hazards
        now = np.array(
            [path_clearance(prepared.paths, int(node), hazards).distance_m for node in nodes]
        )
        assert np.all(now <= before + 1e-9)
        before = now


# --- what a decision does not depend on ---------------------------------------------------------


def scanned(rng: np.random.Generator) -> FloatArray:
    """[n, 3] returns of a few things ahead, sensor frame."""
    centers = rng.uniform([3.0, -5.0, -3.0], [9.0, 5.0, 3.0], (4, 3))
    return np.concatenate([c + rng.normal(0.0, 0.2, (40, 3)) for c in centers])


def decided_on(points: FloatArray) -> Decision:
    target = np.array([30.0, 1.0, 0.5])
    detection = detect(GRID, LIDAR, Scan(points, 0.0, sensor=LIDAR.name))
    return decide(PLANNER, Situation(HERE, target, detections=[detection], range_sigma_m=0.03))


@settings(max_examples=20)
@given(seed=SEEDS, start=st.integers(1, 159))
def test_neither_order_nor_start_of_a_sweep_counts(seed: int, start: int) -> None:
    """The same node. Merged returns sit at the mean of their voxel, whose last bits may differ."""
    rng = np.random.default_rng(seed)
    points = scanned(rng)
    told = decided_on(points)
    for same in (np.roll(points, start, axis=0), rng.permutation(points), points[::-1]):
        again = decided_on(same)
        assert again.choice.node == told.choice.node
        assert again.choice.basis is told.choice.basis
        assert again.choice.clearance_m == pytest.approx(told.choice.clearance_m, abs=1e-9)


def world_of(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, list[Obstacle], Intruder]:
    """Returns with their radii, map and traffic around the origin."""
    places = rng.uniform([2.0, -6.0, -4.0], [11.0, 6.0, 4.0], (30, 3))
    balls = [
        Obstacle.ball(rng.uniform([3.0, -6.0, -4.0], [11.0, 6.0, 4.0]), rng.uniform(0.2, 1.0))
        for _ in range(4)
    ]
    mover = Intruder(rng.uniform([5.0, -9.0, -2.0], [12.0, 9.0, 2.0]), rng.normal(0.0, 1.0, 3))
    return places, rng.uniform(0.02, 0.3, 30), balls, replace(mover, radius_m=0.3, name="one")


def moved_decision(
    seed: int, turn: FloatArray, shift: FloatArray, yaw: float, pitch: float
) -> Decision:
    """A decision in a world turned, mirrored (by `turn`) and shifted."""
    rng = np.random.default_rng(seed)
    places, radii, balls, mover = world_of(rng)
    target, following = rng.uniform([15.0, -9.0, -3.0], [30.0, 9.0, 3.0], (2, 3))

    def there(points: FloatArray) -> FloatArray:
        return np.asarray(points @ turn.T + shift)

    return decide(
        PLANNER,
        Situation(
            State(shift, [0.0, pitch, yaw]),
            there(target),
            next_m=there(following),
            remembered=PointHazards(there(places), radii),
            obstacle_map=ObstacleMap(
                [Obstacle.ball(there(b.position_m), b.radius_m) for b in balls]
            ),
            intruders=[
                replace(
                    mover,
                    position_m=there(mover.position_m),
                    velocity_mps=turn @ mover.velocity_mps,
                )
            ],
        ),
    )


@settings(max_examples=20)
@given(
    seed=SEEDS,
    east_m=st.floats(-1000.0, 1000.0),
    yaw=st.floats(-3.1, 3.1),
    pitch=st.sampled_from((0.0, np.radians(15.0), 0.1)),
)
def test_neither_place_nor_heading_counts(
    seed: int, east_m: float, yaw: float, pitch: float
) -> None:
    """The same node; numbers to 1e-6, since coordinates are rounded where they are."""
    here = moved_decision(seed, np.eye(3), np.zeros(3), 0.0, pitch)
    shift = np.array([east_m, -0.7 * east_m, 0.1 * east_m])
    there = moved_decision(seed, rotation(yaw, 0.0), shift, yaw, pitch)
    assert there.choice.node == here.choice.node
    assert there.choice.basis is here.choice.basis
    assert there.choice.cost_m == pytest.approx(here.choice.cost_m, abs=1e-6)
    assert there.choice.clearance_m == pytest.approx(here.choice.clearance_m, abs=1e-6)


def mirrored(movements: tuple[str, ...]) -> tuple[str, ...]:
    swap = {"Left": "Right", "Right": "Left"}
    return tuple(
        "-".join(swap.get(part, part) for part in movement.split("-")) for movement in movements
    )


@settings(max_examples=20)
@given(seed=SEEDS, pitch=st.sampled_from((0.0, np.radians(-15.0), 0.1)))
def test_a_mirrored_world_is_flown_mirrored(seed: int, pitch: float) -> None:
    """The twin of the node: left for right in every movement, at the same cost and clearance."""
    here = moved_decision(seed, np.eye(3), np.zeros(3), 0.0, pitch)
    there = moved_decision(seed, np.diag([1.0, -1.0, 1.0]), np.zeros(3), 0.0, pitch)
    assert there.movements == mirrored(here.movements)
    assert there.choice.basis is here.choice.basis
    assert there.choice.cost_m == pytest.approx(here.choice.cost_m, abs=1e-9)
    assert there.choice.clearance_m == pytest.approx(here.choice.clearance_m, abs=1e-9)


# --- margins and settings -----------------------------------------------------------------------


@pytest.mark.parametrize("margin", [np.nan, np.inf, 0.0, -0.6])
def test_a_margin_that_all_would_keep_is_refused(margin: float) -> None:
    with pytest.raises(ValueError, match="safety_margin_m: must be"):
        AvoidanceSettings(safety_margin_m=margin)


def test_a_cost_that_is_no_number_is_refused() -> None:
    own = Planner.of(LIBRARY, terminal_cost=lambda _, nodes, *__: np.full(len(nodes), np.inf))
    with pytest.raises(ValueError, match="trajectories cost no finite number"):
        decide(own, Situation(HERE, np.array([30.0, 0.0, 0.0])))


def test_a_terminal_cost_of_another_length_is_refused() -> None:
    own = Planner.of(LIBRARY, terminal_cost=lambda *_: np.array([1.0]))
    with pytest.raises(ValueError, match="one for every node it is asked of"):
        decide(own, Situation(HERE, np.array([30.0, 0.0, 0.0])))
    with pytest.raises(ValueError, match="stage cost: must be a finite number"):
        Planner.of(LIBRARY, stage_cost=lambda reach_set, _: np.full(reach_set.nodes, np.nan))


def test_a_mapped_wall_beyond_the_range_is_kept_clear_of() -> None:
    wall = ObstacleMap([Obstacle.cuboid([10.25, 0.0, 0.0], (0.1, 60.0, 60.0))])
    decision = decide(PLANNER, Situation(HERE, np.array([30.0, 0.0, 0.0]), obstacle_map=wall))
    assert decision.choice.clearance_m >= 0.6
    assert decision.path_m[:, 0].max() <= 10.2 - 0.6 + 1e-9
