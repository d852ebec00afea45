"""The floor: no way leads below it, whatever else is in the way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.clear.hazards import no_shapes
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.floor import with_ground
from clearway.avoidance.plan.situation import Situation
from clearway.base.grid_frame import GridFrame
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.traffic import Intruder
from worlds_for_tests import planner

PLANNER = planner()


@settings(max_examples=25, deadline=None)
@given(
    height=st.floats(-0.5, 3.0),
    pitch=st.floats(-0.5, 0.5),
    off=st.floats(-2.0, 2.0),
    up=st.floats(-3.0, 3.0),
)
def test_no_decision_leads_below_the_floor(
    height: float, pitch: float, off: float, up: float
) -> None:
    state = State(np.array([0.0, 0.0, height]), np.array([0.0, pitch, 0.3]))
    over = ObstacleMap([Obstacle.ball([5.0, off, height + up], 2.0)])
    who = Intruder([12.0, 1.0, height + 1.0], [-1.5, 0.0, 0.0], name="who", radius_m=1.0)
    decision = decide(
        PLANNER,
        Situation(
            state,
            np.array([30.0, 0.0, -5.0]),
            obstacle_map=over,
            intruders=[who],
            floor_m=0.0,
        ),
    )
    lowest = decision.path_m[:, 2].min()
    # Nose down just above the floor, it cannot but dip; then it dips as little as it can.
    dips = min(0.0, height) - max(0.0, np.sin(pitch)) * 1.2
    assert lowest >= dips - 1e-6
    if pitch <= 0.0:
        assert lowest >= min(0.0, height) - 1e-6


def test_without_a_floor_the_same_goal_leads_down() -> None:
    down = Situation(State(np.zeros(3)), np.array([30.0, 0.0, -20.0]))
    assert decide(PLANNER, down).path_m[:, 2].min() < -1.0


@pytest.mark.parametrize(("height", "floor", "top"), [(10.0, 4.0, 4.0), (2.0, 4.0, 2.0)])
def test_the_ground_of_ways_out_lies_a_margin_below_the_floor(
    height: float, floor: float, top: float
) -> None:
    frame = GridFrame.of(State(np.array([3.0, -2.0, height]), np.array([0.0, 0.3, 1.0])))
    shapes = with_ground(no_shapes(), frame, floor, 1.5)
    assert len(shapes.radius_m) == 1
    world = frame.world_from_grid @ shapes.rotation[0]
    assert world == pytest.approx(np.eye(3), abs=1e-9)
    middle = frame.world_points(shapes.center_m)[0]
    assert middle[2] + shapes.half_m[0, 2] == pytest.approx(top - 1.5)
    none = no_shapes()
    assert with_ground(none, frame, -np.inf, 1.5) is none
