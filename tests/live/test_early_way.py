"""Ways past what bars the straight one: taken as soon as they were seen, and not before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.live.recovery.early_way import early_way
from clearway.live.routing.route_map import UNOBSERVED_COST, Cells
from clearway.sim.baselines import CLEARWAY
from clearway.studies.campaigns.families import make_case
from clearway.studies.campaigns.file import read_campaign
from dead_end_flights import CAMPAIGN, mission_of, solids_of
from free_way import free_way

START, GOAL = np.array([0.0, 0.0, 0.0]), np.array([30.0, 0.0, 0.0])
WALL_X = 12
MARGIN_M = 0.6


def cells() -> Cells:
    """Cells of 1 m, all seen, with a wall 12 m ahead that goes right across."""
    price = np.ones((40, 40, 5))
    price[WALL_X] = np.inf
    return Cells(np.array([0.0, -20.0, -2.5]), 1.0, price, np.zeros(price.shape), price + 8.0)


def with_gap(y_m: int, *, seen: bool = True) -> Cells:
    made = cells()
    made.price[WALL_X, y_m + 18 : y_m + 22] = 1.0 if seen else UNOBSERVED_COST
    return made


def crossed_m(corners_m: tuple[np.ndarray, ...]) -> float:
    """Where along y a way comes past the wall."""
    way = np.stack([START, *corners_m, GOAL])
    return float(np.interp(WALL_X + 0.5, way[:, 0], way[:, 1]))


def test_where_the_straight_way_is_open_none_is_flown() -> None:
    assert early_way(with_gap(0), START, GOAL) == ()


def test_where_it_opens_little_aside_trajectories_lead_past() -> None:
    made = cells()
    made.price[WALL_X, 19:23] = 1.0  # Not in front of the vehicle, but 3 to 13 degrees aside.
    made.price[WALL_X, 20] = np.inf
    assert early_way(made, START, GOAL) == ()
    made.price[2 * WALL_X] = np.inf
    made.price[2 * WALL_X, :10] = 1.0
    assert early_way(made, START, GOAL, ahead_m=1.5 * WALL_X) == ()
    assert early_way(made, START, GOAL) != ()


def test_a_way_is_kept_while_it_leads_past() -> None:
    made, corner = with_gap(9), np.array([12.5, 9.0, 0.0])
    made.price[WALL_X, 8:12] = 1.0  # On the other side there is another, as far aside.
    assert early_way(made, START, GOAL, (corner, GOAL)) == (corner,)
    made.price[WALL_X, 25:33] = np.inf
    assert crossed_m(early_way(made, START, GOAL, (corner, GOAL))) < 0.0


@pytest.mark.parametrize("y_m", [-9, 7, 9])
def test_a_gap_that_was_seen_is_flown_to(y_m: int) -> None:
    way = early_way(with_gap(y_m), START, GOAL)
    assert abs(crossed_m(way) - y_m) <= 2.5


def test_a_gap_that_nobody_has_seen_is_not_flown_to() -> None:
    assert early_way(with_gap(7, seen=False), START, GOAL) == ()


def test_an_end_of_a_wall_that_nobody_has_seen_is_not_flown_to() -> None:
    made = cells()
    made.price[:, :8] = made.price[:, 32:] = UNOBSERVED_COST
    assert early_way(made, START, GOAL) == ()


def test_where_no_way_leads_none_is_flown() -> None:
    assert early_way(cells(), START, GOAL) == ()


def test_what_lies_beyond_a_gap_need_not_have_been_seen() -> None:
    made = with_gap(7)
    made.price[WALL_X + 3 :] = UNOBSERVED_COST
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
    "label",
    [
        "walls-narrow",
        pytest.param("balls-many", marks=pytest.mark.nightly),
        pytest.param("forest-narrow", marks=pytest.mark.nightly),
    ],
)
def test_who_can_stop_flies_little_farther_than_the_shortest_way(label: str) -> None:
    """In the mean of five worlds, of the shortest way over a grid of places."""
    assert np.mean([times_the_shortest(label, seed) for seed in range(5)]) <= 1.2
