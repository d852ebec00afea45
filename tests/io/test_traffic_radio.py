"""GDL 90, the Open Glider Network, ArduPilot's logs and Remote ID: the same encounter in each."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.io.moments import GPS_EPOCH_S, parse_moment, utc_of_gps
from clearway.io.samples import dataflash, radio, telemetry
from clearway.io.samples.encounter import AIRCRAFT, BEGIN_S, LATITUDE, row_at
from clearway.io.traffic.gdl90 import compute_gdl90_crc
from clearway.io.traffic.traffic import read_traffic
from clearway.traffic.recorded.report import TrafficRecording

NOBODY = np.random.default_rng(0)
OTHER = AIRCRAFT[1]
DAY_S = 86_400.0


def of(recording: TrafficRecording, address: str) -> list:
    return [one for one in recording.reports if one.address == address]


def closest(recording: TrafficRecording, begin_s: float):
    """The other aircraft's report a minute after the beginning."""
    found = of(recording, OTHER.address)
    assert len(found) == 121
    report = found[60]
    row = row_at(OTHER, 60.0)
    assert report.time_s == pytest.approx(begin_s + 60.0, abs=0.01)
    assert report.latitude_deg == pytest.approx(row.latitude, abs=3e-5)
    assert report.longitude_deg == pytest.approx(row.longitude, abs=3e-5)
    assert report.ground_speed_mps == pytest.approx(OTHER.speed_mps, abs=0.6)
    return report


def made(path: Path, write) -> Path:
    write(path, NOBODY)
    return path


# --- GDL 90 -------------------------------------------------------------------------------------


def test_the_checksum_of_the_interface_s_own_example():
    assert compute_gdl90_crc(bytes.fromhex("008141DBD00802")) == 0x8BB3


def test_an_encounter_as_a_tablet_hears_it(tmp_path):
    read = read_traffic(made(tmp_path / "a", radio.write_gdl90))
    assert read.own_address == AIRCRAFT[0].address
    report = closest(read, BEGIN_S % DAY_S)
    assert report.altitude_kind == "barometric"
    assert report.altitude_m == pytest.approx(4100.0 * FOOT_M)
    own = of(read, AIRCRAFT[0].address)[60]
    assert own.geometric_altitude_m == pytest.approx(4000.0 * FOOT_M, abs=1.0)
    assert read.of_use["heartbeat"] == 121
    assert any("seconds since midnight UTC" in note for note in read.notes)


def traffic_report(**changes: int) -> bytes:
    """One report of another aircraft, with bytes changed by their number."""
    message = bytearray(radio._report(20, row_at(OTHER, 60.0)))
    for name, value in changes.items():
        message[int(name[1:])] = value
    return bytes(message)


def test_what_a_report_does_not_know_stays_unknown(tmp_path):
    beat = radio._frame(radio._heartbeat(BEGIN_S))
    nothing = traffic_report(_11=0xFF, _12=0xF8, _14=0xFF, _15=0xF8, _16=0x00)
    on_ground = traffic_report(_2=0x4B, _12=0x01)
    radar = traffic_report(_1=0x03)
    nowhere = traffic_report(**{f"_{n}": 0 for n in (*range(5, 11), 13)})
    beacon = traffic_report(_1=0x05)
    frames = [nothing, on_ground, radar, nowhere, beacon]
    path = tmp_path / "a"
    # A report before the first heartbeat, a frame with a wrong checksum, and one cut off.
    content = radio._frame(traffic_report()) + beat + b"".join(map(radio._frame, frames))
    path.write_bytes(content + b"\x7e\x14\x00\x7e" + b"\x7e\x14\x00")
    read = read_traffic(path)
    unknown, ground, tisb = read.reports
    assert (unknown.altitude_kind, unknown.ground_speed_mps) == (None, None)
    assert unknown.vertical_rate_mps is None
    assert (ground.altitude_kind, ground.track_rad) == ("ground", pytest.approx(0.0))
    assert (tisb.address, tisb.source) == (f"~{OTHER.address}", "tisb")
    assert read.left_out == {"no time": 1, "no position": 1, "damaged": 1, "cut off": 1}
    assert read.of_use["beacon on the ground"] == 1


def test_a_recording_over_midnight_goes_on(tmp_path):
    frames = b""
    for second in (DAY_S - 1.0, 0.0, 1.0):
        frames += radio._frame(radio._heartbeat(second)) + radio._frame(traffic_report())
    (tmp_path / "a").write_bytes(frames)
    times = [one.time_s for one in read_traffic(tmp_path / "a").reports]
    assert times == [DAY_S - 1.0, DAY_S, DAY_S + 1.0]


# --- Open Glider Network ------------------------------------------------------------------------

LINE = (
    "FLRDDA5BA>OGFLR,qAS,LFMX:/160829h4415.41N/00600.03E'342/049/A=005524 !W52! "
    "id06DDA5BA -454fpm -1.1rot 8.8dB 0e +51.2kHz gps4x5"
)


def lines(path: Path, *given: str) -> TrafficRecording:
    path.write_text("".join(f"{one}\n" for one in given))
    return read_traffic(path)


def test_an_encounter_as_gliders_hear_it(tmp_path):
    read = read_traffic(made(tmp_path / "a.txt", radio.write_ogn))
    report = closest(read, BEGIN_S)
    assert (report.altitude_kind, report.source) == ("geometric", "flarm")
    assert report.altitude_m == pytest.approx(4100.0 * FOOT_M, abs=0.2)
    assert read.of_use == {"position of a receiver": 1}
    assert any("above sea level by GPS" in note for note in read.notes)


def test_every_word_of_a_line_is_read(tmp_path):
    (report,) = lines(tmp_path / "a", "# aprsc 2.0", LINE).reports
    assert report.address == "~dda5ba"
    assert report.time_s == 16 * 3600 + 8 * 60 + 29
    assert report.latitude_deg == pytest.approx(44.0 + 15.415 / 60.0)
    assert report.longitude_deg == pytest.approx(6.0 + 0.032 / 60.0)
    assert report.ground_speed_mps == pytest.approx(49.0 * KNOT_MPS)
    assert np.degrees(report.track_rad) == pytest.approx(342.0)
    assert report.vertical_rate_mps == pytest.approx(-454.0 * FOOT_M / 60.0)
    level = lines(tmp_path / "b", LINE.replace("-1.1rot", "FL055.10")).reports[0]
    assert (level.altitude_kind, level.altitude_m) == ("barometric", pytest.approx(5510 * FOOT_M))
    state = lines(tmp_path / "c", LINE.replace("id06", "id05")).reports[0]
    assert state.address == "dda5ba"


def test_lines_that_are_no_position_are_counted(tmp_path):
    read = lines(
        tmp_path / "a",
        LINE,
        LINE.replace("id06DDA5BA", ""),
        LINE.replace("4415.41N", "44.2N"),
        LINE.replace("160829h", "990829h"),
        "LFMX>OGNSDR,TCPIP*,qAC,GLIDERN1:>160829h v0.2.8 CPU:0.5",
        LINE.replace("id06", "id46").replace("160829", "160830"),
        LINE.replace("160829", "000001"),
        "no line of it",
    )
    assert len(read.reports) == 3
    assert read.reports[-1].time_s == DAY_S + 1.0
    assert read.left_out == {"no address": 1, "no position": 1, "damaged": 2}
    assert read.of_use == {"status": 1}
    assert any("asks not to be tracked" in note for note in read.notes)


def test_dates_on_some_lines_alone_are_refused(tmp_path):
    with pytest.raises(InputError, match="some lines begin with a date and others do not"):
        lines(tmp_path / "a", LINE, f"2026-01-01T16:08:30Z {LINE}")
    assert lines(tmp_path / "b", f"2026-01-01T16:08:30Z {LINE}").clock == "utc"


# --- ArduPilot ----------------------------------------------------------------------------------


def test_an_encounter_in_a_log_of_ardupilot(tmp_path):
    pytest.importorskip("pymavlink")
    read = read_traffic(made(tmp_path / "a.bin", dataflash.write_dataflash))
    assert (read.clock, read.own_address) == ("utc", "own")
    closest(read, BEGIN_S)
    own = of(read, "own")[60]
    assert own.time_s == pytest.approx(BEGIN_S + 60.0, abs=0.01)
    assert own.latitude_deg == pytest.approx(LATITUDE, abs=1e-6)
    # Its pressure in the standard atmosphere, which pressure altitudes of others are above too.
    assert (own.altitude_kind, own.altitude_m) == ("barometric", pytest.approx(120.0, abs=0.5))
    assert own.geometric_altitude_m == pytest.approx(168.0)
    assert read.messages == sum(read.of_use.values()) + len(read.reports)


@pytest.mark.parametrize(
    ("date", "ahead_s"),
    [
        ("1980-01-06T00:00:00Z", 0), ("1981-06-30T23:59:59Z", 0), ("1981-07-01T00:00:00Z", 1),
        ("1990-06-01T00:00:00Z", 6), ("2000-01-01T00:00:00Z", 13), ("2008-12-31T23:59:59Z", 14),
        ("2012-06-30T23:59:59Z", 15), ("2014-05-17T12:00:00Z", 16), ("2016-12-31T23:59:59Z", 17),
        ("2017-01-01T00:00:00Z", 18), ("2026-01-01T00:00:00Z", 18),
    ],
)  # fmt: skip
def test_gps_is_ahead_of_utc_by_the_leap_seconds_of_the_date(tmp_path, monkeypatch, date, ahead_s):
    utc_s = parse_moment("test", date).timestamp()
    assert utc_of_gps(utc_s - GPS_EPOCH_S + ahead_s) == utc_s
    pytest.importorskip("pymavlink")
    if ahead_s == 16:
        monkeypatch.setattr(dataflash, "BEGIN_S", utc_s)
        monkeypatch.setattr(dataflash, "LEAP_S", ahead_s)
        read = read_traffic(made(tmp_path / "old.bin", dataflash.write_dataflash))
        assert of(read, "own")[60].time_s == pytest.approx(utc_s + 60.0, abs=0.01)


def test_a_log_without_time_and_with_bytes_lost(tmp_path):
    pytest.importorskip("pymavlink")
    whole = made(tmp_path / "whole.bin", dataflash.write_dataflash).read_bytes()
    fix = struct.pack("<BB", 0, 3)
    content = whole.replace(fix, struct.pack("<BB", 0, 1))
    (tmp_path / "a.bin").write_bytes(content)
    read = read_traffic(tmp_path / "a.bin")
    assert (read.clock, read.left_out["no fix of GPS"]) == ("relative", 121)
    middle = len(whole) // 2
    (tmp_path / "b.bin").write_bytes(whole[:middle] + b"x" * 600 + whole[middle:])
    damaged = read_traffic(tmp_path / "b.bin")
    assert damaged.left_out["damaged"] >= 10
    assert any("600 bytes hold no message" in note for note in damaged.notes)
    assert len(damaged.reports) > 300
    (tmp_path / "c.bin").write_bytes(whole[:-5])
    cut = read_traffic(tmp_path / "c.bin")
    assert cut.left_out == {"cut off": 1}
    assert len(cut.reports) == 362


def test_remote_id_in_a_telemetry_log(tmp_path):
    pytest.importorskip("pymavlink")
    read = read_traffic(made(tmp_path / "a.tlog", telemetry.write_telemetry))
    closest(read, BEGIN_S)
    drone = [one for one in read.reports if one.source == "remote id"]
    assert len(drone) == 121
    assert drone[0].address.startswith("~")
    assert drone[60].callsign == "DEMO-DRONE-1"
    assert drone[60].time_s == pytest.approx(BEGIN_S + 60.0, abs=0.01)
    assert drone[60].latitude_deg > drone[0].latitude_deg
    assert (drone[0].altitude_kind, drone[0].altitude_m) == ("geometric", pytest.approx(188.0))
    assert read.of_use["the vehicle's own Remote ID"] == 13
