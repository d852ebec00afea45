"""Mission and scene files with one wrong value: a mission, or every problem named, never worse."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.io.samples.plans import write_plan_sample
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile, list_built_in_missions
from clearway.missions.scene_reading import scene_of
from in_process import clearway
from repository import REPOSITORY

SCENES = REPOSITORY / "examples" / "scenes"
MISSIONS = {
    name: parse_model(name, tomllib.loads(file.read_text()), MissionFile).effective()
    for name, file in list_built_in_missions().items()
}
NONSENSE = st.one_of(
    st.floats(),
    st.integers(),
    st.text(max_size=3),
    st.booleans(),
    st.lists(st.floats(), max_size=4),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
)


def places(tables: Any, before: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where values stand in nested tables and lists."""
    inner: list[tuple[Any, Any]] = []
    if isinstance(tables, dict):
        inner = list(tables.items())
    elif isinstance(tables, list | tuple):
        inner = list(enumerate(tables))
    found = [before] if before else []
    return found + [place for key, value in inner for place in places(value, (*before, key))]


def with_value(tables: Any, place: tuple[Any, ...], value: Any) -> Any:
    changed = copy.deepcopy(tables)
    changed = list(changed) if isinstance(changed, tuple) else changed
    key, rest = place[0], place[1:]
    changed[key] = with_value(changed[key], rest, value) if rest else value
    return changed


@settings(max_examples=250, deadline=None)
@given(data=st.data(), name=st.sampled_from(sorted(MISSIONS)), value=NONSENSE)
def test_a_mission_with_a_wrong_value_is_flown_or_refused(
    data: st.DataObject, name: str, value: Any
) -> None:
    place = data.draw(st.sampled_from(places(MISSIONS[name])))
    tables = with_value(MISSIONS[name], place, value)
    said = ""
    try:
        mission = parse_model("wrong.toml", tables, MissionFile)
        flown = mission.to_mission()
    except InputError as error:
        said = str(error)
    if said:
        assert said.startswith(("wrong.toml: ", "mission "))
        return
    assert flown.straight_length_m < 1e9
    mission.grid.to_grid()
    mission.to_avoidance()


@settings(max_examples=100, deadline=None)
@given(
    data=st.data(),
    name=st.sampled_from(sorted(path.name for path in SCENES.glob("*.toml"))),
    value=NONSENSE,
)
def test_a_scene_with_a_wrong_value_is_read_or_refused(
    data: st.DataObject, name: str, value: Any
) -> None:
    right = tomllib.loads((SCENES / name).read_text()) or {"grid": {"layers": 5}}
    tables = with_value(right, data.draw(st.sampled_from(places(right))), value)
    said = "wrong.toml: "
    try:
        scene_of("wrong.toml", tables, Path(), "wrong")
    except InputError as error:
        said = str(error)
    assert said.startswith("wrong.toml: ")


@pytest.mark.parametrize(
    "origin",
    [[7, 500, 100], [95, 7, 0], [-91, 0, 0], [7, 181, 0], [50, 7, 1e12]],
)
@pytest.mark.parametrize("plan", [(), ("plan",)])
def test_an_origin_that_is_no_place_is_refused(
    origin: list[float], plan: tuple[str, ...], tmp_path: Path
) -> None:
    write_plan_sample(tmp_path / "a.plan", np.random.default_rng(0))
    way = 'plan = "a.plan"' if plan else 'name = "geo"\nwaypoints_m = [[9, 0, 0]]'
    (tmp_path / "geo.toml").write_text(f"[mission]\n{way}\norigin_geodetic = {origin}\n")
    done = clearway("fly", "geo.toml", "--no-plots", "--no-mcap", cwd=tmp_path)
    assert done.returncode == 2, done.stdout
    assert "geo.toml: mission.origin_geodetic: [" in done.stderr
    assert "valid: latitude within +-90 degrees, longitude within +-180 degrees" in done.stderr


@pytest.mark.parametrize("far_m", [1e7, 1e30])
def test_waypoints_beyond_any_map_are_refused(far_m: float) -> None:
    tables = {"mission": {"name": "far", "waypoints_m": [[0, 0, 0], [far_m, 0, 0]]}}
    with pytest.raises(InputError, match=r"waypoints_m\[1\].*from the start.*in metres\?"):
        parse_model("far.toml", tables, MissionFile)


@pytest.mark.parametrize(
    ("said", "transponder", "follows"),
    [({}, True, False), ({}, False, True), ({"follow_movers": False}, False, False)],
)
def test_movers_are_followed_where_an_intruder_is_silent(
    said: dict[str, Any], transponder: bool, follows: bool
) -> None:
    place = {"appears_s": 1, "position_m": [6, 6, 0], "velocity_mps": [0, -1, 0], "radius_m": 0.5}
    tables = {
        "mission": {"name": "silent", "waypoints_m": [[20, 0, 0]]},
        "traffic": said,
        "intruder": [{"name": "a", "transponder": transponder, **place}],
    }
    mission = parse_model("silent.toml", tables, MissionFile)
    assert mission.follows_dynamic_objects is follows
    assert parse_model("again", mission.effective(), MissionFile).follows_dynamic_objects is follows
