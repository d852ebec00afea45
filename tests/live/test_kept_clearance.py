"""The clearance that decisions keep with 95 %: in whole flights, beside the truth, and learned."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import pytest

from clearway.base.conformal import MISSES, SHARE, level_after
from clearway.live import AvoidanceSystem
from clearway.live.outputs.kept_clearance import (
    KeptClearance,
    SensorView,
    group_of,
    read_scores,
    view_of,
)
from clearway.live.outputs.kept_stretch import Predicted, measure_clearance, predict_clearance
from clearway.missions.run_files import decision_record
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, LidarSensor
from clearway.sim import simulate
from clearway.studies.reliability.kept import TIE, HeldShare, Kept, KeptWatch, fit_scores
from worlds_for_tests import LIDAR, mission, planner

BALLS = ObstacleMap(
    [Obstacle.ball([x, y, 0.0], 0.8) for x, y in ((6.0, 0.4), (11.0, -1.5), (16.0, 1.0))]
)
GROUPS = [group_of(view, has_inertia=inertia) for view in SensorView for inertia in (False, True)]


def flown():
    """A flight among balls that only the LiDAR knows of."""
    system = AvoidanceSystem(planner(), mission((22.0, 0.0, 0.0)), lidars=(LIDAR,))
    watch = KeptWatch()
    run = simulate(system, BALLS, lidars=(LIDAR,), on_decision=watch)
    return run, watch


def test_a_whole_flight_states_bounds_that_hold_and_learns_from_its_scans():
    run, watch = flown()
    rows = watch.list_kept(run)
    stated = [entry.flight.kept for entry in run.decisions]
    assert len(rows) == len(stated) > 15
    assert np.mean([row.held for row in rows]) >= 0.9
    near = [row for row in rows if row.stated.predicted_m < row.stated.most_m]
    assert len(near) > 5
    # A bound of nothing would hold too: it is near what was kept.
    assert np.median([row.stated.bound_m / row.true_m for row in near]) > 0.7
    for row, after in itertools.pairwise(rows):
        assert after.stated.level == row.stated.level_after(row.measured_m)
    for entry, kept in zip(run.decisions, stated, strict=True):
        record = decision_record(entry)
        assert record["kept_clearance_m"] == pytest.approx(kept.bound_m, abs=1e-6)
        assert kept.in_words in record["explanation"]
        json.dumps(record, allow_nan=False)
    assert stated == [entry.flight.kept for entry in flown()[0].decisions]


@pytest.mark.parametrize("group", GROUPS)
def test_bounds_are_below_what_is_foreseen_and_lower_once_flights_have_learned(group):
    for quantiles in read_scores(group):
        assert all(a >= b for a, b in itertools.pairwise(quantiles))
        assert math.isfinite(quantiles[-1])
    levels = (-0.01, 0.01, MISSES)
    bounds = [KeptClearance(1.0, 0.02, 3.0, group, level) for level in levels]
    assert bounds[0].bound_m == 0.0 <= bounds[1].bound_m < bounds[2].bound_m < 1.0
    assert bounds[2].level_after(-5.0) == level_after(MISSES, missed=True)
    # What promises nothing cannot be missed.
    assert bounds[0].level_after(-5.0) > bounds[0].level
    assert bounds[1].level_after(None) == bounds[1].level
    assert "no clearance" in bounds[0].in_words
    assert f"within {bounds[2].bound_m:.2f} m" in bounds[2].in_words


def test_what_is_predicted_and_measured_is_the_distance_from_the_body_to_what_stands_there():
    system = AvoidanceSystem(planner(), mission((22.0, 0.0, 0.0)), obstacle_map=BALLS)
    looked = []

    def look(entry, _):
        decision = entry.flight.decision
        if looked:
            looked[-1].append(measure_clearance(looked[-1][0], decision))
        looked.append([decision, predict_clearance(decision)])

    run = simulate(system, BALLS, lidars=(), on_decision=look)
    assert len(looked) > 15
    truth = run.nearest_surface_m - run.body_radius_m
    for decision, predicted, *measured in looked[:-1]:
        begins = decision.state.time_s
        inside = (run.time_s >= begins - 1e-6) & (run.time_s <= begins + decision.decide_within_s)
        true_m = min(float(truth[inside].min()), predicted.most_m)
        assert predicted.clearance_m == pytest.approx(true_m, abs=0.05)
        if predicted.clearance_m < predicted.most_m:
            assert measured[0] == pytest.approx(true_m, abs=0.05)


GROUP = group_of(SensorView.ALL_ROUND, has_inertia=True)
FORESEEN = Predicted(clearance_m=1.5, gap_m=0.05, stretch_m=1.0, most_m=3.0)
SCALE_M = KeptClearance.of(FORESEEN, 0.02, GROUP).scale_m


def flight_of(errors_m, *, shown: bool) -> list[Kept]:
    """Decisions that foresee 1.5 m, and what came of them; shown: later scans see it."""
    rows, level = [], MISSES
    for error_m in errors_m:
        kept_m = 1.5 - error_m
        stated = KeptClearance.of(FORESEEN, 0.02, GROUP, level)
        rows.append(Kept(stated, kept_m if shown else None, kept_m))
        level = stated.level_after(rows[-1].measured_m)
    return rows


def test_the_table_of_scores_is_what_flights_showed():
    errors_m = np.random.default_rng(3).normal(0.0, SCALE_M, 4_000)
    found = fit_scores(flight_of(errors_m, shown=True))
    assert list(found) == [GROUP]
    assert found[GROUP]["true"][-1] == pytest.approx(1.645, abs=0.1)
    assert found[GROUP]["measured"] == tuple(max(one, TIE) for one in found[GROUP]["true"])


def test_a_flight_in_which_scans_show_less_than_foreseen_learns_to_promise_less():
    quantile = read_scores(GROUP).measured[-1]
    worse = SCALE_M * (quantile + 2.0) * np.random.default_rng(4).uniform(0.0, 2.0, 400)
    seen, unseen = (flight_of(worse, shown=shown) for shown in (True, False))
    assert np.mean([one.held for one in unseen[100:]]) < 0.9
    assert np.mean([one.held for one in seen[100:]]) > 0.93
    assert {one.stated.level for one in unseen} == {MISSES}


def test_bounds_are_lower_where_beams_lie_farther_apart_and_alike_at_any_scale():
    fine, coarse = FORESEEN, FORESEEN._replace(gap_m=0.5)
    for view in SensorView:
        group = group_of(view, has_inertia=True)
        near, far = (KeptClearance.of(one, 0.02, group) for one in (fine, coarse))
        assert near.scale_m < far.scale_m
        assert near.bound_m > far.bound_m
    ten_times = Predicted(*(10.0 * one for one in coarse))
    large = KeptClearance.of(ten_times, 0.0, GROUP).bound_m
    assert large == pytest.approx(10.0 * KeptClearance.of(coarse, 0.0, GROUP).bound_m)


def test_the_interval_takes_decisions_of_one_flight_for_what_they_are_worth():
    alike = HeldShare.of([[True] * k + [False] * (100 - k) for k in (94, 96)] * 10)
    apart = HeldShare.of([[True] * 100] * 19 + [[False] * 100])
    assert alike.share == apart.share == SHARE
    assert apart.high - apart.low > 4.0 * (alike.high - alike.low)


def test_sensors_look_all_round_if_one_of_them_does():
    ring = LidarSensor(Lidar("ring", BeamPattern.rotating([0.0], 2.0)))
    front = LidarSensor(Lidar("front", BeamPattern.rotating([0.0], 2.0, azimuth_span_deg=90.0)))
    assert view_of([front]) is view_of([]) is SensorView.AHEAD
    assert view_of([front, ring]) is SensorView.LEVEL
    round_ = LidarSensor(Lidar("round", BeamPattern.rotating([-20.0, 0.0, 20.0], 2.0)))
    assert view_of([front, ring, round_]) is SensorView.ALL_ROUND
