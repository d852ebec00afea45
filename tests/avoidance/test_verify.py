"""Verification against dense sampling of the true curve."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.clear.hazards import Cause, Hazards, MovingHazards, PointHazards
from clearway.avoidance.clear.verify import clearances, path_clearance, paths_of
from clearway.base.frames import world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.obstacle import Obstacle, shapes_of
from clearway.reach import build_reach_set
from clearway.vehicle.automaton import MovementAutomaton
from first_clear import first_clear

AUTOMATON = MovementAutomaton.plane()
PITCH = float(np.radians(15.0))
REACH_SET = build_reach_set(
    AUTOMATON, AvoidanceGrid.uniform(), method="primitives", start_pitch_rad=PITCH
)
PATHS = paths_of(REACH_SET)


def true_curve(node):
    """Times and positions in the grid frame, 1 cm apart."""
    start = np.array([0, 0, 0, 0, PITCH, 0.0])
    track = AUTOMATON.rollout(start, REACH_SET.movements_to(node), 0.01)
    return track.time_s, track.states[:, :3] @ world_from_body([0, PITCH, 0])


def random_hazards(seed):
    rng = np.random.default_rng(seed)
    points = PointHazards(rng.uniform([0, -6, -5], [11, 6, 5], (40, 3)), rng.uniform(0, 0.2, 40))
    shapes = shapes_of(
        [
            Obstacle.cuboid(
                rng.uniform([3, -5, -4], [9, 5, 4]),
                (1.0, 2.0, 0.5),
                radius_m=0.1,
                orientation_rad=rng.normal(size=3),
            ),
            Obstacle.ball(rng.uniform([3, -5, -4], [9, 5, 4]), 0.7),
            Obstacle.line(
                rng.uniform([3, -5, -4], [9, 5, 4]),
                4.0,
                radius_m=0.05,
                orientation_rad=rng.normal(size=3),
            ),
        ]
    )
    moving = MovingHazards(
        rng.uniform([4, -6, -2], [9, 6, 2], (3, 3)),
        rng.normal(size=(3, 3)),
        rng.uniform(0.1, 0.6, 3),
        rng.uniform(0.0, 0.2, 3),
        np.zeros(3),
        np.ones(3),
    )
    return Hazards(points, shapes, moving)


def sampled_clearance(node, hazards):
    time_s, curve = true_curve(node)
    gaps = np.linalg.norm(curve[:, None] - hazards.points.position_m, axis=2)
    best = float(np.min(gaps - hazards.points.radius_m))
    for center, rotation, half, radius in zip(*hazards.shapes[:4], strict=True):
        local = np.abs((curve - center) @ rotation) - half
        outside = np.linalg.norm(np.maximum(local, 0), axis=1)
        best = min(best, float(np.min(outside + np.minimum(local.max(axis=1), 0) - radius)))
    for start, velocity, radius, growth in zip(*hazards.moving[:4], strict=True):
        gap = np.linalg.norm(curve - start - velocity * time_s[:, None], axis=1)
        best = min(best, float(np.min(gap - radius - growth * time_s)))
    return best


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), pick=st.integers(0, 10_000))
def test_clearance_of_a_path_is_safe_and_tight(seed, pick):
    hazards = random_hazards(seed)
    node = int(REACH_SET.trajectories[pick % len(REACH_SET.trajectories)])
    found = path_clearance(PATHS, node, hazards).distance_m
    truth = sampled_clearance(node, hazards)
    # Sagitta and the growth over one chord are taken off, never added.
    assert truth - 0.08 <= found <= truth + 1e-3


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), margin=st.floats(0.1, 1.0))
def test_the_first_clear_candidate_is_clear_and_those_before_it_are_not(seed, margin):
    hazards = random_hazards(seed)
    order = np.random.default_rng(seed).permutation(REACH_SET.trajectories).astype(np.int64)
    result = first_clear(PATHS, order, hazards, margin)
    tried = len(order) if result.chosen < 0 else result.chosen
    for at in range(0, tried, 11):
        clearance = path_clearance(PATHS, int(order[at]), hazards)
        assert clearance.distance_m < margin
        assert result.shortfall_m[at] < margin
        assert result.causes[at] != Cause.NOTHING
    if result.chosen >= 0:
        chosen = path_clearance(PATHS, int(order[result.chosen]), hazards)
        assert chosen.distance_m >= margin - 1e-6


def test_clearances_of_all_nodes_agree_with_single_paths():
    hazards = random_hazards(5)
    every = clearances(PATHS, hazards, 1.0)
    for node in range(0, REACH_SET.nodes, 13):
        single = min(1.0, path_clearance(PATHS, node, hazards).distance_m)
        assert every[node, 0] == pytest.approx(single, abs=1e-6)
    assert np.all(every[:, 1] >= 0.0)


def test_nothing_limits_a_path_in_an_empty_world():
    clearance = path_clearance(PATHS, int(REACH_SET.trajectories[0]), Hazards())
    assert clearance.distance_m == np.inf
    assert clearance.cause is Cause.NOTHING


def test_an_intruder_is_met_at_equal_times_only():
    straight = next(
        int(n) for n in REACH_SET.trajectories if set(REACH_SET.movements_to(n)) == {"Straight"}
    )
    crossing = MovingHazards(
        np.array([[6.0, 6.0, 0.0]]),
        np.array([[0.0, -1.0, 0.0]]),
        np.array([0.6]),
        np.zeros(1),
        np.zeros(1),
        np.ones(1),
    )
    meets = path_clearance(PATHS, straight, Hazards(moving=crossing))
    assert meets.distance_m == pytest.approx(-0.6, abs=1e-6)
    assert meets.cause is Cause.INTRUDER
    early = crossing._replace(position_m=np.array([[6.0, 2.0, 0.0]]))
    assert path_clearance(PATHS, straight, Hazards(moving=early)).distance_m > 1.5


@pytest.mark.parametrize("seed", range(20))
def test_what_turns_as_hard_as_it_has_shown_never_comes_nearer_than_claimed(seed):
    """Bounded acceleration at no more than the present speed, however it is used."""
    rng = np.random.default_rng(seed)
    place, velocity = rng.uniform([4, -5, -2], [9, 5, 2]), rng.normal(size=3)
    hardest, node = float(rng.uniform(0.05, 0.6)), int(rng.choice(REACH_SET.trajectories))
    moving = MovingHazards(
        place[None], velocity[None], np.zeros(1), np.zeros(1), np.array([hardest]), np.ones(1)
    )
    claimed = path_clearance(PATHS, node, Hazards(moving=moving)).distance_m
    time_s, curve = true_curve(node)
    speed = np.linalg.norm(velocity)
    for _ in range(20):
        at, going, push = place.copy(), velocity.copy(), rng.normal(size=3)
        for n in range(1, len(time_s)):
            step = time_s[n] - time_s[n - 1]
            aim = curve[min(n + 10, len(curve) - 1)] - at if rng.random() < 0.7 else push
            wanted = speed * aim / np.linalg.norm(aim) - going
            changed = wanted * min(1.0, hardest * step / max(np.linalg.norm(wanted), 1e-9))
            going = going + changed
            going *= min(1.0, speed / max(np.linalg.norm(going), 1e-9))
            at = at + step * going
            assert np.linalg.norm(curve[n] - at) >= claimed - 0.02 * max(1.0, speed)
