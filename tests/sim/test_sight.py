"""The search over all motions in what is seen, of `tools.sight`, where the answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from tools.sight import goes_on, leads_on

from clearway.avoidance.escape.terms import make_escape_terms
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.escapes.library import EscapeLibrary
from worlds_for_tests import planner


def found(walls: list[Obstacle], cell_m: float = 0.3, most: int = 40_000) -> tuple[bool, bool]:
    """Whether a motion from the origin goes on for ever among walls, and whether all were seen."""
    who = planner(escape="known")
    charted = ObstacleMap(walls)
    situation = Situation(State(np.zeros(3)), np.array([50.0, 0.0, 0.0]), obstacle_map=charted)
    near = gather_in_reach(who, situation, 40.0, who.horizon_s)
    library = EscapeLibrary.of(who.automaton)
    terms = make_escape_terms(who, library, situation, near)
    to, whole = leads_on(np.zeros(4), 0, 0.0, library.legs, terms, cell_m, most)
    return goes_on(to), whole


def box(wide_m: float) -> list[Obstacle]:
    """Six walls about the origin, two of them close above and below."""
    walls, half_m = [], np.array([0.5 * wide_m, 0.5 * wide_m, 0.9])
    for axis in range(3):
        for side in (-1.0, 1.0):
            center, size = np.zeros(3), 2.0 * half_m + 2.0
            center[axis], size[axis] = side * (half_m[axis] + 0.5), 1.0
            walls.append(Obstacle.cuboid(center, size))
    return walls


def test_in_a_box_too_narrow_to_turn_in_every_motion_ends() -> None:
    assert found(box(6.0)) == (False, True)


@pytest.mark.nightly
def test_in_a_box_with_room_for_a_circle_one_goes_on() -> None:
    # A circle of 7.6 m and the margin on both sides, beside the start.
    assert found(box(18.0), cell_m=0.5, most=400_000) == (True, True)


@pytest.mark.parametrize("to", [[[-1, -1]], [[1, -1], [-1, -1]]])
def test_what_leads_nowhere_ends(to: list[list[int]]) -> None:
    assert not goes_on(np.array(to))


@pytest.mark.parametrize("to", [[[0, -1]], [[1, -1], [2, -1], [-1, 1]]])
def test_what_leads_back_goes_on(to: list[list[int]]) -> None:
    assert goes_on(np.array(to))
