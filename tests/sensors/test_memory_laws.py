"""Laws of the memory: nothing within reach is lost, whatever the order or the count of returns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.state import State
from clearway.sensors import BeamPattern, Lidar, PointMemory, Scan, update_memory

PATTERN = BeamPattern.rotating(np.linspace(-40.0, 40.0, 41), 2.0, max_range_m=60.0)
LIDAR = Lidar("all round", PATTERN, sigma_m=0.02)
REACH_M = 15.0


def cloud(rng: np.random.Generator, count: int) -> np.ndarray:
    """Returns of the sensor's beams: a wall, leaves, and some far away."""
    beams = PATTERN.directions[rng.integers(0, PATTERN.beams, count)]
    beams = beams + rng.normal(0.0, 0.01, beams.shape)
    ranges = rng.choice(
        [rng.uniform(0.5, 14.0, count), np.full(count, 4.0), rng.uniform(10, 30, count)]
    )
    return beams / np.linalg.norm(beams, axis=1)[:, None] * ranges[:, None]


def world_of(points: np.ndarray, state: State) -> np.ndarray:
    return points @ state.world_from_body.T + state.position_m


def claimed_m(memory: PointMemory, places: np.ndarray) -> np.ndarray:
    """[n] distance of places to the nearest ball, one after the other."""
    return np.array(
        [
            (np.linalg.norm(memory.position_m - place, axis=1) - memory.radius_m).min(
                initial=np.inf
            )
            for place in places
        ]
    )


def as_set(memory: PointMemory) -> list[tuple[float, ...]]:
    columns = (
        memory.position_m,
        memory.radius_m[:, None],
        memory.last_seen_s[:, None],
        memory.boxes.size_m[:, None],
        memory.boxes.kind[:, None],
    )
    return sorted(map(tuple, np.hstack(columns).tolist()))


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    capacity=st.sampled_from([30, 300, 20_000]),
    widest_m=st.sampled_from([2.0, np.inf]),
)
def test_the_order_of_returns_makes_no_difference(seed, capacity, widest_m):
    rng = np.random.default_rng(seed)
    one = PointMemory.empty(0.12, reach_m=REACH_M, capacity=capacity, widest_m=widest_m)
    other = one
    for step in range(3):
        points, state = cloud(rng, 400), State(np.array([0.5 * step, 0, 0]), time_s=float(step))
        turned = np.roll(points, rng.integers(0, 400), axis=0) if step else rng.permutation(points)
        one = update_memory(one, LIDAR, Scan(points, float(step), sensor="all round"), state)
        other = update_memory(other, LIDAR, Scan(turned, float(step), sensor="all round"), state)
        assert as_set(one) == as_set(other)


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    capacity=st.sampled_from([30, 300, 20_000]),
    widest_m=st.sampled_from([2.0, np.inf]),
)
def test_no_return_within_reach_lies_nearer_than_is_claimed(seed, capacity, widest_m):
    """However many beams pass: nothing is cleared here."""
    rng = np.random.default_rng(seed)
    memory = PointMemory.empty(
        0.12, reach_m=REACH_M, capacity=capacity, passes_to_clear=10**6, widest_m=widest_m
    )
    told = np.zeros((0, 3))
    for step in range(4):
        state = State(rng.uniform(-1, 1, 3), np.radians([0, 5, 90.0 * step]), time_s=float(step))
        points = cloud(rng, 300)
        memory = update_memory(memory, LIDAR, Scan(points, float(step), sensor="all round"), state)
        # Within reach from everywhere: what is beyond it for a while may go.
        near = np.linalg.norm(points, axis=1) <= REACH_M - 4.0
        told = np.concatenate([told, world_of(points[near], state)])
        places = rng.uniform(-12.0, 12.0, (100, 3))
        exact = np.linalg.norm(places[:, None] - told, axis=2).min(axis=1)
        assert np.all(claimed_m(memory, places) <= exact + 1e-9)


@pytest.mark.parametrize("returns", [1_000, 30_000, 150_000])
def test_a_panel_among_any_number_of_returns_is_known(returns):
    rng = np.random.default_rng(returns)
    leaves = rng.uniform([-14.0, -14.0, -8.0], [14.0, 14.0, 8.0], (returns, 3))
    leaves = leaves[np.linalg.norm(leaves[:, :2], axis=1) > 2.0]
    y, z = np.meshgrid(np.linspace(-2.0, 2.0, 25), np.linspace(-2.0, 2.0, 25))
    panel = np.column_stack([np.full(y.size, 4.0), y.ravel(), z.ravel()])
    state = State(np.zeros(3))
    for points in (np.concatenate([panel, leaves]), np.concatenate([leaves, panel])):
        memory = PointMemory.empty(0.12, reach_m=REACH_M)
        for step in range(3):
            scan = Scan(points, float(step), sensor="all round")
            memory = update_memory(memory, LIDAR, scan, state)
        assert claimed_m(memory, panel).max() <= 1e-9
        assert len(memory.radius_m) <= 20_000


def test_what_is_too_much_grows_coarser_far_off_first_and_is_counted():
    rng = np.random.default_rng(1)
    points = rng.uniform(-12.0, 12.0, (60_000, 3))
    memory = PointMemory.empty(0.12, reach_m=REACH_M)
    memory = update_memory(memory, LIDAR, Scan(points, 0.0, sensor="all round"), State(np.zeros(3)))
    assert memory.merged > 20_000
    assert memory.dropped == 0
    away = np.linalg.norm(memory.position_m, axis=1)
    near, far = memory.radius_m[away < 3.0], memory.radius_m[away > 10.0]
    assert np.median(near) < 0.5 * np.median(far)


def test_beyond_reach_the_farthest_go_first():
    rng = np.random.default_rng(2)
    memory = PointMemory.empty(0.12, reach_m=REACH_M, capacity=2_000)
    for step in range(8):
        state = State(np.array([10.0 * step, 0.0, 0.0]), time_s=float(step))
        points = rng.uniform(-8.0, 8.0, (600, 3))
        memory = update_memory(memory, LIDAR, Scan(points, float(step), sensor="all round"), state)
        away = np.linalg.norm(memory.position_m - state.position_m, axis=1)
        assert np.count_nonzero(away <= REACH_M) >= 600
    assert memory.dropped > 0
    assert memory.merged == 0
    assert len(memory.radius_m) <= 2_000


def test_coarse_balls_give_way_to_finer_ones_that_are_looked_at_from_near():
    """A wall that was seen among too much, and then alone."""
    rng = np.random.default_rng(3)
    wall = np.array([10.0, 0.0, 0.0]) + rng.uniform([0, -4, -4], [0, 4, 4], (4_000, 3))
    rest = rng.uniform([-14.0, -9.0, -8.0], [-10.0, 9.0, 8.0], (40_000, 3))
    state = State(np.zeros(3))
    memory = PointMemory.empty(0.12, reach_m=REACH_M, capacity=4_000)
    for step in range(3):
        scan = Scan(np.concatenate([wall, rest]), float(step), sensor="all round")
        memory = update_memory(memory, LIDAR, scan, state)
    assert memory.boxes.level[memory.position_m[:, 0] > 9.0].min() > 0
    for step in range(3, 30):
        near = State(np.array([6.0, 0.0, 0.0]), time_s=float(step))
        direct = PATTERN.directions[PATTERN.directions[:, 0] > 0.75]
        hits = direct * (4.0 / direct[:, :1])
        memory = update_memory(memory, LIDAR, Scan(hits, float(step), sensor="all round"), near)
    ahead = np.abs(memory.position_m - np.array([10.0, 0.0, 0.0])) < 1.0
    assert memory.boxes.level[ahead.all(axis=1)].max() == 0


def test_where_the_pitch_follows_the_beams_the_ground_takes_half_the_balls():
    """Noise about height 0 would put it into two layers of voxels."""
    rng = np.random.default_rng(4)
    state, counts = State(np.array([0.0, 0.0, 1.5])), []
    down = PATTERN.directions[PATTERN.directions[:, 2] < -0.2]
    ground = down * (1.5 / -down[:, 2:]) + rng.normal(0.0, 0.01, (len(down), 3))
    for height_m in (0.0, PointMemory.empty(0.12, widest_m=2.0).lift_m):
        here = State(state.position_m - np.array([0.0, 0.0, height_m]))
        memory = PointMemory.empty(0.12, reach_m=REACH_M, widest_m=2.0)
        memory = update_memory(memory, LIDAR, Scan(ground, 0.0, sensor="all round"), here)
        counts.append(len(memory.radius_m))
        told = world_of(ground[np.linalg.norm(ground, axis=1) < REACH_M], here)
        assert claimed_m(memory, told).max() <= 1e-9
    assert counts[0] < 0.7 * counts[1]
    assert memory.fine_m == 2.0


def test_a_full_memory_that_follows_the_beams_is_made_emptier_than_full():
    rng = np.random.default_rng(5)
    memory = PointMemory.empty(0.12, reach_m=REACH_M, capacity=2_000, widest_m=2.0)
    points = rng.uniform(-8.0, 8.0, (9_000, 3))
    memory = update_memory(memory, LIDAR, Scan(points, 0.0, sensor="all round"), State(np.zeros(3)))
    assert memory.merged > 0
    assert len(memory.radius_m) <= 0.85 * 2_000
    few = rng.uniform(-8.0, 8.0, (50, 3))
    after = update_memory(memory, LIDAR, Scan(few, 1.0, sensor="all round"), State(np.zeros(3)))
    assert after.merged == 0
    assert after.fine_m == memory.fine_m
