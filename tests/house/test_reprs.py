"""Values in a notebook: one line each, however much is in them, and a picture where one helps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import clearway as cw
from clearway.base.brief import MOST_CHARACTERS, one_line, runs
from clearway.base.errors import InputError
from clearway.base.notebook import Marks, sketch_from_above
from clearway.missions.setup import prepare
from repository import REPOSITORY

SCENES = REPOSITORY / "examples" / "scenes"
FEW = 2
"""Entries of a collection that are looked at."""


@pytest.fixture(scope="module")
def values() -> dict[str, Any]:
    """Values of every kind that the public names give."""
    file = cw.read_mission("intruders-collision").with_values("simulation", time_limit_s=3.0)
    setup = prepare(file)
    scan = cw.read_scan(SCENES / "street.pcd")
    return {
        "mission file": file,
        "setup": setup,
        "system": setup.system(),
        "run": setup.fly(),
        "recorded scan": scan,
        "scan": cw.Scan(scan.points_m, sensor="mine"),
        "assessment": cw.assess(scan),
        "scene": cw.assess(SCENES / "crossing-intruder.toml"),
        "points": cw.PointWorld(np.zeros((5000, 3)), 0.1),
        "obstacles": cw.ObstacleMap([cw.Obstacle.ball([9.0, 0, 0], 1.0, name="tree")] * 500),
        "obstacle": cw.Obstacle.ball([9.0, 0, 0], 1.0, name="tree"),
        "situation": cw.Situation(cw.State(np.zeros(3)), np.ones(3)),
        "prices": cw.Prices(*np.linspace(0.123456789, 1.0, 2), vertical=0.7),
        "settings": cw.AvoidanceSettings(
            "printed", unknown=0.123, threshold=0.789, verify=False, sigmas=4.56
        ),
        "simulation": cw.SimulationSettings(
            7,
            0.01234,
            scan_latency_s=0.5,
            state_noise_mps=0.1,
            input_noise=0.1,
            wind_mps=(1.0, 2.0, 3.0),
            gusts_mps=0.123,
        ),
        "guardian": cw.Guardian(setup.planner, cw.State(np.zeros(3))),
        "library": cw.ReachLibrary.load_or_build(setup.planner.automaton, setup.planner.grid),
        "error": InputError("/very/long/path" * 30, ["something\nis wrong " * 30] * 30),
    }


def within(value: Any, path: str, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """A value of ours and those in its fields."""
    if depth > 8:
        return
    if isinstance(value, tuple | list) and not hasattr(value, "_fields"):
        for number, one in enumerate(value[:FEW]):
            yield from within(one, f"{path}[{number}]", depth + 1)
    elif isinstance(value, dict):
        for key, one in list(value.items())[:FEW]:
            yield from within(one, f"{path}[{key!r}]", depth + 1)
    elif type(value).__module__.startswith("clearway"):
        yield path, value
        names = [field.name for field in fields(value)] if is_dataclass(value) else []
        for name in names or getattr(value, "_fields", ()):
            yield from within(getattr(value, name), f"{path}.{name}", depth + 1)


def test_every_value_is_one_short_line(values: dict[str, Any]) -> None:
    looked_at = [pair for name, value in values.items() for pair in within(value, name)]
    assert len({type(value) for _, value in looked_at}) > 40
    long = {path: text for path, value in looked_at if _bad(text := repr(value))}
    assert not long


def _bad(text: str) -> bool:
    return len(text) >= 200 or "\n" in text or " object at 0x" in text


def test_all_public_classes_were_looked_at(values: dict[str, Any]) -> None:
    seen = {type(value) for name, value in values.items() for _, value in within(value, name)}
    public = {name for name in cw.__all__ if isinstance(getattr(cw, name), type)}
    assert public - {one.__name__ for one in seen} <= {"ClearwayError"}


def test_reprs_tell_what_matters(values: dict[str, Any]) -> None:
    assert repr(values["run"]).startswith(
        "Run('intruders-collision' by clearway: not reached, 3.0 s"
    )
    assert repr(values["recorded scan"]).startswith(
        "RecordedScan('street.pcd' scan 0, 2,760 points"
    )
    assert repr(values["system"].planner.grid) == (
        "AvoidanceGrid(10 x 7 x 5 cells, 0 to 10 m, azimuth -45 to 45 deg, elevation -30 to 30 deg)"
    )
    assert repr(cw.State([1.0, 2.0, 3.0], time_s=4.0)) == "State(position_m=[1, 2, 3], time_s=4)"
    assert "and 29 more" in repr(values["error"])
    assert 400 < len(str(values["error"])) <= 500


class Nesting(HTMLParser):
    """Whether tags are closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, _attrs: object) -> None:
        self.open.append(tag)

    def handle_startendtag(self, _tag: str, _attrs: object) -> None:
        """Closes itself."""

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.mark.parametrize(
    "name", ["mission file", "run", "recorded scan", "scan", "assessment", "scene"]
)
def test_notebooks_show_a_table_and_a_sketch(name: str, values: dict[str, Any]) -> None:
    for value in (values[name], *_beside(values[name])):
        shown = value._repr_html_()
        parser = Nesting()
        parser.feed(shown)
        assert not parser.open
        assert len(shown) < 100_000
        assert "nan" not in shown


def _beside(value: Any) -> list[Any]:
    if isinstance(value, cw.Run):
        flight = value.decisions[0].flight
        return [value.mission, flight, flight.decision]
    return []


def test_a_name_that_is_markup_stays_text() -> None:
    file = cw.read_mission("static-obstacles").with_values("mission", name="<script>&")
    for value in (file, file.to_mission()):
        assert "<script>" not in value._repr_html_()
        assert "&lt;script&gt;&amp;" in value._repr_html_()


def test_a_sketch_of_nothing_is_nothing() -> None:
    assert sketch_from_above([Marks(np.zeros((0, 3)), "red")]) == ""
    assert sketch_from_above([Marks(np.full((2, 3), np.nan), "red")]) == ""
    assert sketch_from_above([Marks(np.zeros((1, 3)), "red", joined=False)]).count("<circle") >= 1


@given(st.text(), st.lists(st.text()))
def test_one_line_whatever_is_in_it(name: str, parts: list[str]) -> None:
    line = one_line("Name", [name, *parts])
    assert len(line) <= MOST_CHARACTERS
    assert len(line.splitlines()) == 1


def test_repeats_are_counted() -> None:
    assert runs(("Left", "Left", "Straight", "Left")) == "2 x Left, Straight, Left"
    assert runs(()) == ""


def test_pictures_show_themselves_in_notebooks(values: dict[str, Any]) -> None:
    figure = cw.draw_assessment(values["assessment"], "obstacle")
    assert figure._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
