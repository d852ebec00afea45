"""Traffic files: real recordings of every format, every way to be bad."""

from __future__ import annotations

import gzip
import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS, NAUTICAL_MILE_M
from clearway.io.traffic.traffic import read_traffic
from clearway.traffic.recorded import TrafficRecording, TrafficReport
from mode_s_for_tests import EVEN, ODD, VELOCITY, beast

REAL = (
    "adsb/raw_atlanta_60s_20250729.csv",
    "adsb/beast_sample_dump1090.bin",
    "adsb/tracks_brc_20min_20230830.jsonl",
    "adsb/tracks_monterey_20250601.jsonl.gz",
    "adsb/readsb_trace_full_aa178d_c172.json.gz",
    "adsb/traj_calfire_202009.json.gz",
    "adsb/traj_helicopter_samu31_20190517.json.gz",
    "daa/daidalus/Scenarios/C0_0_120.daa",
    "daa/daidalus/Scenarios/C1_0_120.daa",
    "daa/daidalus/Scenarios/H0_0_120.daa",
    "daa/daidalus/Scenarios/H1.daa",
)


def counted(recording: TrafficRecording) -> int:
    parts = (recording.of_use.values(), recording.left_out.values())
    return len(recording.reports) + sum(sum(part) for part in parts)


@pytest.mark.parametrize("name", REAL)
def test_every_message_of_a_real_file_is_accounted_for(data_dir: Path, name: str) -> None:
    if name.endswith((".csv", ".bin")):
        pytest.importorskip("rs1090")
    recording = read_traffic(data_dir / name)
    assert counted(recording) == recording.messages
    assert recording.reports
    times = [report.time_s for report in recording.reports]
    assert times == sorted(times)
    assert sum(recording.heard.values()) <= recording.messages


def test_real_mode_s(data_dir: Path) -> None:
    pytest.importorskip("rs1090")
    recording = read_traffic(data_dir / REAL[0])
    assert recording.messages == 486
    assert recording.reports[0].time_s == pytest.approx(1753827787.142)
    names = {report.callsign for report in recording.reports}
    assert {"N464T", "DAL2136", "DAL2833", "DAL1737", "JBU520", "AAL2174"} <= names
    light = [report for report in recording.reports if report.callsign == "N464T"]
    feet = [report.altitude_m / FOOT_M for report in light if report.altitude_m is not None]
    assert feet == sorted(feet, reverse=True)
    assert {1150.0, 925.0} <= {round(value, 6) for value in feet}
    airliner = [report for report in recording.reports if report.callsign == "AAL2174"]
    assert {report.altitude_m for report in airliner} == {36_000 * FOOT_M}
    assert all(report.altitude_kind == "barometric" for report in recording.reports)
    # Two aircraft are heard, but one never tells where it is and one only on the ground.
    assert set(recording.heard) - {report.address for report in recording.reports} == {
        "a2a7c4",
        "a426e0",
    }


def test_real_beast(data_dir: Path) -> None:
    pytest.importorskip("rs1090")
    recording = read_traffic(data_dir / REAL[1])
    assert (recording.messages, recording.clock) == (239, "relative")
    assert {report.address for report in recording.reports} == {"48520a"}
    # Recorded in Toulouse, of an airliner overhead.
    assert recording.reports[0].latitude_deg == pytest.approx(43.6, abs=0.2)
    assert recording.reports[0].longitude_deg == pytest.approx(1.4, abs=0.3)
    assert recording.reports[-1].callsign == "TRA89M"


def test_real_aircraft_json(data_dir: Path) -> None:
    recording = read_traffic(data_dir / REAL[2])
    assert recording.messages == 1612
    assert recording.left_out["no position"] == 418
    assert len(recording.reports) + recording.left_out["told twice"] == 1194
    assert len({report.address for report in recording.reports}) == 19
    # The airport lies 1200 m high: what the file gives as 0 ft is on the ground.
    assert not any(report.altitude_m == 0.0 for report in recording.reports)
    assert any(report.altitude_kind == "ground" for report in recording.reports)
    assert any("altitude is 0" in note for note in recording.notes)


def test_real_aircraft_json_with_ghosts(data_dir: Path) -> None:
    recording = read_traffic(data_dir / REAL[3])
    assert recording.messages == 44120
    ids = {report.address for report in recording.reports}
    assert len(ids) == 521
    sources = Counter(report.source for report in recording.reports if report.address[0] == "~")
    assert set(sources) == {"tisb", "adsb", "adsr"} | set(sources) - {"unknown"}
    assert sources["tisb"] > sources["adsb"] > 0
    assert "altitude is the text '0', taken as unknown: 114 messages" in recording.notes
    highest = max(report.altitude_m or 0.0 for report in recording.reports)
    assert highest == pytest.approx(14_150 * FOOT_M)


def test_real_trace(data_dir: Path) -> None:
    recording = read_traffic(data_dir / REAL[4])
    assert recording.messages == 985
    assert {report.address for report in recording.reports} == {"aa178d"}
    kinds = Counter(report.altitude_kind for report in recording.reports)
    assert kinds == {"barometric": 840, "ground": 143, None: 2}
    both = next(report for report in recording.reports if report.geometric_altitude_m)
    assert both.time_s > 1693353600.0
    aloft = [report for report in recording.reports if report.altitude_m == 5250 * FOOT_M]
    assert any(report.geometric_altitude_m == 5525 * FOOT_M for report in aloft)


def test_real_trajectories(data_dir: Path) -> None:
    fires = read_traffic(data_dir / REAL[5])
    assert (fires.messages, len({report.address for report in fires.reports})) == (9955, 45)
    helicopter = read_traffic(data_dir / REAL[6])
    assert helicopter.messages == 378
    # Every second has a row, but positions are older: repeated ones are told twice.
    assert helicopter.left_out == {"told twice": 100}
    feet = [report.altitude_m / FOOT_M for report in helicopter.reports if report.altitude_m]
    assert (min(feet), max(feet)) == pytest.approx((950.0, 1500.0))


def test_real_daidalus(data_dir: Path) -> None:
    recording = read_traffic(data_dir / REAL[10])
    assert (recording.own_address, recording.clock) == ("Ownship", "relative")
    own, intruder = recording.reports[:2]
    assert (own.address, intruder.address) == ("Ownship", "Intruder")
    assert own.latitude_deg == pytest.approx(33.8149396)
    assert own.altitude_m == pytest.approx(17_000 * FOOT_M)
    assert intruder.ground_speed_mps == pytest.approx(600 * KNOT_MPS)
    assert own.track_rad == pytest.approx(0.0)
    assert intruder.track_rad == pytest.approx(np.pi)
    crossing = read_traffic(data_dir / REAL[7])
    assert crossing.reports[1].track_rad == pytest.approx(np.pi / 2)
    assert crossing.reports[1].ground_speed_mps == pytest.approx(120 * KNOT_MPS)


@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize(
    "kept",
    [0, 0.6, *(pytest.param(kept, marks=pytest.mark.nightly) for kept in (7, 0.31, -4))],
)
def test_truncated_real_files_are_read_up_to_the_cut_or_refused(
    data_dir: Path, tmp_path: Path, name: str, kept: float
) -> None:
    content = (data_dir / name).read_bytes()
    end = int(kept * len(content)) if 0 < kept < 1 else int(kept)
    # A cut between lines, or within the last digits of a row, cannot be told from a whole file.
    while kept and (content[:end][-1:].isspace() or content[:end][-1:] in b".0123456789"):
        if not name.endswith(".daa"):
            break
        end -= 1
    path = tmp_path / Path(name).name
    path.write_bytes(content[:end])
    try:
        recording = read_traffic(path)
    except InputError as error:
        told = str(error)
    else:
        assert len(recording.reports) <= len(read_traffic(data_dir / name).reports)
        told = f"{recording.source}: {' '.join(recording.notes)}"
    assert re.search(r"truncated|empty|no known traffic recording", told)
    assert str(path) in told


def test_snapshots_of_a_receiver(tmp_path: Path) -> None:
    """aircraft.json itself: positions are older than the snapshot, and told again in the next."""
    one = {"hex": "ABCDEF", "flight": "KLM1  ", "lat": 1.0, "lon": 2.0, "alt_baro": "ground",
           "gs": 10.0, "track": 90.0, "seen_pos": 0.5, "type": "adsb_icao"}  # fmt: skip
    two = {"hex": "~123456", "lat": 1.0, "lon": 2.0, "alt_geom": 1000, "geom_rate": 60}
    nowhere = {"hex": "abc123", "alt_baro": 3000}
    snapshot = {"now": 1.7e9, "messages": 5, "aircraft": [one, two, nowhere, 7]}
    later = {"now": 1.7e9 + 0.4, "aircraft": [one | {"seen_pos": 0.91}]}
    (tmp_path / "one.json").write_text(json.dumps(snapshot, indent=2))
    with gzip.open(tmp_path / "both.json.gz", "wt") as file:
        file.write(json.dumps(snapshot) + "\n\n" + json.dumps(later) + "\n")
    for name, twice in (("one.json", 0), ("both.json.gz", 1)):
        recording = read_traffic(tmp_path / name)
        first, second = recording.reports
        assert first == TrafficReport(
            1.7e9 - 0.5, "abcdef", 1.0, 2.0, None, "ground", None,
            10 * KNOT_MPS, np.pi / 2, None, "KLM1", "adsb",
        )  # fmt: skip
        assert (second.altitude_m, second.altitude_kind) == (1000 * FOOT_M, "geometric")
        assert second.vertical_rate_mps == 60 * FOOT_PER_MINUTE_MPS
        assert second.source == "tisb"
        assert recording.left_out.get("told twice", 0) == twice
        assert (recording.left_out["no position"], recording.left_out["damaged"]) == (1, 1)


def row(**changes: Any) -> str:
    return json.dumps({"now": 1.7e9, "hex": "abcdef", "lat": 1.0, "lon": 2.0} | changes)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (row(lat=None), "no position"),
        (row(lat="1.0"), "no position"),
        (row(hex="xyz"), "no address"),
        (row(hex=5), "no address"),
        (row(now=None), "no time"),
        (row(now=1.7e30), "impossible value"),
        (row(lat=91.0), "impossible value"),
        (row(lat=float("nan")), "impossible value"),
        (row(lon=float("inf")), "impossible value"),
        (row(alt_baro=1e6), "impossible value"),
        (row(gs=5000), "impossible value"),
        (row(gs=-1), "impossible value"),
        (row(track=float("nan")), "impossible value"),
        (row(lat=10**400), "impossible value"),
        (row(), "told twice"),
        ("{", "damaged"),
        ("[1, 2]", "damaged"),
        ("\x00\xff", "damaged"),
        ('{"a":' * 5000, "damaged"),
    ],
)
def test_bad_rows_are_counted_by_reason(tmp_path: Path, line: str, reason: str) -> None:
    good = [row(), row(now=1.7e9 + 1)]
    (tmp_path / "a.jsonl").write_text("\n".join([good[0], line, good[1]]) + "\n")
    recording = read_traffic(tmp_path / "a.jsonl")
    assert recording.left_out == {reason: 1}
    assert len(recording.reports) == 2
    assert any("line 2" in note for note in recording.notes) == (reason == "damaged")


def test_a_zero_that_nothing_contradicts_is_an_altitude(tmp_path: Path) -> None:
    """Down to the sea at 5 m/s, and for comparison at 500."""
    for rate, kind in ((5.0, "barometric"), (500.0, "ground")):
        lines = [row(now=1.7e9 + t, alt_baro=max(0.0, 4000 - rate * t / FOOT_M))
                 for t in range(0, 400, 8)]  # fmt: skip
        (tmp_path / "a.jsonl").write_text("\n".join(lines) + "\n")
        recording = read_traffic(tmp_path / "a.jsonl")
        assert recording.reports[-1].altitude_kind == kind


def test_columns_of_daidalus_files_that_are_not_used_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.daa"
    path.write_text(
        "NAME lat lon alt trk gs vs time s_EW_std s_NS_std sz_std alerter\n"
        "[none] [deg] [deg] [ft] [deg] [knot] [fpm] [s] [m] [m] [ft] [none]\n"
        "one 0.5 0.25 1000 2.0 3.0 4.0 1.0 30 30 20 2\n"
    )
    recording = read_traffic(path)
    assert len(recording.reports) == 1
    uncertain, other = recording.notes
    assert "3 columns of uncertainties" in uncertain
    assert "s_ew_std, s_ns_std, sz_std" in uncertain
    assert "alerter" in other


def test_units_of_daidalus_files(tmp_path: Path) -> None:
    path = tmp_path / "a.daa"
    body = "one 0.5 0.25 1000 2.0 3.0 4.0 1.0\n"
    path.write_text("NAME lat lon alt trk gs vs time\n[none] [rad] [rad] [m] [rad] [m/s] "
                    "[m/s] [min]\n" + body)  # fmt: skip
    (report,) = read_traffic(path).reports
    assert report.latitude_deg == pytest.approx(np.degrees(0.5))
    assert report.longitude_deg == pytest.approx(np.degrees(0.25))
    assert report[4] == 1000.0
    assert (report.time_s, report.ground_speed_mps) == (60.0, 3.0)
    assert (report.track_rad, report.vertical_rate_mps) == (2.0, 4.0)
    path.write_text("NAME lat lon alt trk gs vs time\n" + body)
    recording = read_traffic(path)
    assert recording.reports[0].altitude_m == pytest.approx(1000 * FOOT_M)
    assert any("deg, ft, knot, fpm, s assumed" in note for note in recording.notes)
    path.write_text("NAME lat lon alt time\nx deg deg nmi s\n# nothing\n a, 1, 2, 3, 4 # far\n")
    assert read_traffic(path).reports[0].altitude_m == pytest.approx(3 * NAUTICAL_MILE_M)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (gzip.compress(b"", mtime=0), "empty"),
        (gzip.compress(b"hello", mtime=0)[:-3], "truncated"),
        (b"\x1f\x8bnothing", "damaged gzip"),
        (b"hello, world\n", "no known traffic recording.*valid: .*Beast binary"),
        (b"\x89PNG\r\n\x1a\n" + bytes(40), "no known traffic recording"),
        (b"{}", "no usable message"),
        (b"[]", "no JSON object but"),
        (b"[1, 2]", "1 of 1 messages cannot be read"),
        (b'[{"a": 1}]', r"no usable message in it \(left out: 1 no position\)"),
        (b'{"icao": "abc", "trace": 5}', "icao: .*\n.*timestamp: .*\n.*trace: no list"),
        (b'{"a":\n', "truncated"),
        (b'{"a": 1}\nx\ny\nz\n', "3 of 4 messages cannot be read\n.*line 2"),
        (b"name lat lon\n", "no column alt, time among name, lat, lon"),
        (b"name sx sy sz time\n", r"positions in a plane \(sx, sy\)"),
        (
            b"name lat lon alt time\n- deg deg furlong s\na 1 2 3 4\n",
            "unit 'furlong' of column alt",
        ),
        (b"name lat lon alt time\n", "no usable message"),
        (b"1.0,8D4840D6202CC371C32CE057609\n2,x\n", "2 of 2 messages cannot be read"),
        (b"1.0,8D4840D6202CC371C32CE057609", "truncated: line 1"),
        (b"inf,8D4840D6202CC371C32CE0576098\ntime\n", "no known traffic|cannot be read"),
    ],
)
def test_bad_files(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_traffic(tmp_path / "a.json")


def test_absent_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_traffic(tmp_path / "absent.json")
    with pytest.raises(InputError, match="directory"):
        read_traffic(tmp_path)


TRACE = {"icao": "abcdef", "timestamp": 1.7e9, "trace": [[n, 1.0, 2.0, 5, 6, 7, 0, 8, None]
                                                         for n in range(3)]}  # fmt: skip
FLIGHT = [{"timestamp": 1.7e12 + n, "icao24": "abcdef", "latitude": 1.0, "longitude": 2.0}
          for n in range(0, 3000, 1000)]  # fmt: skip
SAMPLES = (
    f"1.0,{ODD}\n2.0,{EVEN}\n3.0,{VELOCITY}\n".encode(),
    beast((1, ODD), (2, EVEN), (3, "5D40621DCAFE01")),
    f"{row()}\n{row(alt_baro='ground')}\n".encode(),
    json.dumps({"now": 5, "aircraft": [{"hex": "abcdef", "lat": 1, "lon": 2}]}).encode(),
    json.dumps(TRACE).encode(),
    json.dumps(FLIGHT).encode(),
    b"name lat lon alt time\n- deg deg ft s\na 1 2 3 4\nb 1 2 3 4\n",
    gzip.compress(row().encode(), mtime=0),
)


@given(
    sample=st.sampled_from(SAMPLES),
    changes=st.lists(st.tuples(st.integers(0, 400), st.binary(max_size=3)), max_size=4),
    end=st.integers(0, 400),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=400)
def test_damage_is_refused_or_counted(
    tmp_path: Path, sample: bytes, changes: list[tuple[int, bytes]], end: int
) -> None:
    """Whatever the bytes: an InputError, or a recording in which every message is counted."""
    pytest.importorskip("rs1090")
    content = sample[:end]
    for at, other in changes:
        content = content[:at] + other + content[at + 1 :]
    (tmp_path / "a").write_bytes(content)
    try:
        recording = read_traffic(tmp_path / "a")
    except InputError:
        return
    assert counted(recording) == recording.messages
    for report in recording.reports:
        assert abs(report.latitude_deg) <= 90.0
        assert np.isfinite(report.time_s)


def test_a_gzip_file_of_many_members_is_read_in_one_go(tmp_path):
    """Of 20 bytes each, as are those of 100,000 empty ones; what takes each of them anew never
    ends."""
    empty = gzip.compress(b"", mtime=0)
    whole = empty * 100_000 + gzip.compress(row().encode(), mtime=0) + empty * 50_000
    (tmp_path / "many.jsonl.gz").write_bytes(whole)
    assert len(read_traffic(tmp_path / "many.jsonl.gz").reports) == 1
    (tmp_path / "none.jsonl.gz").write_bytes(empty * 100_000)
    with pytest.raises(InputError, match="the file is empty"):
        read_traffic(tmp_path / "none.jsonl.gz")
    (tmp_path / "cut.jsonl.gz").write_bytes(whole[:-3])
    assert "end in the middle" in read_traffic(tmp_path / "cut.jsonl.gz").notes[0]
