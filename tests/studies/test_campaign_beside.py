"""Flights of a campaign beside what others published: the table, BARN's score, the campaign."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from clearway.base.errors import InputError
from clearway.studies.campaigns.beside import BESIDE_HEAD, barn_score, beside_cells
from clearway.studies.campaigns.file import read_campaign
from clearway.studies.campaigns.pages import write_pages
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.task import case_of, tasks_of

ROW = FlightRow(
    key="barn/a/0", label="barn", planner="a", seed=0, family="barn", parameters="{}",
    changes='{"vehicle": {"kind": "multirotor"}, "safety": {"margin_m": 0.2}}',
    campaign="peers-worlds", settings_id="s",
    version="v", replay="r", outcome="safe", why="", reached=True, margin_kept=True, margin_m=0.2,
    nearest_m=0.3, time_s=20.0, mean_mps=0.5, straight_m=10.0, path_m=11.0,
)  # fmt: skip


def test_a_line_has_difficulty_and_what_was_published() -> None:
    rows = [ROW, replace(ROW, key="barn/a/1", seed=1, reached=False, touched=True)]
    (cells,) = beside_cells(rows, "peers-worlds")
    line = dict(zip(BESIDE_HEAD, cells, strict=True))
    assert (line["family"], line["flights"]) == ("barn", "2")
    assert line["contact"].startswith("1 (1.3-98.7 %)")
    assert 1.0 < float(line["free path, m"]) < 10.0
    assert 0.5 < float(line["occluded"]) <= 1.0
    assert line["published"].startswith("BARN")
    assert "wheels" in line["differs"]


def test_a_campaign_of_ones_own_has_no_words_of_others() -> None:
    (cells,) = beside_cells([ROW], "mine")
    assert cells[-2:] == ("-", "-")


@pytest.mark.parametrize(
    ("changed", "score"),
    [
        ({"time_s": 4.0}, 0.5),
        ({"time_s": 10.0}, 0.5),
        ({"time_s": 20.0}, 0.25),
        ({"time_s": 90.0}, 0.125),
        ({"touched": True}, 0.0),
        ({"reached": False}, 0.0),
    ],
)
def test_the_score_of_barn_is_best_time_by_time_within_bounds(
    changed: dict[str, Any], score: float
) -> None:
    said = barn_score([replace(ROW, **changed)])
    assert said is not None
    assert f"{score:.3f} of 0.5" in said
    assert barn_score([replace(ROW, family="forest")]) is None


def test_the_table_stands_between_its_marks(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- campaign-beside:begin -->\n<!-- campaign-beside:end -->\n")
    settings = {"campaign": "peers-worlds", "version": "v"}
    assert write_pages(page, [ROW], settings, {}) == ["campaign-beside"]
    text = page.read_text()
    assert "| barn | a | 1 | 1 (2.5-100.0 %) |" in text
    assert "BARN's score over 1 flights: 0.250 of 0.5" in text


def test_the_campaign_has_1500_flights_and_says_of_each_family_what_was_published() -> None:
    campaign = read_campaign("peers-worlds")
    tasks = tasks_of(campaign)
    assert len(tasks) == 1500
    assert len({task.seed for task in tasks if task.label == "barn"}) == 300
    assert all(section.published and section.differs for section in campaign.file.family)


def test_words_that_break_a_table_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text('name = "c"\n[[family]]\nfamily = "forest"\npublished = "a | b"\n')
    with pytest.raises(InputError, match="published"):
        read_campaign(str(path))


@pytest.mark.nightly
def test_every_cell_can_be_flown() -> None:
    tasks = {
        (task.label, task.planner): task
        for task in reversed(tasks_of(read_campaign("peers-worlds")))
    }
    for task in tasks.values():
        if task.family != "table":
            case_of(task).setup.refuse_impossible()
