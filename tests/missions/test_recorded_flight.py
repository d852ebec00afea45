"""Recorded traffic in flights: what plays, what is told, and encounters flown again."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from clearway.base.errors import InputError
from clearway.base.frames import geodetic_from_enu
from clearway.base.state import State
from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.cli.app import app
from clearway.io.toml import parse_model
from clearway.io.traffic.traffic import read_traffic
from clearway.live.mission import Mission, Progress, advance_progress
from clearway.missions.in_place import fly_in_place
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import prepare
from clearway.traffic.recorded import (
    TrafficRecording,
    TrafficReport,
    closest_pairs,
    collect_aircraft,
    take_part,
    without_ghosts,
)
from clearway.traffic.recorded.approach import closest_approach
from clearway.traffic.recorded.playing import PlayedTrack, RecordedTraffic, play_track

ORIGIN = (46.0, 14.0, 900.0)
HEIGHT_M = 3025 * FOOT_M
"""In steps of 25 ft, and not of 100 ft."""
Path3 = Callable[[float], Sequence[float]]


def reports(
    address: str, place_m: Path3, times_s: Sequence[float], **changes: object
) -> list[TrafficReport]:
    """Reports of a flight given as east, north, altitude in metres of the time; silent on speed."""
    made = []
    for time_s in times_s:
        east, north, altitude = place_m(time_s)
        latitude, longitude, _ = geodetic_from_enu([east, north, 0.0], (*ORIGIN[:2], 0.0))
        made.append(
            TrafficReport(
                float(time_s), address, float(latitude), float(longitude), altitude, "barometric"
            )._replace(**changes)
        )
    return made


def recording(*made: TrafficReport) -> TrafficRecording:
    ordered = tuple(sorted(made, key=lambda report: report.time_s))
    return TrafficRecording("made", "made", "relative", len(made), ordered)


def track(times_s: Sequence[float], east_m: Sequence[float], radius_m: float = 0.0) -> PlayedTrack:
    count = len(times_s)
    places = np.column_stack([east_m, np.zeros(count), np.zeros(count)])
    return PlayedTrack(
        "abc", np.array(times_s), places, np.full((count, 3), 1.0), np.ones(count), radius_m
    )


# --- what is there, and what is told ---------------------------------------------------------


def test_positions_are_interpolated_but_not_over_silence_or_jumps() -> None:
    played = track([0.0, 10.0, 30.0, 31.0], [0.0, 100.0, 300.0, 9000.0])
    assert played.at(4.0) == pytest.approx([40.0, 0.0, 0.0])
    assert played.at(10.0) == pytest.approx([100.0, 0.0, 0.0])
    assert played.at(10.1) is None  # 20 s of silence
    assert played.at(30.5) is None  # 8.7 km in a second
    assert played.at(31.0) == pytest.approx([9000.0, 0.0, 0.0])
    assert played.at(-0.1) is None
    assert played.at(31.1) is None


def test_reports_come_at_their_times_once_and_only_from_near() -> None:
    played = track([-20.0, -5.0, 3.2, 7.9], [0.0, 0.0, 320.0, 50_000.0])
    traffic = RecordedTraffic([played], heard_within_m=10_000.0)
    traffic.step(State(np.zeros(3), time_s=0.0))
    # What was told 20 s before is too old; the report of -5 s is known.
    assert [report.time_s for report in traffic.reports(0.0)] == [-5.0]
    assert traffic.reports(3.1) == []
    (heard,) = traffic.reports(4.0)
    assert (heard.time_s, heard.name, heard.position_m[0]) == (3.2, "abc", 320.0)
    assert traffic.reports(4.0) == []
    assert traffic.reports(9.0) == []  # 50 km away
    assert RecordedTraffic([played], deaf=True).reports(9.0) == []


def test_velocities_come_from_positions_where_nothing_else_is_told() -> None:
    # Altitudes in steps of 25 ft, climbing 5 m/s: the mean of 20 s is near the truth.
    def climbing(time_s: float) -> Sequence[float]:
        return (50.0 * time_s, 0.0, round((900.0 + 5.0 * time_s) / (25 * FOOT_M)) * 25 * FOOT_M)

    told = reports("abc", climbing, range(0, 61, 4))
    played = play_track(collect_aircraft(recording(*told))[0], ORIGIN, from_s=0.0)
    assert played is not None
    assert np.isnan(played.velocity_mps[0]).any()
    assert played.velocity_mps[5:] == pytest.approx(
        np.tile([50.0, 0.0, 5.0], (len(told) - 5, 1)), abs=0.5
    )
    assert played.radius_m == pytest.approx(0.5 * 25 * FOOT_M)
    spoken = reports("abc", climbing, range(0, 61, 4), ground_speed_mps=60.0, track_rad=math.pi / 2)
    played = play_track(collect_aircraft(recording(*spoken))[0], ORIGIN, from_s=0.0)
    assert played is not None
    assert played.velocity_mps[:, 0] == pytest.approx(60.0)


def test_heights_of_two_kinds_are_never_mixed() -> None:
    both = [
        *reports("abc", lambda _: (0.0, 0.0, 900.0), (0.0, 5.0)),
        *reports("abc", lambda _: (0.0, 0.0, 990.0), (7.0, 9.0), altitude_kind="geometric",
                 geometric_altitude_m=990.0),
    ]  # fmt: skip
    (one,) = collect_aircraft(recording(*both))
    barometric = play_track(one, ORIGIN, 0.0)
    geometric = play_track(one, ORIGIN, 0.0, geometric=True)
    assert barometric is not None
    assert geometric is not None
    assert barometric.time_s.tolist() == [0.0, 5.0]
    assert geometric.time_s.tolist() == [7.0, 9.0]
    on_ground = reports("def", lambda _: (0.0, 0.0, 0.0), (0.0, 1.0), altitude_kind="ground",
                        altitude_m=None)  # fmt: skip
    assert play_track(collect_aircraft(recording(*on_ground))[0], ORIGIN, 0.0) is None


def test_closest_approach_of_crossing_straight_lines() -> None:
    times = np.arange(0.0, 60.0, 0.5)
    zeros = np.zeros(len(times))
    own = np.column_stack([times, 50.0 * times, zeros, zeros])
    other = np.column_stack([times, zeros + 1500.0, 40.0 * (times - 30.0) + 300.0, zeros + 60.0])
    found = closest_approach(own, other)
    assert found is not None
    # Relative motion (-50, 40): nearest after (1500 * 50 + 900 * 40) / (50^2 + 40^2) s = 27.07 s.
    assert found.time_s == 27.0
    assert found.horizontal_m == pytest.approx(300.0 * 50.0 / math.hypot(50.0, 40.0), abs=2.0)
    assert found.vertical_m == 60.0
    assert not found.near_mid_air
    assert not found.well_clear
    assert closest_approach(own, other + np.array([1000.0, 0.0, 0.0, 0.0])) is None


# --- the part of one aircraft ----------------------------------------------------------------


def test_the_route_passes_the_closest_point_when_the_aircraft_did() -> None:
    """A quarter circle with 1800 m radius at 60 m/s, which takes 47 s, then straight north."""

    def turning(time_s: float) -> Sequence[float]:
        angle = min(max(time_s, 0.0) / 30.0, math.pi / 2)
        before, after = min(time_s, 0.0), max(time_s - 15.0 * math.pi, 0.0)
        east, north = 1800.0 * math.sin(angle), 1800.0 * (1 - math.cos(angle))
        return (east + 60.0 * before, north + 60.0 * after, 900.0)

    times = range(-120, 121, 3)
    air = recording(
        *reports("abc", turning, times, ground_speed_mps=60.0, track_rad=0.0),
        *reports("def", lambda t: (-20.0 * t, 200.0, 930.0), times, ground_speed_mps=30.0),
    )
    (pair,) = closest_pairs(collect_aircraft(air))
    part = take_part(pair, "ABC")
    assert part.own.address == "abc"
    assert part.from_s == pytest.approx(pair.time_s - 90.0, abs=3.0)
    corners = np.concatenate([part.start_m[None], part.waypoints_m])
    here = np.linalg.norm(corners[:, :2], axis=1).argmin()
    assert np.linalg.norm(corners[here, :2]) < 1.0  # the origin is the closest point
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    assert legs[:here].sum() / part.closest_s == pytest.approx(part.speed_mps)
    assert part.speed_mps == pytest.approx(60.0, rel=0.02)
    assert legs[1:-1] == pytest.approx(1800.0, rel=0.06)
    with pytest.raises(InputError, match=r"'xyz' is not in this encounter; valid: abc or def"):
        take_part(pair, "xyz")


def test_a_recording_that_ends_at_the_closest_point_is_flown_straight_on() -> None:
    times = range(-60, 2)
    air = recording(
        *reports("abc", lambda t: (50.0 * t, 0.0, 900.0), times, ground_speed_mps=50.0),
        *reports("def", lambda t: (50.0 * t + 10.0 * t, 100.0, 900.0), times,
                 ground_speed_mps=60.0),
    )  # fmt: skip
    (pair,) = closest_pairs(collect_aircraft(air))
    part = take_part(pair, "abc", after_s=40.0)
    assert part.waypoints_m[-1][:2] == pytest.approx([2000.0, 0.0], abs=60.0)
    assert np.linalg.norm(part.waypoints_m[:, :2], axis=1).min() < 60.0  # the closest point
    brief = recording(*(report for report in air.reports if report.time_s > -10.0))
    with pytest.raises(InputError, match="too little is recorded"):
        take_part(closest_pairs(collect_aircraft(brief))[0])


def test_a_waypoint_abeam_counts_where_that_is_asked_for() -> None:
    start, goals = State(np.zeros(3)), np.array([[100.0, 0.0, 0.0], [200.0, 0.0, 0.0]])
    strict = Mission("m", start, waypoints_m=goals, reach_radius_m=5.0)
    passing = Mission("m", start, waypoints_m=goals, reach_radius_m=5.0, pass_within_m=40.0)
    for place, expected in (
        ([99.0, 30.0, 0.0], 0),
        ([101.0, 30.0, 0.0], 1),
        ([101.0, 50.0, 0.0], 0),
        ([201.0, 30.0, 0.0], 0),  # beyond, but 105 m from the first
    ):
        here = np.array(place)
        assert advance_progress(strict, Progress(), here, 0.0).goal == 0
        assert advance_progress(passing, Progress(), here, 0.0).goal == expected
    # The last goal has to be reached.
    last = advance_progress(passing, Progress(goal=1), np.array([201.0, 30.0, 0.0]), 0.0)
    assert last.goal == 1


# --- flown -----------------------------------------------------------------------------------


def written(path: Path, *made: TrafficReport) -> Path:
    """The reports as rows of aircraft JSON, on the clock of 2023-11-14 22:13:20Z."""
    rows = [
        {
            "now": 1.7e9 + one.time_s, "hex": one.address, "lat": one.latitude_deg,
            "lon": one.longitude_deg, "alt_baro": round((one.altitude_m or 0.0) / FOOT_M / 25) * 25,
            "gs": (one.ground_speed_mps or 0.0) / KNOT_MPS,
            "track": math.degrees(one.track_rad or 0.0), "flight": one.callsign,
        }
        for one in sorted(made, key=lambda report: report.time_s)
    ]  # fmt: skip
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return path


def head_on(path: Path) -> Path:
    """Two aircraft that met nearly head on, a ghost of the first, and one far above."""
    times = range(-100, 101, 2)
    east, west = {"track_rad": math.pi / 2}, {"track_rad": 1.5 * math.pi}

    def first(time_s: float) -> Sequence[float]:
        return (50.0 * time_s, 0.0, HEIGHT_M)

    def second(time_s: float) -> Sequence[float]:
        return (-45.0 * time_s, 60.0, HEIGHT_M)

    def above(time_s: float) -> Sequence[float]:
        return (60.0 * time_s, 900.0, 2000.0)

    return written(
        path,
        *reports("aaaaaa", first, times, ground_speed_mps=50.0, callsign="OWN1", **east),
        *reports("~2b0012", first, [t + 0.5 for t in times], ground_speed_mps=50.0, **east),
        *reports("bbbbbb", second, times, ground_speed_mps=45.0, **west),
        *reports("cccccc", above, times, ground_speed_mps=60.0, **east),
    )  # fmt: skip


def clearway(*arguments: str | Path, cwd: Path) -> Any:
    with contextlib.chdir(cwd):
        return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.nightly
def test_an_encounter_flown_from_the_command_line(tmp_path: Path) -> None:
    file = head_on(tmp_path / "day.jsonl")
    run = clearway("traffic", file, "--fly", "1", "--as", "own1", "--json", "--out", "out",
                   cwd=tmp_path)  # fmt: skip
    assert run.exit_code == 0, run.stderr
    result = json.loads(run.stdout)
    assert (result["own"]["address"], result["other"]["address"]) == ("aaaaaa", "bbbbbb")
    assert result["closest"] == "2023-11-14T22:13:20.000+00:00"
    recorded, without, avoiding = (
        result[key] for key in ("recorded", "without_avoidance", "with_avoidance")
    )
    assert recorded["closest"]["slant_m"] == pytest.approx(60.0, abs=1.0)
    assert recorded["closest"]["near_mid_air"]
    assert without["closest"]["slant_m"] == pytest.approx(60.0, abs=25.0)
    assert without["closest"]["time_s"] == pytest.approx(result["closest_s"], abs=1.0)
    # Altitudes in steps of 25 ft: half of both comes on top of the margin.
    assert result["keep_m"] == pytest.approx(1000 * FOOT_M + 25 * FOOT_M, abs=0.1)
    assert avoiding["closest"]["slant_m"] >= result["keep_m"]
    assert avoiding["reached"]
    assert avoiding["margin_violations"] == avoiding["emergencies"] == 0
    assert avoiding["nearest_of_all"]["address"] == "bbbbbb"
    assert result["path_added_m"] == pytest.approx(
        avoiding["path_length_m"] - without["path_length_m"], abs=1e-3
    )
    assert 0.0 < result["path_added_m"] < 500.0
    # The ghost is no aircraft, and the ownship does not meet itself.
    intruders = (tmp_path / "out" / "intruders.csv").read_text()
    assert "aaaaaa" not in intruders
    assert "~2b0012" not in intruders
    assert json.loads((tmp_path / "out" / "encounter.json").read_text()) == result
    assert (tmp_path / "out" / "encounter.png").read_bytes().startswith(b"\x89PNG")
    # The mission that it wrote flies the same flight again.
    again = prepare(read_mission_file(str(tmp_path / "out" / "mission.toml"))).fly()
    rows = (tmp_path / "out" / "track.csv").read_text().splitlines()
    assert len(rows) == len(again.time_s) + 1
    assert rows[-1].split(",")[1] == f"{again.states[-1, 0]:.6f}"


def test_what_cannot_be_flown_is_said(tmp_path: Path) -> None:
    file = head_on(tmp_path / "day.jsonl")
    for arguments, cause in (
        (("--fly", "9"), "no pair 9; valid: 1 to 3"),
        (("--fly", "1", "--as", "dddddd"), "valid: aaaaaa (OWN1) or bbbbbb"),
        (("--fly", "1", file), "one recording is needed, got 2"),
    ):
        run = clearway("traffic", file, *arguments, cwd=tmp_path)
        assert run.exit_code == 2
        assert cause in run.stderr
        assert run.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["day.jsonl"]


def test_mission_keys_that_contradict_each_other() -> None:
    tables: dict[str, Any] = {
        "mission": {"name": "m", "waypoints_m": [[100.0, 0.0, 0.0]]},
        "traffic": {"recording": "day.jsonl"},
    }
    with pytest.raises(InputError, match="origin_geodetic is needed"):
        parse_model("m", tables, MissionFile)
    tables["mission"]["origin_geodetic"] = list(ORIGIN)
    tables["intruder"] = [
        {"name": "x", "appears_s": 0.0, "position_m": [0.0] * 3, "velocity_mps": [0.0] * 3}
    ]
    with pytest.raises(InputError, match=r"no \[\[intruder\]\] beside a recording"):
        parse_model("m", tables, MissionFile)


def test_a_mission_amid_a_recording(tmp_path: Path) -> None:
    head_on(tmp_path / "day.jsonl")
    mission = tmp_path / "mission.toml"
    keys = {
        "recording_from": '"2023-11-14T22:13:00Z"',
        "own_address": '"AAAAAA"',
        "recording": '"day.jsonl"',
    }

    def write(**changes: str) -> MissionFile:
        lines = "\n".join(f"{key} = {value}" for key, value in (keys | changes).items())
        mission.write_text(
            f'lidar = []\n[mission]\nname = "m"\norigin_geodetic = {list(ORIGIN)}\n'
            f"waypoints_m = [[100.0, 0.0, 0.0]]\n[traffic]\n{lines}\n"
        )
        return read_mission_file(str(mission))

    setup = prepare(write())
    assert setup.recorded is not None
    assert {one.name for one in setup.recorded.tracks} == {"bbbbbb", "cccccc"}
    bbbbbb = next(one for one in setup.recorded.tracks if one.name == "bbbbbb")
    assert bbbbbb.at(20.0) == pytest.approx([0.0, 60.0, HEIGHT_M - 900.0], abs=0.1)
    assert any("1 tracks of a radar alone" in note for note in setup.notes)
    with pytest.raises(InputError, match="'dddddd' is not in it"):
        prepare(write(own_address='"dddddd"'))
    with pytest.raises(InputError, match="no date and time"):
        prepare(write(recording_from='"yesterday"'))
    with pytest.raises(InputError, match="No such file"):
        prepare(write(recording='"absent.jsonl"'))


@pytest.mark.parametrize(
    ("file", "pair", "own", "index_m"),
    [
        ("tracks_brc_20min_20230830.jsonl", {"a23e55", "a27d3c"}, "a23e55", (240.0, 0.0)),
        pytest.param(
            "tracks_monterey_20250601.jsonl.gz",
            {"aa0415", "ab0a19"},
            "ab0a19",
            None,
            marks=pytest.mark.nightly,
        ),
        pytest.param(
            "tracks_monterey_20250601.jsonl.gz",
            {"a4ff9c", "a7dbd2"},
            "a7dbd2",
            (280.0, 350.0),
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_real_encounters(
    data_dir: Path, file: str, pair: set[str], own: str, index_m: tuple[float, float] | None
) -> None:
    path = data_dir / "adsb" / file
    pairs = closest_pairs(without_ghosts(collect_aircraft(read_traffic(path))), own)
    met = next(one for one in pairs if {one.first.address, one.second.address} == pair)
    found = fly_in_place(take_part(met, own), path)
    recorded, without, avoiding = (
        way.closest for way in (found.recorded, found.without, found.avoiding)
    )
    assert recorded is not None
    assert without is not None
    assert avoiding is not None
    if index_m is not None:
        assert recorded.horizontal_m == pytest.approx(index_m[0], abs=2.0)
        assert abs(recorded.vertical_m) == pytest.approx(index_m[1] * FOOT_M, abs=1.0)
        # The same vehicle without avoidance does much the same as the aircraft did.
        assert without.horizontal_m == pytest.approx(recorded.horizontal_m, abs=100.0)
    assert recorded.time_s == pytest.approx(found.part.closest_s, abs=1e-6)
    assert without.slant_m < found.keep_m
    assert avoiding.slant_m >= found.keep_m
    assert found.run.safe
    assert found.added_m > 0.0
