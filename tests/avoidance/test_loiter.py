"""Room to circle: distances of level circles, and what it is worth to a choice."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.clear.hazards import Cause, Hazards, PointHazards
from clearway.avoidance.clear.loiter import (
    EARLY_MOVEMENTS,
    NO_LOITER,
    loiter_circles,
    room_to_circle,
)
from clearway.avoidance.clear.verify import path_clearance, paths_of
from clearway.base.frames import world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.obstacle import Obstacle, shapes_of
from clearway.reach import build_reach_set
from clearway.reach.tree import SIDE
from clearway.vehicle.automaton import MovementAutomaton
from first_clear import RoomPrice, first_clear

AUTOMATON = MovementAutomaton.plane()
RADIUS_M = AUTOMATON.turning_radius_m
PITCH = float(np.radians(15.0))
REACH_SET = build_reach_set(
    AUTOMATON, AvoidanceGrid.uniform(), method="primitives", start_pitch_rad=PITCH
)
PATHS = paths_of(REACH_SET)
REFUGE = loiter_circles(REACH_SET, RADIUS_M)
MARGIN_M = 0.6
FRONT = REACH_SET.trajectories[REACH_SET.exit_kind[REACH_SET.trajectories] != SIDE]


def points(seed, count=25):
    rng = np.random.default_rng(seed)
    return PointHazards(rng.uniform([0, -9, -3], [12, 9, 3], (count, 3)), np.full(count, 0.05))


def sampled_room(node, hazards):
    """The better of both circles, 1 cm apart, from the rotation of the grid itself."""
    level_from_grid = world_from_body([0.0, PITCH, 0.0])
    yaw = REACH_SET.states[node, 5]
    rooms = []
    for side in (1.0, -1.0):
        left = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
        center = level_from_grid @ REACH_SET.states[node, :3] + side * RADIUS_M * left
        angle = np.arange(0.0, 2.0 * np.pi, 0.01 / RADIUS_M)
        circle = center + RADIUS_M * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        there = hazards.points.position_m @ level_from_grid.T
        gaps = np.linalg.norm(circle[:, None] - there, axis=2) - hazards.points.radius_m
        rooms.append(float(gaps.min()))
    return max(rooms)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), pick=st.integers(0, 10_000))
def test_the_better_circle_is_measured(seed, pick):
    hazards = Hazards(points(seed))
    node = pick % REACH_SET.nodes
    found = room_to_circle(REFUGE, node, hazards.bins, hazards.shapes, 2.0)[0]
    assert min(found, 2.0) == pytest.approx(min(sampled_room(node, hazards), 2.0), abs=1e-3)


def has_early_room(node, hazards):
    first = REACH_SET.path(node)[:EARLY_MOVEMENTS]
    return any(sampled_room(int(n), hazards) >= MARGIN_M for n in first)


@pytest.mark.nightly
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), price=st.floats(0.0, 20.0))
def test_the_cheapest_with_the_price_of_no_room_is_chosen(seed, price):
    hazards = Hazards(points(seed))
    rng = np.random.default_rng(seed)
    candidates = rng.permutation(FRONT).astype(np.int64)
    cost = np.sort(rng.uniform(0.0, 30.0, len(candidates)))
    prices = RoomPrice(cost, np.full(len(candidates), price))
    result = first_clear(PATHS, candidates, hazards, MARGIN_M, REFUGE, prices)
    keeps = [path_clearance(PATHS, int(n), hazards).distance_m >= MARGIN_M for n in candidates]
    worth = [
        at + (0.0 if has_early_room(int(node), hazards) else price) if kept else np.inf
        for node, at, kept in zip(candidates, cost, keeps, strict=True)
    ]
    assert result.chosen == (int(np.argmin(worth)) if any(keeps) else -1)
    for at in range(len(result.causes)):
        assert result.shortfall_m[at] < MARGIN_M
        assert result.causes[at] == Cause.POINT


def corridor():
    """Walls 7 m apart on both sides, from 1 m ahead on: too narrow to turn round in."""
    walls = [Obstacle.cuboid((8.0, side * 3.75, 0.0), (14.0, 0.5, 60.0)) for side in (1, -1)]
    return Hazards(shapes=shapes_of(walls))


def test_a_street_is_entered_where_nothing_else_is_to_be_had():
    candidates = FRONT.astype(np.int64)
    cost = np.arange(len(candidates), dtype=np.float64)
    prices = RoomPrice(cost, np.full(len(candidates), 1e6))
    priced = first_clear(PATHS, candidates, corridor(), MARGIN_M, REFUGE, prices)
    assert priced.chosen >= 0
    assert priced.chosen == first_clear(PATHS, candidates, corridor(), MARGIN_M).chosen


def test_a_vehicle_that_need_not_circle_has_no_circles():
    for radius in (0.0, np.inf, np.nan):
        assert loiter_circles(REACH_SET, radius) is NO_LOITER
