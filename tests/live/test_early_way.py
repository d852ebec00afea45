"""Ways past what bars the straight one: taken as soon as they were seen, and not before."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from clearway.base.arrays import FloatArray
from clearway.live.recovery.early_way import early_way
from clearway.live.routing.seen_planner import SeenPlanner
from clearway.sim.baselines import CLEARWAY
from clearway.studies.campaigns.families import make_case
from clearway.studies.campaigns.file import read_campaign
from dead_end_flights import CAMPAIGN, mission_of, solids_of
from free_way import free_way
from seen_ways_for_tests import MARGIN_M, START, look, near_cells_seen, planner, wall

GOAL = np.array([30.0, 0.0, 0.0])
WALL_X, HALF_M = 12.5, 40.0


def told(
    gaps_m: list[tuple[float, float]], *more_m: FloatArray, unseen: slice | None = None
) -> SeenPlanner:
    """Of a wall 12.5 m ahead with gaps between some y, and more returns; all is seen, but not where
    it is `unseen`, cells along y of the finest level."""
    ends = [-HALF_M, *(end for gap in gaps_m for end in gap), HALF_M]
    parts = [wall((WALL_X, a), (WALL_X, b)) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    routes = look(planner(0.0), np.concatenate([*parts, *more_m]), seen=True)
    if unseen is not None:
        near_cells_seen(routes)[:, unseen] = False
    return routes


def with_gap(y_m: float) -> SeenPlanner:
    return told([(y_m - 2.5, y_m + 2.5)])


def crossed_m(corners_m: tuple[np.ndarray, ...]) -> float:
    """Where along y a way comes past the wall."""
    way = np.stack([START, *corners_m, GOAL])
    return float(np.interp(WALL_X, way[:, 0], way[:, 1]))


def test_where_the_straight_way_is_open_none_is_flown() -> None:
    assert early_way(with_gap(0.0), START, GOAL) == ()


def test_where_it_opens_little_aside_trajectories_lead_past() -> None:
    """Behind a post in the middle of the gap; not where another wall is in the way of these."""
    post = wall((WALL_X, 0.0), (WALL_X, 0.2))
    aside = told([(-5.0, 5.0)], post)
    assert early_way(aside, START, GOAL) == ()
    behind = wall((2.0 * WALL_X, -10.0), (2.0 * WALL_X, 20.0))
    made = told([(-5.0, 5.0)], post, behind)
    assert early_way(made, START, GOAL, ahead_m=1.5 * WALL_X) == ()
    assert early_way(made, START, GOAL) != ()


def test_a_way_is_kept_while_it_leads_past() -> None:
    corner, left = np.array([12.5, 9.0, 0.0]), (6.5, 11.5)
    made = told([(-11.5, -6.5), left])  # On the other side there is another, as far aside.
    assert early_way(made, START, GOAL, (corner, GOAL)) == (corner,)
    closed = told([(-11.5, -6.5)])
    assert crossed_m(early_way(closed, START, GOAL, (corner, GOAL))) < 0.0


@pytest.mark.parametrize("y_m", [-9.0, 7.0, 9.0])
def test_a_gap_that_was_seen_is_flown_to(y_m: float) -> None:
    assert abs(crossed_m(early_way(with_gap(y_m), START, GOAL)) - y_m) <= 2.5


def test_a_gap_that_nobody_has_seen_is_not_flown_to() -> None:
    assert early_way(told([(4.5, 9.5)], unseen=slice(34, None)), START, GOAL) == ()


def test_an_end_of_a_wall_that_nobody_has_seen_is_not_flown_to() -> None:
    made = look(planner(0.0), wall((WALL_X, -14.0), (WALL_X, 14.0)), seen=True)
    assert early_way(made, START, GOAL) != ()
    seen = near_cells_seen(made)
    seen[:, :20] = seen[:, -20:] = False
    made.begin_anew(None)
    assert early_way(made, START, GOAL) == ()


def test_where_no_way_leads_none_is_flown() -> None:
    corners = [(WALL_X, -15.0), (WALL_X, 15.0), (-9.0, 15.0), (-9.0, -15.0), (WALL_X, -15.0)]
    made = look(
        planner(0.0), np.concatenate([wall(*ends) for ends in pairwise(corners)]), seen=True
    )
    assert early_way(made, START, GOAL) == ()


def test_what_lies_beyond_a_gap_need_not_have_been_seen() -> None:
    made = with_gap(7.0)
    near_cells_seen(made)[48:] = False
    assert abs(crossed_m(early_way(made, START, GOAL)) - 7.0) <= 2.5


def times_the_shortest(label: str, seed: int) -> float:
    """Length of a multirotor's flight in that of the shortest way for a ball of its margin; the
    margin is kept and the goal reached."""
    file = read_campaign(CAMPAIGN).file
    section = next(one for one in file.family if one.name == label)
    changes = file.changes_of(section, CLEARWAY)
    changes["vehicle"] = changes["vehicle"] | {"kind": "inertialess"}
    case = make_case(section.family, seed, section.parameters, changes, Path())
    run = case.setup.fly_with(CLEARWAY)
    assert run.reached
    assert run.metrics.margin_violations == 0
    mission = mission_of(label, seed)
    ends = mission.vehicle.position_m, mission.mission.waypoints_m[-1]
    way = free_way(solids_of(mission), *ends, ball_m=MARGIN_M, measured=True)
    assert way.length_m is not None
    return run.metrics.path_length_m / way.length_m


@pytest.mark.parametrize(
    ("label", "worlds"),
    [
        ("walls-narrow", 2),
        *(
            pytest.param(label, 5, marks=pytest.mark.nightly)
            for label in ("walls-narrow", "balls-many", "forest-narrow")
        ),
    ],
)
def test_who_can_stop_flies_little_farther_than_the_shortest_way(label: str, worlds: int) -> None:
    """In the mean of some worlds, of the shortest way over a grid of places."""
    assert np.mean([times_the_shortest(label, seed) for seed in range(worlds)]) <= 1.2
