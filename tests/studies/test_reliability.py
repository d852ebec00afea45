"""Ratings held against the truth: diagrams, the table, and what is truly there."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.avoidance.rate import calibration as calibrations
from clearway.avoidance.rate.calibration import CLASSES, Calibration, calibration, classes_of
from clearway.avoidance.rate.fusion import RATINGS, Evidence, assess_cells
from clearway.base.errors import InputError
from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import build_reach_set
from clearway.sim import SimulationSettings, simulate
from clearway.studies.reliability.bins import (
    BINS,
    bin_ratings,
    clopper_pearson,
    count_moments,
    reliability,
)
from clearway.studies.reliability.fit import fit_knots
from clearway.studies.reliability.passages import Passages
from clearway.studies.reliability.record import CELLS, KINDS, TRAJECTORIES, look_at_flight
from clearway.studies.reliability.truth import TruePassage, distances_m, find_obstructed_cells
from clearway.vehicle.automaton import MovementAutomaton
from in_process import clearway
from worlds_for_tests import LIDAR, mission, planner

share = st.floats(0.0, 1.0)


@given(share, share, st.integers(0, len(CLASSES) - 1))
def test_the_calibrated_map_never_falls_and_stays_within_0_and_1(one, other, number):
    low, high = sorted((one, other))
    came = calibration()(np.array([low, high]), np.array([number, number]))
    assert 0.0 <= came[0] <= came[1] <= 1.0


@given(share, share, share, share, st.booleans())
def test_more_of_the_total_rating_is_never_less_of_the_calibrated_one(a, b, visibility, u, coated):
    """Of cells of one class: what is detected is what differs."""
    rated = []
    for detected in sorted((a, b), reverse=True):
        grid = AvoidanceGrid.uniform(1.0, 1, columns=1, rows=1)
        evidence = replace(
            Evidence.free(grid),
            detected=np.array([detected * visibility]),
            visibility=np.array([visibility]),
            coated=np.array([coated]),
        )
        rated.append(assess_cells(evidence, RATINGS["calibrated"], u).rating[0])
    assert rated[0] <= rated[1]


def test_the_table_is_the_one_that_the_page_tells_of():
    """Golden: flights by the calibrated rating are these, until it is fitted anew."""
    path = Path(calibrations.__file__).with_name("calibration.json")
    told = json.loads(path.read_text())
    assert list(told["knots"]) == list(CLASSES)
    assert sum(told["passages"].values()) > 100_000
    made = calibration()
    at = np.array([0.0, 0.5, 0.9, 1.0])
    for number, name in enumerate(CLASSES):
        assert made(at, np.full(4, number)) == pytest.approx(GOLDEN[name], abs=1e-4), name


GOLDEN = {
    "clear": (0.9990, 0.9990, 0.9990, 0.9990),
    "near": (0.0667, 0.1903, 0.4558, 0.8768),
    "hidden": (0.2569, 0.2569, 0.5204, 0.9623),
    "traffic": (0.9392, 0.9392, 0.9508, 0.9858),
}
"""Shares at total ratings of 0, 0.5, 0.9 and 1."""


@pytest.mark.parametrize(
    ("knots", "problem"),
    [
        (((0.0, 0.5), (1.0, 0.4)), "must not fall"),
        (((0.5, 0.1), (0.5, 0.4)), "ratings must rise"),
        (((0.0, 0.0), (1.0, 1.2)), "within 0 and 1"),
        ((), "pairs"),
    ],
)
def test_a_table_that_is_no_such_map_is_refused(knots, problem):
    good = ((0.0, 0.0), (1.0, 1.0))
    with pytest.raises(InputError, match=problem):
        Calibration(dict.fromkeys(CLASSES, good) | {"near": knots})


def test_of_what_is_true_of_a_cell_the_last_class_counts():
    coated = np.array([False, True, True, True])
    visibility, intruder = np.array([1.0, 1.0, 0.2, 0.2]), np.array([0.0, 0.0, 0.0, 0.3])
    assert classes_of(coated, visibility, intruder).tolist() == [0, 1, 2, 3]


@given(st.lists(st.tuples(share, st.booleans()), min_size=1, max_size=60))
def test_counts_give_the_scores_that_the_numbers_themselves_give(pairs):
    rating, good = (np.array(each) for each in zip(*pairs, strict=True))
    found = reliability(count_moments(rating, good)[None])
    assert found.number == len(pairs)
    assert found.brier == pytest.approx(np.mean((rating - good) ** 2), abs=1e-9)
    assert found.came == pytest.approx(good.mean())
    assert 0.0 <= found.error <= 1.0
    assert sum(point.number for point in found.points) == len(pairs)


def test_a_rating_that_is_right_lies_on_the_line_and_an_overconfident_one_below():
    rng = np.random.default_rng(4)
    truth = rng.uniform(size=(40, 500))
    good = rng.uniform(size=truth.shape) < truth
    right = reliability(np.stack([count_moments(*each) for each in zip(truth, good, strict=True)]))
    assert right.error < 0.02
    assert sum(p.low <= p.said <= p.high for p in right.points) >= 9
    boastful = np.sqrt(truth)
    wrong = reliability(
        np.stack([count_moments(*each) for each in zip(boastful, good, strict=True)])
    )
    assert wrong.error > 0.1
    assert all(p.high < p.said for p in wrong.points if 0.2 < p.said < 0.8)


def test_intervals_know_that_cells_of_a_flight_are_no_independent_trials():
    one, none = np.ones(1000, dtype=bool), np.zeros(1000, dtype=bool)
    half = np.full(1000, 0.5)
    flights = np.stack([count_moments(half, one if k % 2 else none) for k in range(10)])
    (point,) = reliability(flights).points
    low, high = clopper_pearson(5, 10)
    assert (point.low, point.high) == pytest.approx((low, high), abs=0.05)


def test_exactly_0_and_1_have_bins_of_their_own():
    assert bin_ratings(np.array([0.0, 1e-9, 0.999999, 1.0])).tolist() == [0, 1, BINS - 2, BINS - 1]


def test_the_fit_is_isotonic_and_what_it_was_made_of():
    rng = np.random.default_rng(7)
    said = rng.uniform(size=50_000)
    good = rng.uniform(size=said.shape) < said**3
    knots = fit_knots(count_moments(said, good))
    assert (np.diff(knots, axis=0) >= 0.0).all()
    at = np.linspace(0.05, 0.95, 19)
    assert np.interp(at, *knots.T) == pytest.approx(at**3, abs=0.04)


class _There:
    """A decision that stands at the origin and looks along x."""

    def __init__(self, reach_set):
        from clearway.base.grid_frame import GridFrame
        from clearway.base.state import State

        self.state = State(np.zeros(3))
        self.frame = GridFrame.of(self.state)
        self.prepared = type("Prepared", (), {"reach_set": reach_set})()
        evidence = Evidence.free(reach_set.grid)
        self.cells = type("Cells", (), {"evidence": evidence})()


REACH_SET = build_reach_set(
    MovementAutomaton.plane(), AvoidanceGrid.uniform(6.0, 6), method="primitives"
)


def test_a_ball_obstructs_the_cells_it_is_in_and_a_wire_those_it_passes():
    there, grid = _There(REACH_SET), REACH_SET.grid
    ball = ObstacleMap([Obstacle.ball([3.5, 0.0, 0.0], 0.2)])
    hit = np.flatnonzero(find_obstructed_cells(there, ball, (), 6.0))
    assert hit.tolist() == grid.cell_of(np.array([[3.5, 0.0, 0.0]])).tolist()
    across = (0.0, 0.0, np.pi / 2)
    wire = ObstacleMap([Obstacle.line([4.5, 0.0, 0.1], length_m=6.0, radius_m=0.005,
                                      orientation_rad=across)])  # fmt: skip
    hit = set(np.flatnonzero(find_obstructed_cells(there, wire, (), 6.0)))
    along = np.stack([np.full(601, 4.5), np.linspace(-3, 3, 601), np.full(601, 0.1)], axis=1)
    passed = grid.cell_of(along)
    assert hit == set(passed[passed >= 0].tolist())


def test_an_intruder_is_where_it_was_and_flies_straight_on_after_that():
    track = TruePassage(np.array([1.0, 2.0]), np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]]), 0.1)
    assert track.at(np.array([1.5, 4.0]))[:, 1].tolist() == [1.0, 6.0]
    assert np.isinf(track.at(np.array([0.5]))).all()


def test_straight_flight_meets_who_crosses_in_time_and_nobody_who_is_late():
    there = _There(REACH_SET)
    empty = ObstacleMap([])
    straight = int(REACH_SET.trajectories[0])
    for node in REACH_SET.trajectories:
        if set(REACH_SET.movements_to(int(node))) == {"Straight"}:
            straight = int(node)
    path = REACH_SET.path(straight)
    for late_s, near in ((0.0, True), (3.0, False)):
        start = np.array([3.0, -3.0 - late_s, 0.0])
        crossing = TruePassage(
            np.array([0.0, 1.0]), np.stack([start, start + np.array([0.0, 1.0, 0.0])]), 0.2
        )
        least = distances_m(there, empty, (crossing,))[path].min()
        assert bool(least < 0.1) is near


def test_nobody_flies_on_from_the_first_place_that_is_too_near():
    passages = Passages.of(REACH_SET)
    clear = np.ones(REACH_SET.samples_m.shape[:2], dtype=bool)
    entered, good, kept = passages.judge_flown(clear)
    assert kept.all()
    assert (entered == (passages.cell >= 0)).all()
    assert (good == entered).all()
    ahead = REACH_SET.grid.cell_of(np.array([[2.5, 0.01, 0.01]]))[0]
    inside = REACH_SET.grid.cell_of(REACH_SET.samples_m.reshape(-1, 3)).reshape(clear.shape)
    entered, good, kept = passages.judge_flown(inside != ahead)
    assert 0 < kept.sum() < len(kept)
    assert set(passages.cell[entered & ~good].tolist()) == {int(ahead)}
    assert ((entered & ~good).sum(axis=1) == ~kept).all()


def test_a_flight_is_looked_at_by_every_rating_and_the_product_of_passages_is_what_came():
    ball = ObstacleMap([Obstacle.ball([9.0, 0.0, 0.0], 1.5)])
    from clearway.live import AvoidanceSystem

    flying = planner(escape="off")
    system = AvoidanceSystem(flying, mission((20.0, 0.0, 0.0)), lidars=(LIDAR,))
    run = simulate(system, ball, lidars=(LIDAR,), settings=SimulationSettings(time_limit_s=8.0))
    found = look_at_flight(run, flying.settings, 10.0)
    assert {key for key in found.counts if key[0] in KINDS} == {
        (kind, name) for kind in KINDS for name in RATINGS
    }
    one = reliability(found.counts[TRAJECTORIES, "total"][None])
    assert 0.0 < one.came < 1.0
    assert reliability(found.counts[CELLS, "total"][None]).came > 0.5


def test_the_command_line_takes_the_fifth_rating_by_name_and_tells_of_bad_ones(tmp_path):
    out = tmp_path / "flight"
    fly = ("fly", "intruders-collision", "--no-plots")
    done = clearway(*fly, "--rating", "calibrated", "--out", out)
    assert done.exit_code in (0, 1), done.stderr
    assert '"calibrated"' in (out / "mission.toml").read_text()
    wrong = clearway(*fly, "--rating", "callibrated")
    assert wrong.exit_code == 2
    assert "calibrated" in wrong.stderr
