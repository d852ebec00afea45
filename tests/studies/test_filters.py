"""The safety filters that the guardian is compared with: laws, bad input, and their tables."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.filters.__main__ import main
from benchmarks.filters.backup_cbf import BackupCbf
from benchmarks.filters.flight import FlightRow, fly
from benchmarks.filters.gatekeeper import Gatekeeper
from benchmarks.filters.methods import METHODS, Peers
from benchmarks.filters.page import better_table, flown_by_all, method_table, write_page
from benchmarks.filters.peer import PeerProcess
from benchmarks.filters.pilots import PILOTS
from benchmarks.filters.protocol import (
    TICK_S,
    Command,
    Copter,
    Own,
    SafetyFilter,
    Unfiltered,
)
from benchmarks.filters.qp import acceleration_limits, nearest_kept
from benchmarks.filters.rollouts import Motion, roll_to, roll_to_stop
from benchmarks.filters.shielding import ModelPredictiveShield
from benchmarks.filters.surroundings import KnownMap
from benchmarks.filters.worlds import SPEED_MPS, make_course

from clearway.base.errors import ClearwayError, InputError
from clearway.live.link.set_point import SetPoint
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap

COPTER = Copter(acceleration_mps2=2.8, speed_mps=5.0, margin_m=0.6, body_m=0.2)
OURS = {"mps": ModelPredictiveShield, "gatekeeper": Gatekeeper, "backup-cbf": BackupCbf}
WALL = ObstacleMap([Obstacle.cuboid([16.0, 0.0, 0.0], (2.0, 200.0, 200.0))])
PILLAR = ObstacleMap([Obstacle.ball([15.0, 0.4, 0.0], 1.0)])


def moved(command: Command, own: Own) -> Own:
    """A tick of the model that the filters count on: velocity changes at a bounded rate."""
    target, most = command.target, COPTER.acceleration_mps2
    if isinstance(target, SetPoint) and target.acceleration_mps2 is not None:
        change = target.acceleration_mps2 * TICK_S
    else:
        wished = np.zeros(3) if target.velocity_mps is None else target.velocity_mps
        change = wished - own.velocity_mps
    change = change * min(1.0, most * TICK_S / max(float(np.linalg.norm(change)), 1e-9))
    after = own.velocity_mps + change
    place = own.position_m + 0.5 * TICK_S * (own.velocity_mps + after)
    return Own(own.time_s + TICK_S, place, after, 0.0)


def flown(one: SafetyFilter, world: ObstacleMap, wish: np.ndarray, ticks: int) -> list[Own]:
    own, known = Own(0.0, np.zeros(3), np.zeros(3), 0.0), KnownMap(world)
    track = [own]
    for _ in range(ticks):
        one.look(own, known)
        own = moved(one.command(own, wish, known), own)
        track.append(own)
    return track


@pytest.mark.parametrize("name", OURS)
@pytest.mark.parametrize("angle_deg", [0.0, 40.0, -65.0])
def test_who_flies_at_a_wall_keeps_the_margin_and_comes_near(name: str, angle_deg: float) -> None:
    angle = np.radians(angle_deg)
    wish = 5.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
    track = flown(OURS[name](COPTER), WALL, wish, 400)
    gaps = np.array([15.0 - own.position_m[0] for own in track])
    assert gaps.min() >= COPTER.margin_m
    assert gaps.min() <= COPTER.margin_m + 1.5
    assert max(float(np.linalg.norm(own.velocity_mps)) for own in track) >= 4.5


@pytest.mark.parametrize("name", OURS)
def test_a_pillar_off_the_middle_of_the_way_is_kept_clear_of(name: str) -> None:
    track = flown(OURS[name](COPTER), PILLAR, np.array([5.0, 0.0, 0.0]), 200)
    places = np.array([own.position_m for own in track])
    assert PILLAR.distance_m(places).min() >= COPTER.margin_m


@pytest.mark.parametrize("name", OURS)
def test_what_is_safe_passes_unchanged(name: str) -> None:
    own, known = Own(0.0, np.zeros(3), np.array([2.0, 0.0, 0.0]), 0.0), KnownMap(WALL)
    for wish in ([2.0, 0.0, 0.0], [-5.0, 1.0, 0.0], [0.0, 4.0, 0.0]):
        command = OURS[name](COPTER).command(own, np.array(wish), known)
        assert command.passed
        assert command.target.velocity_mps is not None
        np.testing.assert_array_equal(command.target.velocity_mps, wish)


def test_without_a_filter_the_wall_is_hit() -> None:
    track = flown(Unfiltered(), WALL, np.array([5.0, 0.0, 0.0]), 100)
    assert track[-1].position_m[0] > 15.0


@pytest.mark.parametrize("name", [*OURS, "unfiltered", "guardian"])
@pytest.mark.parametrize("wish", [[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0], [1.0, 0.0]])
def test_what_is_no_wish_is_refused(name: str, wish: list[float]) -> None:
    from benchmarks.filters.guarded import GuardianFilter

    own = Own(0.0, np.zeros(3), np.zeros(3), 0.0)
    one: SafetyFilter = Unfiltered()
    if name == "guardian":
        one = GuardianFilter.__new__(GuardianFilter)  # The wish is looked at before all else.
    elif name in OURS:
        one = OURS[name](COPTER)
    with pytest.raises(InputError, match="three finite numbers"):
        one.command(own, np.array(wish), KnownMap(WALL))


def test_braking_takes_the_distance_of_the_textbook() -> None:
    begin = Motion(np.zeros(3), np.array([3.0, 4.0, 0.0]))
    stopped = roll_to_stop(begin, 2.5)
    assert np.linalg.norm(stopped.end.position_m) == pytest.approx(25.0 / 5.0)
    np.testing.assert_allclose(stopped.end.velocity_mps, 0.0, atol=1e-12)
    led = roll_to(begin, np.array([-1.0, 0.0, 0.0]), 2.5, 60)
    steps = np.linalg.norm(np.diff(led.velocity_mps, axis=0), axis=1)
    assert steps.max() <= 2.5 * TICK_S + 1e-12
    np.testing.assert_allclose(
        np.diff(led.position_m, axis=0),
        0.5 * TICK_S * (led.velocity_mps[1:] + led.velocity_mps[:-1]),
        atol=2.5 * TICK_S**2,
    )


def test_the_nearest_command_is_a_projection_and_contradictions_are_told() -> None:
    rows, least = acceleration_limits(2.0)
    wished = np.array([1.0, 0.5, 0.0])
    assert nearest_kept(wished, rows, least) is wished
    wall = np.array([[-1.0, 0.0, 0.0]])
    found = nearest_kept(wished, np.vstack([rows, wall]), np.append(least, 0.25))
    assert found is not None
    np.testing.assert_allclose(found, [-0.25, 0.5, 0.0], atol=1e-9)
    assert nearest_kept(wished, np.vstack([rows, wall]), np.append(least, 3.0)) is None


@pytest.mark.parametrize("name", PILOTS)
def test_pilots_wish_level_velocities_and_repeat_themselves(name: str) -> None:
    course = make_course("walls", 3)
    heard = []
    for _ in range(2):
        pilot = PILOTS[name](course, np.random.default_rng([3, 171]))
        own = Own(0.0, course.start_m, np.zeros(3), 0.0)
        wishes = []
        for tick in range(60):
            wishes.append(pilot.wish(own))
            place = own.position_m + TICK_S * wishes[-1]
            own = Own(TICK_S * (tick + 1), place, wishes[-1], 0.0)
        heard.append(np.array(wishes))
    np.testing.assert_array_equal(*heard)
    assert not heard[0][:, 2].any()
    assert np.linalg.norm(heard[0], axis=1).max() <= SPEED_MPS + 1e-9


def test_a_peer_whose_environment_is_incomplete_is_told() -> None:
    process = PeerProcess(Path(sys.executable), "fly_cbfpy.py")  # cbfpy is never beside clearway.
    with pytest.raises(ClearwayError, match=r"fly_cbfpy.py: ended"):
        process.ask({})
    process.end()
    with pytest.raises(ClearwayError, match="--python"):
        Peers(None).process("fly_cbfpy.py")


def test_options_that_do_not_exist_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["--method", "wishful"])
    assert "gatekeeper" in capsys.readouterr().err


def row(pilot: str, method: str, seed: int = 0, **came: float | bool) -> FlightRow:
    known = {"nearest_m": 1.0, "commands": 10, "call_ms": [1.0, 2.0]}
    return FlightRow("walls", seed, pilot, method, **(known | came))  # type: ignore[arg-type]


ROWS = [
    row("straight", "guardian", changed=4, change_mps=2.0),
    row("straight", "mps", arrived=True, changed=2, change_mps=1.0, call_ms=[0.5, 0.5]),
    row("straight", "guardian", seed=1, changed=4, change_mps=2.0),
    row("straight", "mps", seed=1, contact=True, nearest_m=0.1, call_ms=[0.5, 0.5]),
    row("random", "guardian", seed=2),
]


def test_only_cases_that_all_have_flown_count() -> None:
    assert len(flown_by_all(ROWS)) == 4


def test_tables_count_with_intervals_and_show_where_rivals_are_better() -> None:
    table = method_table(flown_by_all(ROWS)).splitlines()
    assert len(table) == 4
    assert table[3].startswith(
        "| mps | returns, seen space | 2 | 1 (9.5-90.5 %) | 1 (9.5-90.5 %) |"
    )
    assert "| 40.0 % | 0.50 |" in table[2]
    better = better_table(flown_by_all(ROWS))
    assert "| straight | missions completed | 0 | mps 1 |" in better
    assert "| straight | call, median, ms | 1.5 | mps 0.5 |" in better
    assert "contacts" not in better


def test_a_page_without_marks_is_refused_and_left_as_it_was(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- filters:begin -->\n<!-- filters:end -->\n", encoding="utf-8")
    with pytest.raises(InputError, match="filters-pilots:begin"):
        write_page(page, ROWS)
    assert page.read_text(encoding="utf-8").count("\n") == 2


def test_every_method_says_what_it_knows() -> None:
    assert all(method.knows for method in METHODS.values())
    assert {name for name, method in METHODS.items() if method.needs_peers} == {
        "cbfpy",
        "rta-simplex",
    }


@pytest.mark.nightly
@pytest.mark.parametrize("name", [name for name, one in METHODS.items() if not one.needs_peers])
def test_a_flight_is_the_same_again_and_filters_keep_the_margin(name: str) -> None:
    came = []
    for _ in range(2):
        one = fly(FlightRow("walls", 9000, "straight", name), METHODS[name].make(Peers(None)))
        one.call_ms = []
        came.append(one)
    assert came[0] == came[1]
    assert came[0].contact == (name == "unfiltered")
    assert came[0].margin_lost == (name == "unfiltered")


@pytest.mark.nightly
def test_flights_go_on_where_they_were_stopped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["--world", "walls", "--pilot", "straight", "--seeds", "1", "--out", str(tmp_path)]
    main([*asked, "--method", "unfiltered"])
    assert "1/1 walls/0/straight/unfiltered: contact" in capsys.readouterr().out
    before = (tmp_path / "unfiltered.jsonl").read_bytes()
    main([*asked, "--method", "unfiltered", "--method", "mps"])
    assert (tmp_path / "unfiltered.jsonl").read_bytes() == before
    out = capsys.readouterr().out
    assert "2/2 walls/0/straight/mps: not arrived" in out
    assert "1/2" not in out
