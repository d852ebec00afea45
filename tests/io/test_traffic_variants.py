"""Traffic as other receivers, collectors and tables write it: the same aircraft, read the same."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS
from clearway.io.traffic.traffic import read_traffic
from clearway.traffic.recorded import TrafficRecording
from mode_s_for_tests import EVEN, ODD

PLACE = (52.2572021484375, 3.91937255859375)
START = 1.7e9
"""2023-11-14 22:13:20 UTC."""


def read(folder: Path, content: str) -> TrafficRecording:
    path = folder / "recording"
    path.write_text(content)
    return read_traffic(path)


@pytest.mark.parametrize(
    ("content", "time_s"),
    [
        (f"{START},*{ODD};\n{START + 1},*{EVEN};\n", START + 1),
        (f"hex;time\n{ODD};{START}\n{EVEN};{START + 1}\n", START + 1),
        (f"id\tts_rx\ttimestamp\traw\n7\t0\t{START}\t{ODD}\n8\t0\t{START + 1}\t{EVEN}\n",
         START + 1),
        (f"# by hand\n{START} {ODD.lower()}\n\n{START + 1} {EVEN}\n", START + 1),
        (f"{START * 1e3:.0f},{ODD}\n{START * 1e3 + 500:.0f},{EVEN}\n", START + 0.5),
        (f"{START * 1e6:.0f},{ODD}\n{START * 1e6 + 250_000:.0f},{EVEN}\n", START + 0.25),
        (f"{START * 1e9:.0f},{ODD}\n{START * 1e9 + 1e9:.0f},{EVEN}\n", START + 1),
        (f"2023-11-14T22:13:20Z,{ODD}\n2023-11-14 22:13:21.5,{EVEN}\n", START + 1.5),
        (f"@000000000000{ODD};\n@000000B71B00{EVEN};\n", 1.0),
        (f"<FFFFFFFFFFFF7F{ODD};\n*{ODD};\n<000000B71AFF7F{EVEN};\n", 1.0),
        ("".join(json.dumps({"timestamp": START + n, "frame": frame, "df": "17"}) + "\n"
                 for n, frame in enumerate((ODD, EVEN))), START + 1),
    ],
)  # fmt: skip
def test_mode_s_in_many_arrangements(tmp_path: Path, content: str, time_s: float) -> None:
    pytest.importorskip("rs1090")
    recording = read(tmp_path, content)
    (report,) = recording.reports
    assert (report.latitude_deg, report.longitude_deg) == pytest.approx(PLACE)
    assert report.time_s == pytest.approx(time_s, abs=1e-6)
    assert recording.clock == ("utc" if time_s > START - 1 else "relative")
    assert recording.left_out.get("damaged", 0) == 0


@pytest.mark.parametrize("content", [f"*{ODD};\n*{EVEN};\n", f"{ODD}\n{EVEN}\n"])
def test_messages_without_times_are_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(InputError, match=r"messages without times: .*valid: lines `@<12 digits"):
        read(tmp_path, content)


AIRCRAFT = {
    "hex": "ABCDEF", "lat": 1.0, "lon": 2.0, "alt_baro": 1000, "gs": 100.0, "track": 90.0,
    "baro_rate": 64, "flight": "TEST1",
}  # fmt: skip
OLD = {
    "hex": "ABCDEF", "lat": 1.0, "lon": 2.0, "altitude": 1000, "speed": 100.0, "track": 90.0,
    "vert_rate": 64, "flight": "TEST1",
}  # fmt: skip
STATE = [
    "abcdef", "TEST1   ", "Nowhere", int(START), int(START) + 1, 2.0, 1.0, 1000 * FOOT_M, False,
    100 * KNOT_MPS, 90.0, 64 * FOOT_PER_MINUTE_MPS, None, None, "7000", False, 0,
]  # fmt: skip
HISTORY = (
    "time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,alert,spi,squawk,"
    "baroaltitude,geoaltitude,lastposupdate,lastcontact\n"
)
SBS = "MSG,{0},1,1,ABCDEF,1,2023/11/14,22:13:20.000,2023/11/14,22:13:20.000,{1}\r\n"


@pytest.mark.parametrize(
    "content",
    [
        json.dumps({"now": START, "ac": [AIRCRAFT], "msg": "No error"}),
        json.dumps({"now": START * 1e3, "ac": [AIRCRAFT]}, indent=1),
        json.dumps([{"now": START, "aircraft": [AIRCRAFT]}]),
        json.dumps({"now": START, "aircraft": [OLD]}),
        json.dumps({"now": "2023-11-14T22:13:20Z", **AIRCRAFT}) + "\n",
        json.dumps({"time": START + 5, "states": [STATE]}),
        json.dumps({"time": START, "states": [[*STATE[:3], None, *STATE[4:]]]}) + "\n",
        HISTORY + f"{START:.0f},abcdef,1,2,{100 * KNOT_MPS},90,{64 * FOOT_PER_MINUTE_MPS},TEST1 ,"
        f"false,false,false,,{1000 * FOOT_M},,{START},{START}\n",
        "timestamp,icao24,callsign,latitude,longitude,altitude,groundspeed,track,vertical_rate\n"
        "2023-11-14 22:13:20+00:00,abcdef,TEST1,1,2,1000,100,90,64\n",
        json.dumps([{"timestamp": START, "icao24": "abcdef", "callsign": "TEST1", "latitude": 1,
                     "longitude": 2, "altitude": 1000, "groundspeed": 100, "track": 90,
                     "vertical_rate": 64}]),
        SBS.format(1, "TEST1,,,,,,,,,,,") + SBS.format(4, ",,100,90,,,64,,,,,")
        + SBS.format(3, ",1000,,,1,2,,,0,0,0,0"),
    ],
)  # fmt: skip
def test_the_same_aircraft_from_everywhere(tmp_path: Path, content: str) -> None:
    (report,) = read(tmp_path, content).reports
    assert (report.time_s, report.address, report.callsign) == (START, "abcdef", "TEST1")
    assert (report.latitude_deg, report.longitude_deg) == (1.0, 2.0)
    assert report.altitude_kind == "barometric"
    motion = (report.altitude_m, report.ground_speed_mps, report.track_rad)
    assert motion == pytest.approx((1000 * FOOT_M, 100 * KNOT_MPS, np.pi / 2))
    assert report.vertical_rate_mps == pytest.approx(64 * FOOT_PER_MINUTE_MPS)


@pytest.mark.parametrize(
    "content",
    [
        json.dumps({"time": START, "states": [[*STATE[:8], True, *STATE[9:]]]}),
        HISTORY + f"{START:.0f},abcdef,1,2,3,90,0,,true,false,false,,300,,{START},{START}\n",
        SBS.format(2, ",,3,90,1,2,,,0,0,0,-1"),
        json.dumps({"now": START, "ac": [{**AIRCRAFT, "alt_baro": "ground"}]}),
    ],
)
def test_aircraft_on_the_ground(tmp_path: Path, content: str) -> None:
    (report,) = read(tmp_path, content).reports
    assert (report.altitude_m, report.altitude_kind) == (None, "ground")


@pytest.mark.parametrize(
    ("content", "left_out"),
    [
        (json.dumps({"time": START, "states": [STATE, STATE[:4]]}), {"damaged": 1}),
        (json.dumps({"time": START, "states": [STATE, [*STATE[:5], None, *STATE[6:]]]}),
         {"no position": 1}),
        (HISTORY + f"{START:.0f},abcdef,1,2,3,90,0,,true,false,false,,300,,{START},{START}\n1,2\n",
         {"damaged": 1}),
        (SBS.format(3, ",1000,,,1,2,,,0,0,0,0") + "MSG,3,1,1,ABCDEF\r\n", {"damaged": 1}),
        (SBS.format(3, ",1000,,,1,2,,,0,0,0,0") + SBS.format(3, ",1000,,,1,x,,,0,0,0,0"),
         {"damaged": 1}),
    ],
)  # fmt: skip
def test_what_is_damaged_is_counted(tmp_path: Path, content: str, left_out: dict[str, int]) -> None:
    recording = read(tmp_path, content)
    assert dict(recording.left_out) == left_out
    assert len(recording.reports) == 1
    parts: Any = (*recording.of_use.values(), *recording.left_out.values())
    assert recording.messages == 1 + sum(parts)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (HISTORY + "1,abcdef,1,2", "truncated: line 2, the last one, has 4 of 16 values"),
        (SBS.format(3, ",1000,,,1,2,,,0,0,0,0") + "MSG,3,1,1,AB", "truncated: line 2"),
        ('{"time": 5, "states": [["abc', "no whole JSON object, truncated"),
        (f"@000000000000{ODD};\n@00000000B71B{EVEN[:9]}", "truncated: line 2, the last"),
    ],
)
def test_what_is_cut_off_is_left_out_and_told(tmp_path: Path, content: str, message: str) -> None:
    """Whoever stops a recorder by Ctrl-C leaves a last line of which the end is missing."""
    whole, _, _ = content.rpartition("\n")
    if message.startswith("no whole"):
        with pytest.raises(InputError, match=message):
            read(tmp_path, content)
        return
    (tmp_path / "a").write_text(content)
    try:
        recording = read_traffic(tmp_path / "a")
    except InputError as error:
        told: tuple[str, ...] = error.problems
    else:
        told = recording.notes
        assert recording.left_out["cut off"] == 1
        assert recording.reports == read(tmp_path, whole + "\n").reports
    assert any(message in one for one in told)


def test_daidalus_with_columns_in_another_order(tmp_path: Path) -> None:
    recording = read(
        tmp_path,
        "\n# two aircraft\ntime lat lon alt heading airspeed name\n"
        "[s] [rad] [rad] [m] [rad] [m/s] none\n0 0.5 0.25 1000 2 30 own\n0 0.5 0.26 900 3 40 one\n",
    )
    assert recording.own_address == "own"
    report = recording.reports[1]
    assert (report.address, report.altitude_m, report.ground_speed_mps) == ("one", 900.0, 40.0)
    assert report.track_rad == 3.0
    assert report.longitude_deg == pytest.approx(np.degrees(0.26))


def test_the_own_aircraft_of_daidalus_is_that_of_the_first_whole_row(tmp_path: Path) -> None:
    recording = read(
        tmp_path, "time lat lon alt name\ns deg deg ft none\n0 1\n0 1 2 300 own\n0 1 2.1 300 one\n"
    )
    assert (recording.own_address, dict(recording.left_out)) == ("own", {"damaged": 1})


def test_a_packed_file_that_unpacks_to_more_than_memory_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("clearway.io.traffic.traffic.MOST_BYTES", 100_000)
    path = tmp_path / "a.gz"
    path.write_bytes(gzip.compress(b" " * 99_999) + gzip.compress(b" " * 10_000_000))
    with pytest.raises(
        InputError, match="unpacks to 100,000 bytes or more; valid: the file unpacked"
    ):
        read_traffic(path)


def test_kinds_are_told_apart_by_what_only_one_of_them_has(tmp_path: Path) -> None:
    """A table whose first column is `ID`, as messages of BaseStation may be called too."""
    daidalus = "ID,lat,lon,alt,time\nnone,deg,deg,ft,s\nA1,1,2,1000,0\n"
    assert read(tmp_path, daidalus).format == "DAIDALUS"
    sbs = "AIR,,1,1,ABCDEF,1,,,,\r\n" + SBS.format(3, ",1000,,,1,2,,,0,0,0,0")
    assert read(tmp_path, sbs).of_use == {"new aircraft": 1}


@pytest.mark.parametrize("content", [
    "name lat lon alt time\n- deg deg ft s\na 1 2 3 4\nb 1 2 3 4",
    HISTORY + f"{START:.0f},abcdef,1,2,3,90,0,,true,false,false,,300,,{START},{START}",
])  # fmt: skip
def test_a_last_line_without_an_end_is_told(tmp_path: Path, content: str) -> None:
    for text in (content, content + "\n"):
        told = any("cut off?" in note for note in read(tmp_path, text).notes)
        assert told == (text == content)
