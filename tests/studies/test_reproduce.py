"""`clearway reproduce`: its numbers against reference arrays, its pictures, its page, bad input."""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.contour import ContourSet
from typer.testing import CliRunner

from clearway.cli.app import app
from clearway.studies.reproduction.cone_figures import integrate_patch_m2, patch_figure
from clearway.studies.reproduction.intruder_cases import (
    CASES,
    IntersectionCase,
    assess_intruder_alone,
    model_cells,
)
from clearway.studies.reproduction.intruder_figures import draw_obstacle_space, draw_reach_space
from clearway.studies.reproduction.registry import TARGETS, targets_named
from clearway.studies.reproduction.report import as_page
from clearway.studies.reproduction.scene_figures import scan_of_ball
from clearway.studies.reproduction.stability import SHELL, WALL, approach, measure_deviations
from clearway.studies.reproduction.target import Findings, Measure, difference_words
from repository import REPOSITORY

PAGE = REPOSITORY / "docs" / "reproduction.md"
TARGET = "figures-6.2-6.13"

REFERENCE = {
    "6.2": ("line", "P", 1e-8),
    "6.4": ("line", "P_timed_5_5", 1e-8),
    "6.6": ("line", "future_recommended", 1e-8),
    "6.8": ("body_radius_1", "timed_volume", 1e-4),
    "6.10": ("spread", "P_T_5_23", 1e-4),
    "6.12": ("spread", "timed", 1e-4),
}
"""Where each figure's array is in the reference answers, and how closely a cell follows it."""


def run(*arguments: str | Path, cwd: Path) -> Any:
    """The command within this process."""
    with contextlib.chdir(cwd):
        return CliRunner().invoke(app, ["reproduce", *map(str, arguments)])


@pytest.fixture(scope="module")
def exhibits(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The twelve figures by label, as the installed command prints them."""
    folder = tmp_path_factory.mktemp("reproduce")
    command = shutil.which("clearway", path=Path(sys.executable).parent)
    assert command is not None
    done = subprocess.run(
        [command, "reproduce", TARGET, "--json", "--no-plots"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    written = folder / "clearway-out" / "reproduce"
    assert [path.name for path in written.iterdir() if not path.name.startswith(".")] == [
        "result.json"
    ]
    assert json.loads((written / "result.json").read_text()) == result
    (target,) = result["targets"]
    assert target["name"] == TARGET
    return {exhibit["label"]: exhibit for exhibit in target["exhibits"]}


def measured(exhibit: dict[str, Any]) -> dict[str, float]:
    return {measure["name"]: measure["ours"] for measure in exhibit["measures"]}


def reference(case: IntersectionCase, known_answers: dict[str, Any]) -> Any:
    part, key, _ = REFERENCE[case.obstacle_figure]
    return np.array(known_answers["intruder"][part][key], dtype=np.float64)


@pytest.mark.nightly
def test_all_twelve_figures_in_order(exhibits: dict[str, Any]) -> None:
    assert list(exhibits) == [f"Figure 6.{number}" for number in range(2, 14)]
    for exhibit in exhibits.values():
        assert exhibit["claim"]
        assert exhibit["ours"]
        assert exhibit["picture"] == f"{exhibit['label'].lower().replace(' ', '-')}.png"


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.obstacle_figure)
def test_numbers_of_the_obstacle_spaces(
    exhibits: dict[str, Any], known_answers: dict[str, Any], case: IntersectionCase
) -> None:
    expected = reference(case, known_answers)
    ours = measured(exhibits[f"Figure {case.obstacle_figure}"])
    assert ours["cells met"] == np.count_nonzero(expected)
    assert ours["sum"] == pytest.approx(expected.sum(), abs=1e-4)
    assert ours["largest"] == pytest.approx(expected.max(), abs=1e-5)


def test_what_agrees_with_the_specification_and_the_paper(exhibits: dict[str, Any]) -> None:
    compared = [
        (label, measure)
        for label, exhibit in exhibits.items()
        for measure in exhibit["measures"]
        if measure["expected"] is not None
    ]
    assert len(compared) >= 30
    assert [(label, m["name"]) for label, m in compared if not m["agrees"]] == []


def test_the_body_of_6_8_fits_the_radius_of_its_text_only(exhibits: dict[str, Any]) -> None:
    exhibit = exhibits["Figure 6.8"]
    assert exhibit["ours"].startswith("18 cells, by layer from the top 0, 5, 8, 5, 0;")
    assert "10 cells of layers 1 and 5" in exhibit["difference"]
    assert measured(exhibit)["cells met, untimed, radius 2 m"] == 137


@pytest.mark.parametrize("radius_m", [0.5, 10.0, 300.0])
def test_the_reference_of_a_patch_is_far_finer_than_what_it_judges(radius_m: float) -> None:
    """Fig. 3.2: the reference knows nothing of the formula, and converges to the area."""
    for azimuth, elevation in (
        ([-0.8, -0.5], [0.2, 0.5]),
        ([0.0, 0.3], [-1.5, -1.2]),
        ([3.0, 3.3], [-0.1, 0.4]),
    ):
        area = radius_m**2 * np.diff(azimuth)[0] * np.diff(np.sin(elevation))[0]
        found = integrate_patch_m2(radius_m, np.array(azimuth), np.array(elevation))
        assert found == pytest.approx(area, rel=1e-8)
    (exhibit,) = patch_figure()
    (measure,) = exhibit.findings.measures
    assert measure.tolerance <= 1e-6 * measure.ours
    assert measure.agrees


def test_figures_that_differ_from_the_paper_say_by_how_much() -> None:
    """Not only in words: each has numbers beyond its tolerance."""
    page = PAGE.read_text()
    for label, least in (("Figure 6.14", 2), ("Figure 6.18", 3), ("Figure 6.25", 3)):
        section = page.split(f"### {label}: ")[1].split("\n### ")[0]
        assert section.count("**") >= 2 * least, label
        told = re.findall(r"^- Difference: (.*)$", section, re.MULTILINE)[0]
        assert "paper" in told
        assert len(re.findall(r"\d", told)) >= 3, told


def test_future_movement_prefers_the_way_behind(exhibits: dict[str, Any]) -> None:
    ours = measured(exhibits["Figure 6.7"])
    left = ours["share of free trajectories on the left"]
    right = ours["share of free trajectories on the right"]
    assert left > right > 0.5


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.obstacle_figure)
def test_pictures_show_the_cells_of_the_reference(
    known_answers: dict[str, Any], case: IntersectionCase
) -> None:
    expected = reference(case, known_answers)
    tolerance = REFERENCE[case.obstacle_figure][2]
    figure = draw_obstacle_space(
        case, assess_intruder_alone(model_cells(case.model, case.timed)[0])
    )
    panels = [axes for axes in figure.axes if axes.get_title().startswith("Row")]
    rows = (4, 3, 2, 1, 0) if case.all_layers else (2,)
    assert len(panels) == len(rows)
    for axes, row in zip(panels, rows, strict=True):
        assert f"Row {5 - row}" in axes.get_title()
        drawn = next(c for c in axes.collections if isinstance(c, PolyCollection))
        np.testing.assert_allclose(
            np.asarray(drawn.get_array()), expected[:, :, row].ravel(), rtol=0, atol=tolerance
        )


def test_the_intruder_s_line_is_in_the_middle_layer_alone_and_its_cone_in_all(
    tmp_path: Path,
) -> None:
    case = next(case for case in CASES if case.reach_figure == "6.11")
    figure = draw_reach_space(case, assess_intruder_alone(model_cells(case.model, case.timed)[0]))
    panels = [axes for axes in figure.axes if axes.get_title().startswith("Row")]
    visible = []
    for axes in panels:
        line = axes.lines[0].get_xydata()
        visible.append(int(np.sum(np.isfinite(line).all(axis=1))))
        assert any(isinstance(c, ContourSet) for c in axes.collections)
    assert [count > 0 for count in visible] == [False, False, True, False, False]
    line = panels[2].lines[0].get_xydata()
    np.testing.assert_allclose(line[0], [6.0, 8.0], atol=1e-9)
    figure.savefig(tmp_path / "a.png", dpi=40)
    assert (tmp_path / "a.png").stat().st_size > 10_000


def test_pictures_numbers_and_page_of_a_target(tmp_path: Path) -> None:
    done = run("figures-5.5-5.8", "--out", "here", "--docs", "pages/comparison.md", cwd=tmp_path)
    assert done.exit_code == 0, done.stderr
    assert sorted(
        path.name for path in (tmp_path / "here").iterdir() if not path.name.startswith(".")
    ) == [
        *(f"figure-5.{number}.png" for number in (5, 6, 7, 8)),
        "result.json",
    ]
    assert (tmp_path / "here" / "figure-5.8.png").read_bytes().startswith(b"\x89PNG")
    assert "Figure 5.8" in done.stdout
    text = (tmp_path / "pages" / "comparison.md").read_text()
    assert "clearway reproduce figures-5.5-5.8" in text
    assert "From cell 1 to 10: 1, 1, 1, 0.75, 0.75, 0.6, 0.6, 0.4, 0.4, 0.4." in text
    assert str(tmp_path) not in text


def test_visibility_of_the_row_is_the_reference_s(
    known_answers: dict[str, Any], tmp_path: Path
) -> None:
    done = run("figures-5.5-5.8", "--json", "--no-plots", cwd=tmp_path)
    (target,) = json.loads(done.stdout)["targets"]
    for exhibit, expected in zip(
        target["exhibits"], known_answers["visibility_example"].values(), strict=True
    ):
        listed = ", ".join(f"{value:g}" for value in expected)
        assert exhibit["ours"] == f"From cell 1 to 10: {listed}."


QUICK = (
    "figures-2.1-2.2",
    "figures-2.3-2.4",
    "definition-13",
    "figure-3.1",
    "figure-3.2",
    "tables-4.1-4.2",
    "figures-4.1-4.3",
    "figures-5.1-5.4",
    "figures-5.5-5.8",
    "figures-5.9-5.11",
    "figures-6.2-6.13",
    "figure-7.1",
)
"""Targets that need no flight and no count of footprints."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.nightly]) for name in TARGETS],
)
def test_the_committed_page_is_what_the_command_writes(name: str) -> None:
    (target,) = targets_named([name])
    _, sections = as_page({target: target.make()}, "").split("\n## ")
    assert sections.strip() in PAGE.read_text()


def test_the_page_has_every_figure_and_table_of_the_paper() -> None:
    page = PAGE.read_text()
    figures = {2: 4, 3: 2, 4: 3, 5: 11, 6: 28, 7: 1}
    labels = [f"Figure {c}.{n}" for c, last in figures.items() for n in range(1, last + 1)]
    labels += [f"Table {number}" for number in ("4.1", "4.2", "6.1", "6.2")]
    labels += ["Definition 13", "Section 3.4.2 converging", "Section 3.4.2 wall"]
    labels += ["Comparison static-obstacles", "Comparison intruders-collision"]
    assert [label for label in labels if page.count(f"### {label}: ") != 1] == []
    assert [name for name in TARGETS if f"`{name}`" not in page] == []
    for section in page.split("\n### ")[1:]:
        for line in ("- Paper: ", "- Here: ", "- Difference: "):
            assert section.count(line) == 1


def says_none_rightly(difference: str, agreements: list[bool]) -> bool:
    """Whether a difference of "None" stands beside equal numbers only, and beside some."""
    return not difference.startswith("None") or (bool(agreements) and all(agreements))


def test_the_page_says_none_only_where_every_number_is_equal() -> None:
    sections = PAGE.read_text().split("\n### ")[1:]
    assert len(sections) > 50
    for section in sections:
        difference = re.findall(r"^- Difference: (.*)$", section, re.MULTILINE)[0]
        rows = [line.strip("|").split(" | ") for line in section.split("\n") if line[:2] == "| "]
        compared = [row[-1].strip(" |") for row in rows[1:] if "(" in row[2]]
        equal = [said == "none" or said.startswith("below") for said in compared]
        assert says_none_rightly(difference, equal), section


@pytest.mark.nightly
@pytest.mark.parametrize("name", TARGETS)
def test_every_target_says_none_only_where_every_number_is_equal(name: str) -> None:
    (target,) = targets_named([name])
    for exhibit in target.make():
        findings = exhibit.findings
        equal = [
            bool(m.equal) or abs(m.difference or 0.0) <= 0.01 * m.tolerance
            for m in findings.compared
        ]
        assert says_none_rightly(findings.difference_told, equal), exhibit.label


@pytest.mark.parametrize(
    ("ours", "expected", "tolerance", "told", "in_words"),
    [
        (1.0, 1.0, 0.0, "None.", "none"),
        (1.0 + 1e-15, 1.0, 0.0, "None.", "none"),
        (83.7, 82.2, 2.0, "Within tolerance: time, s +1.5 (tolerance 2).", "+1.5"),
        (83.7, 82.2, 1.0, "Beyond tolerance: time, s +1.5 (tolerance 1).", "+1.5"),
        (
            1.0 + 1e-9,
            1.0,
            1e-4,
            "Within tolerance: time, s below 1e-06 (tolerance 0.0001).",
            "below 1e-06",
        ),
        (4.0, None, 0.0, "Not measured: nobody gives a number for it.", ""),
    ],
)
def test_differences_are_computed_against_their_tolerance(
    ours: float, expected: float | None, tolerance: float, told: str, in_words: str
) -> None:
    measure = Measure("time, s", ours, expected, "reference", tolerance)
    assert Findings("claimed", "found", "", (measure,)).difference_told == told
    assert difference_words(measure) == in_words


def test_prediction_ball_holds_for_any_seed() -> None:
    """Def. 13: no flight in noise within its bounds leaves the ball."""
    for seed in (1, 2):
        found = measure_deviations(flights=100, seed=seed)
        assert np.all(found.deviation_m <= found.bound_m)
        assert found.deviation_m[:, -1].max() > 0.3 * found.bound_m[-1]


@pytest.mark.nightly
def test_without_an_obstacle_lyapunov_s_function_falls_and_with_one_it_may_not() -> None:
    """3.4.2"""
    free, wall = approach((), 60.0), approach((WALL,), 120.0)
    assert free.reached
    assert np.all(np.diff(free.lyapunov_m2) < 0.0)
    assert wall.reached
    assert wall.rising_s > 3.0
    assert wall.nearest_surface_m >= 0.6


def test_a_waypoint_inside_an_obstacle_is_never_reached() -> None:
    enclosed = approach((SHELL,), 60.0)
    assert not enclosed.reached
    assert enclosed.lyapunov_m2.min() > 8.0
    assert enclosed.nearest_surface_m >= 0.6


def test_equal_surfaces_rate_equally_at_any_distance_by_one_rule_only() -> None:
    """2.1.1: `ratio` falls with the square of the distance, `surface` does not."""
    near, far = scan_of_ball(5.0), scan_of_ball(10.0)
    assert (near.hits_in_middle_row, far.hits_in_middle_row) == (5, 3)
    assert far.ratio < 0.3 * near.ratio
    assert far.surface == pytest.approx(near.surface, rel=0.15)


def test_the_list_of_targets(tmp_path: Path) -> None:
    done = run("--list", cwd=tmp_path)
    assert done.exit_code == 0
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(TARGETS)
    listed = json.loads(run("--list", "--json", cwd=tmp_path).stdout)
    assert [target["name"] for target in listed["targets"]] == list(TARGETS)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("figure-6.2",), "no target 'figure-6.2' (did you mean 'figure-6.1'?); valid: "),
        ((TARGET, "tables"), "no target 'tables' (did you mean 'table-6.2'?); valid: "),
        ((), "nothing to reproduce: name at least one target; valid: "),
        (("figures-5.5-5.8", "--out", "taken"), "taken: cannot be written"),
        (("figures-5.5-5.8", "--docs", "taken/page.md"), "taken: cannot be written"),
    ],
)
def test_bad_input(tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    (tmp_path / "taken").write_text("")
    done = run(*arguments, cwd=tmp_path)
    assert done.exit_code == 2
    assert message in done.stderr
    if "valid" in message:
        assert all(name in done.stderr for name in (*TARGETS, "all"))
    assert done.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]
