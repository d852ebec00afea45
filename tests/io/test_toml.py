"""TOML: what is written reads back; what is wrong is said, all at once, with what is valid."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field

from clearway.base.errors import InputError
from clearway.io.toml import Section, parse_model, read_model
from clearway.io.toml_writing import dump_toml, write_toml

Three = Annotated[tuple[float, float, float], Field(strict=False)]


class Ball(Section):
    position_m: Three
    kind: Literal["ball", "cuboid"] = "ball"
    radius_m: float = Field(default=1.0, gt=0.0)
    count: int = 1


class World(Section):
    name: str = "world"
    span_deg: float | Annotated[tuple[float, ...], Field(strict=False)] = 45.0
    ball: Annotated[tuple[Ball, ...], Field(strict=False)] = ()
    home: Ball | None = None


def problems_of(data: dict[str, Any]) -> list[str]:
    with pytest.raises(InputError) as caught:
        parse_model("file.toml", data, World)
    assert str(caught.value).startswith("file.toml: ")
    return list(caught.value.problems)


def test_reads_a_good_file(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("span_deg = [-10, 20]\n[[ball]]\nposition_m = [1, 2.5, 3]\ncount = 2\n")
    world = read_model(path, World)
    assert world.span_deg == (-10.0, 20.0)
    assert world.ball == (Ball(position_m=(1.0, 2.5, 3.0), count=2),)


def test_every_problem_of_a_file_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(
        "nmae = 'x'\nspan_deg = 'wide'\n"
        "[[ball]]\nposition_m = [1, 2]\ncount = 1.5\n"
        "[[ball]]\nposition_m = [1, 2, nan]\nkind = 'cubiod'\nradius_m = 0\ncolour = 3\n"
        "[home]\nradius_m = true\n"
    )
    with pytest.raises(InputError) as caught:
        read_model(path, World)
    expected = [
        "nmae: unknown key (did you mean 'name'?); valid keys: ball, home, name, span_deg",
        'span_deg: should be a valid number or a list, got "wide"',
        "ball[0].position_m[2]: missing, but needed",
        "ball[0].count: should be a valid integer, got 1.5",
        "ball[1].position_m[2]: should be a finite number, got NaN",
        "ball[1].kind: should be 'ball' or 'cuboid' (did you mean 'cuboid'?), got \"cubiod\"",
        "ball[1].radius_m: should be greater than 0, got 0",
        "ball[1].colour: unknown key; valid keys: count, kind, position_m, radius_m",
        "home.position_m: missing, but needed",
        "home.radius_m: should be a valid number, got true",
    ]
    assert sorted(caught.value.problems) == sorted(expected)
    told = str(caught.value).count(str(path)) - 1
    assert str(caught.value).splitlines()[-1] == f"{path}: and {len(expected) - told} more"


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        ({"ball": 3}, "ball: should be a list, got 3"),
        ({"ball": [3]}, "ball[0]: should be a table, got 3"),
        ({"home": "here"}, 'home: should be a table, got "here"'),
        ({"span_deg": math.inf}, "span_deg: should be a finite number"),
        ({"name": 3}, "name: should be a valid string, got 3"),
        ({"span_deg": [1.0, "2"]}, 'span_deg[1]: should be a valid number, got "2"'),
    ],
)
def test_wrong_types(data: dict[str, Any], problem: str) -> None:
    assert any(line.startswith(problem) for line in problems_of(data))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"[grid\nlayers = 3", r"no valid TOML: .*line 1"),
        (b"a = 1\na = 2\n", r"no valid TOML: .*line 2"),
        (b"a = 1\nb = \n", r"no valid TOML: .*line 2"),
        (b"\xff\xfe", "not UTF-8"),
        (b"a = " + b"[" * 100_000, "no valid TOML"),
    ],
)
def test_files_that_are_no_toml(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_model(path, World)
    assert str(path) in str(caught.value)


def test_absent_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent\.toml: cannot be read: No such file"):
        read_model(tmp_path / "absent.toml", World)


values = st.recursive(
    st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.text(st.characters(exclude_categories=["Cs"])),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text(st.characters(exclude_categories=["Cs"])), inner, max_size=4)
    ),
    max_leaves=20,
)


@settings(deadline=None, max_examples=200)
@given(st.dictionaries(st.text(st.characters(exclude_categories=["Cs"])), values, max_size=5))
def test_what_is_written_reads_back(data: dict[str, Any]) -> None:
    assert tomllib.loads(dump_toml(data)) == data


def test_nan_and_none_and_paths(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    write_toml({"a": math.nan, "b": None, "c": {"d": None}, "e": Path("x"), "f": (1, 2.0)}, path)
    read = tomllib.loads(path.read_text())
    assert math.isnan(read.pop("a"))
    assert read == {"c": {}, "e": "x", "f": [1, 2.0]}


def test_a_written_model_reads_back(tmp_path: Path) -> None:
    world = World(span_deg=(1.0, 2.0), ball=(Ball(position_m=(1, 2, 3)),) * 2, home=None)
    write_toml(world, tmp_path / "a.toml")
    assert read_model(tmp_path / "a.toml", World) == world


@pytest.mark.parametrize("points", ["[[1, 2]]", '[["a", 2, 3]]', "[[nan, 2, 3]]", "[[1, 2, 3, 4]]"])
def test_a_list_of_wrong_entries_is_not_called_too_short(tmp_path, points):
    from clearway.missions.mission_file import MissionFile

    path = tmp_path / "mission.toml"
    path.write_text(f'[mission]\nname = "x"\nwaypoints_m = {points}\n')
    with pytest.raises(InputError) as caught:
        read_model(path, MissionFile)
    assert len(caught.value.problems) == 1
    path.write_text('[mission]\nname = "x"\nwaypoints_m = []\n')
    with pytest.raises(InputError, match="should have at least 1 item, not 0, got"):
        read_model(path, MissionFile)


def test_a_number_too_long_to_read_is_told_without_advice_to_programmers(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(f"span_deg = {'9' * 5001}\n")
    with pytest.raises(InputError) as caught:
        read_model(path, World)
    assert str(caught.value) == f"{path}: no valid TOML: a number of 5001 digits"
