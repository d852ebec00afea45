"""What the commands of a plan mean, as ArduPilot and PX4 define them: places, jumps, limits."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.io.plans.mission_order import MOST_FLOWN, in_flown_order
from clearway.io.plans.plan_items import Item, Jump, Step
from clearway.missions.mission_file import read_mission_file
from clearway.missions.planned import make_planned_tables

HOME = (-35.36, 149.16, 584.0)
EAST_M = 1e-3 * 90_897.0
"""Metres of a thousandth of a degree of longitude there."""
TAKE_OFF, WAYPOINT, LAND, RETURN, JUMP = 22, 16, 21, 20, 177


def row(
    command: int, east: float = 0.0, height_m: float = 0.0, *params: float, frame: int = 3
) -> list[float]:
    """An item `east` thousandths of a degree of longitude from home; 0 leaves the place out."""
    place = (HOME[0], HOME[1] + east / 1000.0) if east else (0.0, 0.0)
    return [0, frame, command, *(*params, 0, 0, 0, 0)[:4], *place, height_m, 1]


def written(path: Path, *rows: list[float] | str, home: Any = HOME, version: str = "110") -> Path:
    """A waypoint file; text stands as it is."""
    lines, number = [f"QGC WPL {version}"], 0
    first = [] if home is None else [[1, 0, WAYPOINT, 0, 0, 0, 0, *home, 1]]
    for one in (*first, *rows):
        if isinstance(one, str):
            lines.append(one)
            continue
        lines.append("\t".join(str(value) for value in (number, *one)))
        number += 1
    path.write_text("\n".join(lines) + "\n")
    return path


def planned(path: Path) -> tuple[Any, str]:
    """The tables of a plan, and what was said about it."""
    said: list[str] = []
    return make_planned_tables(path, None, said.append), "\n".join(said)


def steps_east(tables: Any) -> list[int]:
    """Waypoints, in thousandths of a degree of longitude from home."""
    return [round(point[0] / EAST_M) for point in tables["mission"]["waypoints_m"]]


def heights(tables: Any) -> list[float]:
    return [point[2] for point in tables["mission"]["waypoints_m"]]


# Zeros


def test_zeros_of_a_mission_of_arducopter(data_dir: Path) -> None:
    path = data_dir.parent / "bad_input" / "ardupilot_copter_mission.txt"
    if not path.is_file():
        pytest.skip(f"needs data: {path.name}")
    mission = read_mission_file(str(path))
    goals = np.array(mission.mission.waypoints_m)
    assert goals[:, 2] == pytest.approx([20, 20, 40, 20, 20, 20, 20, 20], abs=0.1)
    assert np.abs(goals[:, :2]).max() < 400.0
    assert goals[-2:] == pytest.approx(goals[[4, 5]]), "item 10 jumps to item 8 once"


@pytest.mark.parametrize("command", [16, 18, 19, 31, 36, 82])
def test_0_0_is_where_the_vehicle_is_and_height_0_is_its_height(
    command: int, tmp_path: Path
) -> None:
    rows = [row(TAKE_OFF, 0, 20.0), row(WAYPOINT, 3, 30.0), row(command), row(command, 0, 60.0)]
    tables, said = planned(written(tmp_path / "m.txt", *rows, row(WAYPOINT, 5, 0.0)))
    assert steps_east(tables) == [3, 3, 5]
    assert heights(tables) == pytest.approx([30.0, 60.0, 60.0], abs=0.1)
    assert "2 x waypoint at 0, 0: taken as where the vehicle is" in said
    assert "2 x waypoint of height 0: the height before it is kept" in said


def test_the_equator_and_the_meridian_are_places(tmp_path: Path) -> None:
    places = [(0.0, 0.001), (0.001, 0.0)]
    rows = [[0, 3, WAYPOINT, 0, 0, 0, 0, *place, 20, 1] for place in places]
    tables, said = planned(written(tmp_path / "m.txt", *rows, home=(0.0005, 0.0005, 10)))
    assert len(tables["mission"]["waypoints_m"]) == 2
    assert "0, 0" not in said


@pytest.mark.parametrize("land", [21, 85, 94])
def test_lands_here_or_at_a_place_and_passes_it_on_the_way(land: int, tmp_path: Path) -> None:
    up, there = row(TAKE_OFF, 0, 20.0), row(WAYPOINT, 4, 35.0)
    tables, _ = planned(written(tmp_path / "here.txt", up, there, row(land)))
    assert tables["mission"]["landing_m"][0] == pytest.approx((4 * EAST_M, 0, 35), abs=1.0)
    rows = [up, there, row(land, 6), row(TAKE_OFF, 0, 50.0), row(WAYPOINT, 9, 50.0), row(land)]
    tables, said = planned(written(tmp_path / "way.txt", *rows))
    assert steps_east(tables) == [4, 6, 6, 9]
    assert heights(tables) == pytest.approx([35, 35, 50, 50], abs=0.2)
    assert "1 left out: landing on the way" in said
    tables, _ = planned(written(tmp_path / "only.txt", up, row(land, 5)))
    assert steps_east(tables) == [5]


@pytest.mark.parametrize("command", [22, 84])
@pytest.mark.parametrize(("firmware", "first"), [(3, 8), (12, 5), (None, 8)])
def test_climbs_where_it_stands_and_px4_then_flies_to_the_place(
    command: int, firmware: int | None, first: int, tmp_path: Path
) -> None:
    places = [(command, 5, 40.0), (WAYPOINT, 8, 40.0)]
    items = [
        {"type": "SimpleItem", "command": one, "frame": 3, "doJumpId": number,
         "params": [0, 0, 0, None, HOME[0], HOME[1] + east / 1000.0, height]}
        for number, (one, east, height) in enumerate(places, start=1)
    ]  # fmt: skip
    mission = {"plannedHomePosition": HOME, "items": items, "firmwareType": firmware}
    path = tmp_path / "vtol.plan"
    path.write_text(json.dumps({"fileType": "Plan", "mission": mission}))
    tables, said = planned(path)
    assert tables["vehicle"]["position_m"] == pytest.approx((0, 0, 40), abs=0.1)
    assert steps_east(tables)[0] == first
    assert ("place of a take-off: ArduPilot climbs" in said) == (first == 8)


def test_a_take_off_without_a_height_climbs_to_the_first_waypoint(tmp_path: Path) -> None:
    tables, _ = planned(written(tmp_path / "m.txt", row(TAKE_OFF), row(WAYPOINT, 3, 25.0)))
    assert tables["vehicle"]["position_m"] == pytest.approx((0, 0, 25), abs=0.1)


@pytest.mark.parametrize(
    ("frame", "stated"), [(0, 604.0), (2, 604.0), (5, 604.0), (3, 20.0), (6, 20.0), (10, 20.0)]
)
def test_heights_of_every_frame(frame: int, stated: float, tmp_path: Path) -> None:
    tables, _ = planned(written(tmp_path / "m.txt", row(WAYPOINT, 1, stated, frame=frame)))
    assert heights(tables) == pytest.approx([20.0], abs=0.01)


def test_nothing_is_flown_after_a_return_or_a_loiter_without_end(tmp_path: Path) -> None:
    for command in (17, RETURN):
        rows = [row(WAYPOINT, 2, 20.0), row(command, 4, 20.0), row(WAYPOINT, 6, 20.0)]
        tables, said = planned(written(tmp_path / "m.txt", *rows))
        assert steps_east(tables) == ([2, 4] if command == 17 else [2])
        assert "line 4: the mission ends there; 1 x item to fly to after it left out" in said


def test_what_leads_nowhere_is_counted_by_name(tmp_path: Path) -> None:
    others = [row(command, 0, 0.0, 5.0) for command in (93, 112, 115, 115, 183, 203, 31_000)]
    _, said = planned(written(tmp_path / "m.txt", row(WAYPOINT, 2, 20.0), *others))
    assert "1 left out: waiting" in said
    assert "2 left out: command 115 (CONDITION_YAW), which leads nowhere" in said
    assert "1 left out: command 183 (DO_SET_SERVO)" in said
    assert "1 left out: command 31000, which leads nowhere" in said


def test_the_speed_is_that_of_flight_and_not_of_climbs(tmp_path: Path) -> None:
    rows = [row(178, 0, 0.0, 2.0, 3.0), row(TAKE_OFF, 0, 20.0), row(178, 0, 0.0, 1.0, 8.0)]
    later = row(178, 0, 0.0, 1.0, 12.0)
    tables, said = planned(written(tmp_path / "m.txt", *rows, row(WAYPOINT, 3, 20.0), later))
    assert tables["vehicle"]["speed_mps"] == 8.0
    assert "2 left out: command 178 (DO_CHANGE_SPEED)" in said


# The form of the file


def test_comments_and_empty_lines_are_passed_over(tmp_path: Path) -> None:
    path = written(tmp_path / "m.txt", "# up", row(TAKE_OFF, 0, 20.0), "", row(WAYPOINT, 3, 20.0))
    path.write_text("# saved by hand\n\n" + path.read_text() + "# end\n")
    assert steps_east(planned(path)[0]) == [3]
    path.write_text(path.read_text().replace("\n", "\r\n"))
    assert steps_east(planned(path)[0]) == [3]


def test_a_version_without_home_begins_at_its_first_place(tmp_path: Path) -> None:
    rows = [row(TAKE_OFF, 2, 20.0), row(WAYPOINT, 5, 20.0), row(JUMP, 0, 0.0, 1.0, 1.0)]
    tables, said = planned(written(tmp_path / "m.txt", *rows, home=None, version="120"))
    assert tables["mission"]["origin_geodetic"] == pytest.approx((HOME[0], HOME[1] + 0.002, 0.0))
    assert steps_east(tables) == [3]
    assert "home is not set" in said


# Jumps


def jumping(tmp_path: Path, *rows: list[float]) -> tuple[list[int], str]:
    tables, said = planned(written(tmp_path / "m.txt", row(TAKE_OFF, 0, 20.0), *rows))
    return steps_east(tables), said


def test_a_jump_repeats_what_lies_between(tmp_path: Path) -> None:
    legs = [row(WAYPOINT, 2, 20.0), row(WAYPOINT, 4, 20.0)]
    flown, said = jumping(tmp_path, *legs, row(JUMP, 0, 0, 2, 2), row(WAYPOINT, 6, 20.0))
    assert flown == [2, 4, 2, 4, 2, 4, 6]
    assert "line 6: jumps to item 2, 2 x" in said
    flown, said = jumping(tmp_path, *legs, row(JUMP, 0, 0, 2, 0), row(WAYPOINT, 6, 20.0))
    assert flown == [2, 4, 6]
    assert "0 x: never taken" in said
    flown, _ = jumping(tmp_path, row(JUMP, 0, 0, 4, -1), *legs)
    assert flown == [4], "a jump ahead"


def test_a_jump_for_ever_is_bounded_and_said(tmp_path: Path) -> None:
    legs = [row(WAYPOINT, 2, 20.0), row(WAYPOINT, 4, 20.0), row(JUMP, 0, 0, 2, -1)]
    flown, said = jumping(tmp_path, *legs, row(WAYPOINT, 6, 20.0))
    assert flown == [2, 4, 2, 4, 6]
    assert "line 6: jumps back to item 2 for ever: taken 1 x, then the flight goes on" in said


def test_an_inner_jump_that_is_used_up_stays_so(tmp_path: Path) -> None:
    rows = [row(WAYPOINT, 2, 20.0), row(WAYPOINT, 4, 20.0), row(JUMP, 0, 0, 2, 1)]
    flown, _ = jumping(tmp_path, *rows, row(WAYPOINT, 6, 20.0), row(JUMP, 0, 0, 2, 1))
    assert flown == [2, 4, 2, 4, 6, 2, 4, 6]


def test_a_jump_to_a_tag(tmp_path: Path) -> None:
    rows = [row(600, 0, 0, 7), row(WAYPOINT, 2, 20.0), row(WAYPOINT, 4, 20.0)]
    assert jumping(tmp_path, *rows, row(601, 0, 0, 7, 1))[0] == [2, 4, 2, 4]


def test_jumps_of_a_plan_count_by_its_own_numbers(tmp_path: Path) -> None:
    places = [(TAKE_OFF, 0), (WAYPOINT, 2), (WAYPOINT, 4), (JUMP, 0)]
    items: list[Any] = [
        {"type": "SimpleItem", "command": one, "frame": 3, "doJumpId": 10 * number,
         "params": [20, 1, 0, 0, HOME[0], HOME[1] + east / 1000.0, 20]}
        for number, (one, east) in enumerate(places, start=1)
    ]  # fmt: skip
    items[3]["frame"] = 2
    mission = {"plannedHomePosition": HOME, "items": items}
    (tmp_path / "m.plan").write_text(json.dumps({"fileType": "Plan", "mission": mission}))
    assert steps_east(planned(tmp_path / "m.plan")[0]) == [2, 4, 2, 4]


@pytest.mark.parametrize(
    ("rows", "cause"),
    [
        ([row(JUMP, 0, 0, 3, 1)], "line 5: item 3 jumps to item 3, which is itself"),
        ([row(JUMP, 0, 0, 9, 1)], "line 5: item 3 jumps to item 9, which is not in the plan"),
        ([row(JUMP, 0, 0, 0, 1)], "jumps to item 0, which is not in the plan; valid: items 1 to 3"),
        ([row(601, 0, 0, 5, 1)], "item 3 jumps to tag 5, which is not in the plan; valid: no tags"),
        ([row(JUMP, 0, 0, 2.5, 1)], "line 5: the target of the jump is 2.5"),
        ([row(JUMP, 0, 0, 2, -3)], "line 5: -3 repeats; valid: -1 (for ever), 0 or more"),
        ([row(JUMP, 0, 0, 2, float("nan"))], "line 5: the number of repeats is missing"),
        ([row(183), row(JUMP, 0, 0, 3, -1)], "item 4 jumps to item 3 for ever, and nothing"),
        ([row(JUMP, 0, 0, 2, 30_000)], "line 5: with its repeats more than 20,000 items"),
        ([row(JUMP, 0, 0, 2, 1e300)], "line 5: with its repeats more than 20,000 items"),
    ],
)
def test_jumps_that_cannot_be_flown_name_the_item(
    rows: list[Any], cause: str, tmp_path: Path
) -> None:
    path = written(tmp_path / "m.txt", row(TAKE_OFF, 0, 20), row(WAYPOINT, 2, 20), *rows)
    with pytest.raises(InputError) as refused:
        planned(path)
    assert cause in str(refused.value)


ENTRIES = st.lists(
    st.one_of(
        st.just(None),
        st.integers(0, 14).map(lambda at: ("jump", at)),
        st.integers(0, 14).map(lambda at: ("for ever", at)),
        st.just(("item", 0)),
    ),
    min_size=1,
    max_size=14,
)


@settings(max_examples=300, deadline=None)
@given(ENTRIES, st.sampled_from([0, 1, 3, 200, 32_767]))
def test_every_tangle_of_jumps_ends(entries: list[Any], repeats: int) -> None:
    steps = []
    for number, entry in enumerate(entries):
        does: Item | Jump | None = None
        if entry is not None and entry[0] == "item":
            does = Item(f"line {number}", "waypoint", 1.0, 1.0, 20.0, "home")
        elif entry is not None:
            count = -1 if entry[0] == "for ever" else repeats
            does = Jump(f"line {number}", entry[1], count, tagged=False)
        steps.append(Step(number, does))
    order = in_flown_order(steps)
    assert len(order.items) <= MOST_FLOWN + 1
    places = [int(one.place.split()[1]) for one in order.items]
    back = sum(after <= before for before, after in pairwise(places))
    assert order.problems or back == 0 or any(isinstance(one.does, Jump) for one in steps)
    assert all(problem.startswith("line") for problem in order.problems)


# Fences and rally points


CORNER_LINES = "-35.35 149.15\n-35.34 149.14\n-35.38 149.14\n-35.38 149.19\n-35.34 149.19\n"


def fence_rows(command: int = 5001, corners: int = 3) -> list[list[float]]:
    places = [(-35.37, 149.15), (-35.35, 149.15), (-35.36, 149.18)]
    return [[0, 0, command, corners, 0, 0, 0, *place, 0, 1] for place in places]


@pytest.mark.parametrize(
    ("name", "kind"),
    [("f.waypoints", "wpl"), ("f.txt", "wpl"), ("f.fen", "lines"), ("f.txt", "lines")],
)
def test_a_file_of_fences_is_told_what_it_is(name: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / name
    if kind == "wpl":
        written(path, *fence_rows(), home=None)
    else:
        path.write_text("# saved by Mission Planner\n" + CORNER_LINES)
    with pytest.raises(InputError) as refused:
        planned(path)
    assert "no waypoint in it: it holds limits of a flight (1 x fence, 0 x rally point)" in str(
        refused.value
    )


@pytest.mark.parametrize("kind", ["wpl", "lines"])
def test_a_mission_with_waypoints_keeps_to_the_fences_of_a_file(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("shapely")
    if kind == "wpl":
        written(tmp_path / "keep.fen.txt", *fence_rows(), home=None)
    else:
        (tmp_path / "keep.fen.txt").write_text(CORNER_LINES)
    path = tmp_path / "own.toml"
    path.write_text(
        f'[mission]\nplan = "keep.fen.txt"\norigin_geodetic = {list(HOME)}\n'
        "waypoints_m = [[100, 0, 30]]\n"
    )
    mission = read_mission_file(str(path))
    walls = [one for one in mission.obstacle if one.name.startswith("fence 0")]
    assert len(walls) == (3 if kind == "wpl" else 4)
    assert {one.known for one in walls} == {"map"}


def test_fences_in_a_mission_file_are_kept_to(tmp_path: Path) -> None:
    pytest.importorskip("shapely")
    circle = [0, 0, 5004, 80.0, 0, 0, 0, -35.362, 149.165, 0, 1]
    home_circle = [0, 0, 5005, 50, 0, 0, 0, 0, 0, 0, 1]
    path = written(tmp_path / "m.txt", row(WAYPOINT, 1, 20.0), *fence_rows(), circle, home_circle)
    tables, said = planned(path)
    names = [one["name"] for one in tables["obstacle"]]
    assert sum(name.startswith("fence 0") for name in names) == 3
    assert any(name.startswith("round fence 1") for name in names)
    assert "1 left out: command 5005, which is not kept to" in said


@pytest.mark.parametrize(
    ("rows", "cause"),
    [
        (fence_rows(corners=4), "a fence of 4 corners has 3"),
        ([[0, 0, 5003, -5, 0, 0, 0, -35.3, 149.1, 0, 1]], "radius -5 m"),
        ([[0, 0, 5001, 3, 0, 0, 0, 99, 149.1, 0, 1]], "latitude 99"),
    ],
)
def test_bad_fences_name_what_is_wrong(rows: list[Any], cause: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        planned(written(tmp_path / "m.txt", *rows, home=None))
    assert cause in str(refused.value)


@pytest.mark.parametrize("name", ["r.ral", "r.txt"])
def test_a_file_of_rally_points_is_told_what_it_is(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text("# saved\nRALLY\t-35.36\t149.16\t40\t0\t0\t0\n")
    with pytest.raises(InputError, match="no waypoint in it: it holds 1 x rally point"):
        planned(path)
    path.write_text("RALLY -35.36 149.16\nRALLY 99 149 3\n")
    with pytest.raises(InputError) as refused:
        planned(path)
    assert "line 1: 3 of 4 columns" in str(refused.value)
    assert "line 2: latitude 99" in str(refused.value)


def test_a_mission_returns_to_its_own_rally_points(tmp_path: Path) -> None:
    rally = [0, 3, 5100, 0, 0, 0, 0, HOME[0], HOME[1] + 0.004, 45.0, 1]
    path = written(tmp_path / "m.txt", row(WAYPOINT, 5, 20.0), row(RETURN), rally)
    tables, said = planned(path)
    assert tables["mission"]["landing_m"][0] == pytest.approx((4 * EAST_M, 0, 45), abs=1.0)
    assert "nearest of 1 rally points" in said
