"""How direct flights of a campaign were, in a table; and the campaign that needs it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from clearway.studies.campaigns.direct import DIRECT_HEAD, direct_cells, is_direct
from clearway.studies.campaigns.file import read_campaign
from clearway.studies.campaigns.pages import write_pages
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.run import tasks_of
from clearway.studies.campaigns.task import case_of

ROW = FlightRow(
    key="walls/a/0", label="walls", planner="a", seed=0, family="walls", parameters="{}",
    changes="{}", campaign="c", settings_id="s", version="v", replay="r", outcome="safe", why="",
    reached=True, margin_kept=True, straight_m=60.0, path_m=90.0,
)  # fmt: skip


def test_direct_is_whoever_arrives_by_one_and_a_half_times_the_straight_way() -> None:
    assert is_direct(ROW)
    assert not is_direct(replace(ROW, path_m=90.1))
    assert not is_direct(replace(ROW, reached=False))
    assert not is_direct(replace(ROW, path_m=None))


def test_a_table_has_a_row_a_cell_and_one_for_all(tmp_path) -> None:
    rows = [
        ROW,
        replace(ROW, key="walls/a/1", seed=1, path_m=180.0),
        replace(ROW, key="forest/a/0", label="forest", touched=True, outcome="margin lost"),
    ]
    table = {cells[:2]: dict(zip(DIRECT_HEAD, cells, strict=True)) for cells in direct_cells(rows)}
    assert list(table) == [("walls", "a"), ("forest", "a"), ("all", "a")]
    walls, everything = table["walls", "a"], table["all", "a"]
    assert (walls["flights"], walls["path"]) == ("2", "2.25")
    assert walls["direct"] == "1 (1.3-98.7 %)"
    assert everything["contact"].startswith("1 (")
    assert everything["arrived"].startswith("3 (")
    page = tmp_path / "page.md"
    page.write_text("<!-- campaign-direct:begin -->\n<!-- campaign-direct:end -->\n")
    assert write_pages(page, rows, {"campaign": "c", "version": "v"}, {}) == ["campaign-direct"]
    assert "| walls | a | 2 | 2 (15.8-100.0 %) | 1 (1.3-98.7 %) |" in page.read_text()


@pytest.mark.parametrize("planner", ["10m-strict", "10m-budget", "20m-strict", "20m-budget"])
def test_planes_are_flown_by_what_they_see_and_may_spend(planner: str) -> None:
    tasks = [task for task in tasks_of(read_campaign("planes-sight")) if task.planner == planner]
    assert {task.label for task in tasks} >= {"walls", "forest", "caves-narrow", "u-shapes-wide"}
    file = case_of(tasks[0]).file
    seen_m, spent_m = (20.0 if "20m" in planner else 10.0), (4.0 if "budget" in planner else 0.0)
    assert file.grid.to_grid().range_m == seen_m
    assert file.safety.unobserved_m == spent_m
    assert file.vehicle.kind == "plane"
