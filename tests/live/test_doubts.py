"""What is said before take-off of what a flight asks for and may not get, and where it holds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import clearway as cw
from clearway.live.preflight.doubts import over_reach, over_wide_margin
from clearway.missions.mission_file import list_built_in_missions, read_mission_file
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.sim.worlds import WORLD_FAMILIES
from in_process import clearway
from repository import REPOSITORY

EXAMPLES = sorted((REPOSITORY / "examples" / "missions").rglob("*.toml"))
FAST = """
[mission]
name = "fast"
waypoints_m = [[120, 60, 0], [10, 130, 10], [-120, 20, -10]]
reach_radius_m = {reach}

[vehicle]
speed_mps = 7.5
body_radius_m = 2

[grid]
range_m = 75

[safety]
margin_m = {margin}
escape = "{escape}"

[[lidar]]
beams_per_cell = [6, 3]
max_range_m = 90
"""
MISSED = (
    "mission.reach_radius_m: 1.5 m is less than half a movement of 7.5 m; waypoints may be missed, "
    "and circled for ever; 3.75 m or more would do as a rule"
)
WIDE = "; a margin of 9.1 m, over 1.2 times a movement of 7.5 m, may be lost to what shows late"


def fast(folder: Path, reach: float = 4.0, margin: float = 4.0, escape: str = "strict") -> Path:
    path = folder / "fast.toml"
    path.write_text(FAST.format(reach=reach, margin=margin, escape=escape))
    return path


@pytest.mark.parametrize("reach", [1.5, 4.0])
def test_waypoints_that_are_circled_for_ever_are_told_of_before(reach: float, tmp_path) -> None:
    done = clearway("fly", fast(tmp_path, reach), "--no-plots", "--no-mcap", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert (MISSED in told["notes"]) == (MISSED in done.stderr.splitlines()) == (reach < 3.75)
    assert told["reached"] == (reach >= 3.75), told["waypoints_reached"]
    assert WIDE[:20] not in done.stderr


def test_a_plane_that_turns_wide_needs_more_than_half_a_movement() -> None:
    wide = cw.MovementAutomaton.plane(7.5, turn_step_deg=7.5)
    goals = {"waypoints_m": [[200.0, 0.0, 0.0]]}
    for reach, told in ((7.1, True), (7.2, False)):
        mission = cw.Mission("wide", cw.State([0.0] * 3), **goals, reach_radius_m=reach)
        doubt = over_reach(mission, wide)
        assert (doubt is not None) == told
        assert doubt is None or "an eighth of the turning radius of 57.3 m" in doubt


@pytest.mark.parametrize(
    ("margin", "escape", "told"),
    [
        (9.1, "strict", True),
        (8.9, "strict", False),
        (9.1, "mapped", True),
        (9.1, "known", False),
        (9.1, "off", False),
    ],
)
def test_a_margin_that_may_be_lost_is_told_of(
    margin: float, escape: str, told: bool, tmp_path: Path
) -> None:
    path = fast(tmp_path, margin=margin, escape=escape)
    if escape == "mapped":
        path.write_text(path.read_text() + "[map]\ncomplete = true\n")
    setup = prepare(read_mission_file(str(path)))
    assert str(setup.escape).startswith(f'escape "{escape}"')
    assert str(setup.escape).endswith(WIDE) == told
    assert setup.system().escape.why == setup.escape.why


def test_where_the_unseen_is_kept_as_far_off_no_margin_is_lost(tmp_path: Path) -> None:
    path = fast(tmp_path, margin=9.1)
    path.write_text(path.read_text().replace("body_radius_m = 2", "body_radius_m = 9.1"))
    assert "may be lost" not in prepare(read_mission_file(str(path))).escape.why


@pytest.mark.parametrize(
    "name", [*list_built_in_missions(), *(f"{one}:0" for one in WORLD_FAMILIES), *EXAMPLES], ids=str
)
def test_nothing_is_doubted_of_missions_that_ship(name: str | Path) -> None:
    """Without the places and recordings of some, which change neither movements nor margins."""
    file = read_mission(name)
    traffic = file.traffic.model_copy(update={"recording": None})
    file = file.model_copy(update={"map": None, "point_cloud": None, "traffic": traffic})
    setup = prepare(file)
    assert setup.doubts == ()
    assert over_wide_margin(setup.planner, file.safety.escape) == ""


@pytest.mark.parametrize(("lost", "said"), [(0.9, False), (0.97, True)])
def test_returns_that_are_nearly_all_lost_are_told_of_before(lost: float, said: bool) -> None:
    file = read_mission_file("static-obstacles")
    lidar = tuple(one.model_copy(update={"dropout": lost}) for one in file.lidar)
    why = prepare(file.model_copy(update={"lidar": lidar})).escape.why
    told = f"; {100 * lost:g} % of returns are lost: what whole sweeps miss passes for free"
    assert (told in why) == said
    off = file.model_copy(update={"lidar": lidar}).with_values("safety", escape="off")
    assert "are lost" not in prepare(off).escape.why
