"""Totals of a campaign: counts by cell and over all, with exact intervals."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from clearway.base.intervals import exact_share
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.studies.campaigns.families import make_case
from clearway.studies.campaigns.file import read_campaign
from clearway.studies.campaigns.pages import write_pages
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.task import case_of, fly_task, tasks_of
from clearway.studies.campaigns.totals import ALL, HEAD, add_up


@pytest.mark.parametrize(("number", "trials"), [(0, 100), (1, 100), (98, 100), (100, 100), (3, 7)])
def test_an_exact_interval_leaves_one_tail_in_forty_on_either_side(
    number: int, trials: int
) -> None:
    low, high = exact_share(number, trials)
    if number:
        assert binom.sf(number - 1, trials, low) == pytest.approx(0.025)
    if number < trials:
        assert binom.cdf(number, trials, high) == pytest.approx(0.025)
    assert (low == 0.0) == (number == 0)
    assert (high == 1.0) == (number == trials)


def test_nothing_flown_says_nothing() -> None:
    assert exact_share(0, 0) == (0.0, 1.0)


def row(label: str, planner: str, seed: int, **values: Any) -> FlightRow:
    blank = {one.name: "" for one in fields(FlightRow)} | {
        "outcome": "safe", "reached": True, "touched": False, "nearest_m": 1.0, "time_s": 10.0,
        "mean_mps": 5.0, "top_mps": 9.0, "decision_ms_p50": 1.0, "decision_ms_p99": 3.0,
    }  # fmt: skip
    return FlightRow(**{**blank, "label": label, "planner": planner, "seed": seed, **values})


ROWS = [
    row("forest", "a", 0, nearest_m=0.5),
    row("forest", "a", 1, outcome="margin lost", touched=True, nearest_m=0.1, top_mps=19.0),
    row("forest", "b", 0, outcome="refused", reached=False, nearest_m=None, time_s=None,
        mean_mps=None, top_mps=None, decision_ms_p50=None, decision_ms_p99=None),
    row("walls", "a", 0, outcome="crashed", touched=True, reached=False, nearest_m=-0.1),
    row("walls", "b", 0, hidden="what stands there"),
]  # fmt: skip


def test_cells_and_planners_add_up() -> None:
    found = {(one.label, one.planner): one for one in add_up(ROWS)}
    assert list(found) == [
        ("forest", "a"), ("forest", "b"), ("walls", "a"), (ALL, "a"), (ALL, "b"),
    ]  # fmt: skip
    cell, both = found["forest", "a"], found[ALL, "a"]
    assert (cell.flights, cell.arrived, cell.contacts, cell.margins_lost) == (2, 2, 1, 1)
    assert (cell.least_m, cell.top_mps, cell.mean_mps) == (0.1, 19.0, 5.0)
    assert (both.flights, both.arrived, both.contacts, both.margins_lost) == (3, 2, 2, 2)
    assert found["forest", "b"].not_flown == 1
    assert np.isnan(found["forest", "b"].least_m)
    for one in found.values():
        assert len(one.as_cells()) == len(HEAD)
        assert json.loads(json.dumps(one.as_values()))["flights"] == one.flights


def test_a_single_family_is_not_summed_again() -> None:
    assert [one.label for one in add_up(ROWS[:3])] == ["forest", "forest"]


def test_totals_stand_between_their_marks_of_a_page(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- campaign-totals:begin -->\n<!-- campaign-totals:end -->\nafter\n")
    settings = {"campaign": "c", "version": "v"}
    assert write_pages(page, ROWS, settings, {}) == ["campaign-totals"]
    text = page.read_text()
    assert text.count("| forest | a | 2 | 2 (15.8-100.0 %)") == 1
    assert f"| {ALL} | a | 3 |" in text


def test_a_contact_is_that_of_the_body_and_a_speed_that_of_the_track() -> None:
    """A vehicle that flies straight past a ball, 0.25 m from its surface."""
    file = read_mission("static-obstacles").with_values("simulation", time_limit_s=19.0)
    beside = {"shape": "ball", "position_m": (10.0, 1.25, 0.0), "radius_m": 1.0}
    file = file.model_copy(update={"obstacle": (replace_section(file.obstacle[0], beside),)})
    for body, touches in ((0.2, False), (0.3, True)):
        setup = prepare(file.with_values("vehicle", body_radius_m=body))
        run = setup.fly_with("straight")
        assert run.metrics.min_obstacle_distance_m == pytest.approx(0.25, abs=1e-3)
        assert run.touched == touches
        assert run.crashed_s is None
        assert run.mean_mps == pytest.approx(1.0, abs=0.01)
        assert run.top_mps == pytest.approx(1.0, abs=0.01)


def replace_section(section: Any, values: dict[str, Any]) -> Any:
    return type(section)(**values)


# --- what campaigns change -----------------------------------------------------------------------


def test_a_change_of_the_beams_takes_the_place_of_other_ways_to_say_them() -> None:
    changes = {"lidar": {"field_deg": [90, 60], "spacing_deg": 2.0, "max_range_m": 8.0}}
    case = make_case("forest", 1, {}, changes, Path())
    (lidar,) = case.setup.lidars
    assert lidar.pattern.beams == 45 * 30
    assert lidar.sigma_m == 0.03, "what is not changed stays"


def test_only_keys_that_were_given_are_changed() -> None:
    """Defaults of a plane are no keys of a multirotor, which would be refused."""
    changes = {"vehicle": {"kind": "multirotor", "speed_mps": 5.0}}
    case = make_case("forest", 1, {}, changes, Path())
    assert case.setup.planner.automaton.can_stop


def test_flights_of_a_family_start_anywhere_and_head_anywhere() -> None:
    cases = [
        make_case("columns", seed, {"start_aside_m": 6.0, "any_heading": True}, {}, Path())
        for seed in range(8)
    ]
    headings = []
    for case in cases:
        start, goal = case.setup.mission.start, case.setup.mission.waypoints_m[-1]
        way = goal - start.position_m
        course = np.arctan2(way[1], way[0])
        headings.append(np.cos(start.attitude_rad[2] - course))
        rules = case.file.rules
        assert rules.floor_m is not None
        assert rules.ceiling_m is not None
        assert rules.floor_m < start.position_m[2] < rules.ceiling_m
    assert min(headings) < 0.0 < max(headings)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["copter", "copter-faults", "copter-ordinary", "copter-slow"])
def test_every_cell_of_the_campaigns_of_copters_can_be_prepared(name: str) -> None:
    tasks = {(task.label, task.planner): task for task in reversed(tasks_of(read_campaign(name)))}
    for task in tasks.values():
        if task.family != "table":
            assert case_of(task).file.safety.margin_m == 0.4


def test_a_table_of_columns_is_flown_from_where_it_says(tmp_path: Path) -> None:
    (tmp_path / "pillars.csv").write_text("x,y,radius,height\n8,0,1,5\n8,5,1,5\n")
    campaign = tmp_path / "c.toml"
    campaign.write_text(
        'name = "c"\nplanners = ["straight"]\n[[family]]\nfamily = "table"\n[family.parameters]\n'
        'file = "pillars.csv"\nstart_m = [0.0, 2.5, 2.0]\ngoal_m = [20.0, 2.5, 2.0]\n'
        "heights_m = [0.5, 4.0]\ncorridor_m = 9.0\n"
    )
    (task,) = tasks_of(read_campaign(str(campaign)))
    flown = fly_task(task)
    assert (flown.outcome, flown.touched) == ("safe", False)
    assert flown.nearest_m == pytest.approx(1.5, abs=1e-3)
