"""Traffic files: real recordings of every format, published messages, every way to be bad."""

from __future__ import annotations

import gzip
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from absent_packages import without
from clearway.errors import InputError, MissingExtraError
from clearway.io.ticks import TickClock
from clearway.io.traffic import read_traffic
from clearway.recordings import TrafficRecording, TrafficReport
from clearway.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS, NAUTICAL_MILE_M

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

# Worked examples of J. Sun, The 1090 Megahertz Riddle (2nd ed.), chapters 4 and 5.
IDENTIFICATION = "8D4840D6202CC371C32CE0576098"
EVEN, ODD = "8D40621D58C382D690C8AC2863A7", "8D40621D58C386435CC412692AD6"
VELOCITY = "8D485020994409940838175B284F"


def mode_s(path: Path, *rows: tuple[float, str]) -> TrafficRecording:
    pytest.importorskip("rs1090")
    path.write_text("".join(f"{time_s},{message}\n" for time_s, message in rows))
    return read_traffic(path)


def with_parity(message: str) -> str:
    """The message with its last 24 bits as they must be: long division, bit by bit."""
    bits = [int(bit) for bit in f"{int(message[:-6], 16):0{4 * len(message) - 24}b}"] + 24 * [0]
    divisor = [int(bit) for bit in f"{0x1FFF409:b}"]
    for at in range(len(bits) - 24):
        if bits[at]:
            for step, bit in enumerate(divisor):
                bits[at + step] ^= bit
    return message[:-6] + f"{int(''.join(map(str, bits[-24:])), 2):06X}"


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
@pytest.mark.parametrize("kept", [0, 7, 0.31, 0.6, -4])
def test_truncated_real_files_are_refused(
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
    with pytest.raises(InputError, match=r"truncated|empty|no known traffic recording") as caught:
        read_traffic(path)
    assert str(path) in str(caught.value)


def test_published_messages(tmp_path: Path) -> None:
    """Position (5.2), velocity (5.3) and callsign of the book, with latest velocity attached."""
    velocity = with_parity("8D40621D" + VELOCITY[8:])
    name = with_parity("8D40621D" + IDENTIFICATION[8:])
    recording = mode_s(
        tmp_path / "a.csv", (10.0, name), (11.0, velocity), (12.0, ODD), (13.0, EVEN)
    )
    (report,) = recording.reports
    assert (report.time_s, report.address, report.callsign) == (13.0, "40621d", "KLM1023")
    assert (report.latitude_deg, report.longitude_deg) == pytest.approx(
        (52.2572021484375, 3.91937255859375)
    )
    assert (report.altitude_m, report.altitude_kind) == (38_000 * FOOT_M, "barometric")
    assert report.geometric_altitude_m == pytest.approx((38_000 + 550) * FOOT_M)
    assert report.ground_speed_mps == pytest.approx(159.20 * KNOT_MPS, rel=1e-4)
    assert report.track_rad == pytest.approx(np.radians(182.88), rel=1e-4)
    assert report.vertical_rate_mps == pytest.approx(-832 * FOOT_PER_MINUTE_MPS)
    assert recording.of_use == {"identification": 1, "velocity": 1}
    assert recording.left_out == {"position without its other half (CPR)": 1}
    assert recording.clock == "relative"


def test_old_velocities_are_not_attached(tmp_path: Path) -> None:
    velocity = with_parity("8D40621D" + VELOCITY[8:])
    recording = mode_s(tmp_path / "a.csv", (1.0, velocity), (12.0, ODD), (13.0, EVEN))
    assert recording.reports[0].ground_speed_mps is None
    assert recording.reports[0].geometric_altitude_m is not None


@pytest.mark.parametrize(
    ("control", "flag", "address", "source"),
    [
        (0, 0, "40621d", "adsb"),
        (1, 0, "~40621d", "adsb"),
        (2, 0, "40621d", "tisb"),
        (2, 1, "~40621d", "tisb"),
        (3, 0, "40621d", "tisb"),
        (5, 0, "~40621d", "tisb"),
        (6, 0, "40621d", "adsr"),
        (6, 1, "~40621d", "adsr"),
    ],
)
def test_who_sends_relayed_messages(
    tmp_path: Path, control: int, flag: int, address: str, source: str
) -> None:
    """Control field and address flag of DF 18 (DO-260B 2.2.3.2.1.5, TIS-B flag IMF)."""

    def relayed(message: str) -> str:
        first = 18 << 3 | control
        kind = int(message[8:10], 16) & 0xFE | flag
        return with_parity(f"{first:02X}{message[2:8]}{kind:02X}{message[10:]}")

    rows = ((1.0, relayed(ODD)), (2.0, relayed(EVEN)))
    (report,) = mode_s(tmp_path / "a.csv", *rows).reports
    assert (report.address, report.source) == (address, source)


@given(bit=st.integers(min_value=5, max_value=111))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
def test_one_wrong_bit_is_noticed(tmp_path: Path, bit: int) -> None:
    """The checksum tells every single wrong bit after the downlink format."""
    wrong = f"{int(EVEN, 16) ^ (1 << (111 - bit)):028X}"
    recording = mode_s(tmp_path / "a.csv", (1.0, ODD), (2.0, wrong), (3.0, EVEN))
    assert recording.left_out["checksum wrong"] == 1
    assert len(recording.reports) == 1


def beast(*rows: tuple[int, str]) -> bytes:
    """Frames of ticks and messages, with 0x1a doubled inside."""
    frames = []
    for ticks, message in rows:
        payload = bytes.fromhex(message)
        kind = b"\x33" if len(payload) == 14 else b"\x32"
        body = ticks.to_bytes(6, "big") + b"\x1a" + payload
        frames.append(b"\x1a" + kind + body.replace(b"\x1a", b"\x1a\x1a"))
    return b"".join(frames)


def test_beast_is_the_same_as_hex(tmp_path: Path) -> None:
    """Ticks of 0x1a1a.., signal 0x1a, short frames: escapes everywhere."""
    rows = [(0x1A1A1A1A1A00, IDENTIFICATION), (0x1A1A1B1A1A1A, ODD), (0x1A1A1C000000, EVEN)]
    short = with_parity("5D40621D000000")
    text = mode_s(
        tmp_path / "a.csv",
        *(((ticks - rows[0][0]) / 12e6, message) for ticks, message in rows),
        (2.0, short),
    )
    (tmp_path / "a.bin").write_bytes(beast(*rows, (rows[0][0] + 24_000_000, short)))
    binary = read_traffic(tmp_path / "a.bin")
    assert binary.reports == text.reports
    assert (binary.of_use, binary.left_out) == (text.of_use, text.left_out)
    assert binary.heard == {"4840d6": 1, "40621d": 3}


def test_beast_cut_anywhere_is_refused_or_has_whole_frames(tmp_path: Path) -> None:
    pytest.importorskip("rs1090")
    content = beast((0x1A1A1A1A1A1A, ODD), (0x1A1A1A1A1A1B, with_parity(EVEN[:20] + "1AAAAAAA")))
    whole = [len(beast((0x1A1A1A1A1A1A, ODD))), len(content)]
    for end in range(2, len(content) + 1):
        (tmp_path / "a.bin").write_bytes(content[:end])
        if end in whole:
            assert read_traffic(tmp_path / "a.bin").messages == 1 + whole.index(end)
        else:
            with pytest.raises(InputError, match="truncated"):
                read_traffic(tmp_path / "a.bin")


def test_beast_odds_and_ends(tmp_path: Path) -> None:
    """Mode A/C, the receiver's state, a computed position without time, a frame cut short."""
    pytest.importorskip("rs1090")
    whole = beast((2**48 - 12_000_000, ODD), (0, EVEN))  # the counter starts again
    content = (
        b"\x07\x08"
        + b"\x1a\x31" + bytes(6) + b"\x00\x12\x34"
        + b"\x1a\x34" + bytes(6) + b"\x00" + bytes(14)
        + b"\x1a\x33" + b"\xff\x00MLAT" + b"\x00" + bytes.fromhex(EVEN)
        + b"\x1a\x33" + bytes(9)
        + whole
    )  # fmt: skip
    (tmp_path / "a.bin").write_bytes(content)
    recording = read_traffic(tmp_path / "a.bin")
    assert recording.messages == 6
    assert recording.of_use == {"Mode A/C reply": 1, "state of the receiver": 1}
    assert recording.left_out == {
        "no time": 1,
        "damaged": 1,
        "position without its other half (CPR)": 1,
    }
    assert [report.time_s for report in recording.reports] == [1.0]
    assert any("2 bytes before the first frame" in note for note in recording.notes)


def test_beast_with_gps_times_names_and_places_of_the_receiver(tmp_path: Path) -> None:
    """As Radarcape and readsb write it: seconds of the day above 30 bits of nanoseconds."""
    pytest.importorskip("rs1090")
    state = b"\x1a\x34" + bytes(7) + b"\x10" + bytes(13)
    place, name = b"\x1a\x35" + bytes(21), b"\x1a\xe3" + b"ABCDEFGH"
    late, early = (86_399 << 30) + 750_000_000, 250_000_000  # over midnight
    content = state + place + name + beast((late, ODD), (early, EVEN)) + name
    (tmp_path / "a.bin").write_bytes(content)
    recording = read_traffic(tmp_path / "a.bin")
    assert [report.time_s for report in recording.reports] == [pytest.approx(0.5)]
    assert recording.of_use == {
        "state of the receiver": 1,
        "position of the receiver": 1,
        "name of the receiver": 2,
    }


def test_clocks_of_receivers() -> None:
    """Late frames, a counter that runs over, one that is started anew, one that stands."""
    clock = TickClock()
    counts = [2**48 - 24_000_000, 12_000_000, 2**48 - 6_000_000, 36_000_000, 24_000_000]
    assert [clock.seconds(count) for count in counts] == pytest.approx([0.0, 3.0, 1.5, 5.0, 4.0])
    assert clock.notes() == ()
    clock = TickClock()
    counts = [12_000_000_000, 12_012_000_000, 120_000, 12_120_000]
    assert [clock.seconds(count) for count in counts] == pytest.approx([0.0, 1.0, 3601.0, 3602.0])
    assert "started anew 1 times: 60 minutes are assumed" in clock.notes()[0]
    clock = TickClock()
    assert [clock.seconds(7) for _ in range(3)] == [0.0] * 3
    assert clock.stands


def test_beast_without_times_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(beast((0, ODD), (0, EVEN)))
    with pytest.raises(InputError, match="all 2 frames have the same time"):
        read_traffic(tmp_path / "a.bin")


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


def test_without_the_decoder_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "rs1090")
    (tmp_path / "a.csv").write_text(f"1.0,{EVEN}\n")
    with pytest.raises(MissingExtraError, match=r"clearway\[adsb\]"):
        read_traffic(tmp_path / "a.csv")


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
