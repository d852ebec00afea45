"""ULog of PX4 and BlueSky scenarios: the real ones, made ones, and every way to be bad."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from absent_packages import without
from clearway.base.errors import InputError, MissingExtraError
from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.io.poses.ulog import read_ulog
from clearway.io.traffic.traffic import read_traffic
from clearway.io.what_file import what_content
from in_process import clearway

LOG = "logs/px4_sitl_sample_px4_events.ulg"

# --- ULog -------------------------------------------------------------------------------------


def test_the_way_of_a_real_flight(data_dir: Path) -> None:
    pytest.importorskip("pyulog")
    flight = read_ulog(data_dir / LOG)
    track = flight.track
    assert len(track.time_s) == 313 - 98
    assert track.position_m[:, 2].max() == pytest.approx(2.16, abs=0.01)
    assert np.abs(track.position_m[:, :2]).max() < 0.1
    assert flight.origin_geodetic == pytest.approx((47.39774, 8.54559, 487.957), abs=1e-3)
    assert track.time_s[-1] - track.time_s[0] == pytest.approx(22.0, abs=1.0)
    assert track.time_s[0] == pytest.approx(1710773359.0, abs=2.0)
    # It stands level with its nose to the north: a quarter to the left of the east.
    state = track.at(float(track.time_s[0]))
    assert state is not None
    np.testing.assert_allclose(np.degrees(state.attitude_rad), [0.0, 0.0, 90.0], atol=2.0)
    assert any("98 positions left out: not valid yet" in note for note in track.notes)


def test_the_traffic_of_a_real_flight(data_dir: Path) -> None:
    pytest.importorskip("pyulog")
    recording = read_traffic(data_dir / LOG)
    assert recording.format == "ULog of PX4"
    assert recording.messages == 583 + 1
    assert recording.left_out["no address"] == 1
    assert recording.left_out["no fix of GPS"] == 160
    assert recording.own_address == "own"
    assert {report.address for report in recording.reports} == {"own"}
    heights = [report.geometric_altitude_m for report in recording.reports]
    assert max(heights) - min(heights) == pytest.approx(2.2, abs=0.2)


@pytest.mark.parametrize("share", [0.5, 0.6, 0.9])
def test_a_log_that_was_cut_is_read_as_far_as_it_goes(
    data_dir: Path, tmp_path: Path, share: float
) -> None:
    pytest.importorskip("pyulog")
    content = (data_dir / LOG).read_bytes()
    (tmp_path / "cut.ulg").write_bytes(content[: int(share * len(content))])
    recording = read_traffic(tmp_path / "cut.ulg")
    assert recording.messages < 584
    assert any("cut off: the last" in note for note in recording.notes)


def test_a_log_cut_in_its_definitions_is_refused(
    data_dir: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyulog")
    content = (data_dir / LOG).read_bytes()
    for kept in (4, 10, 200, 3000):
        (tmp_path / "cut.ulg").write_bytes(content[:kept])
        for read in (read_traffic, read_ulog):
            with pytest.raises(
                InputError, match=r"cut\.ulg: .*(damaged|no usable|no vehicle_local)"
            ):
                read(tmp_path / "cut.ulg")
    assert capsys.readouterr().out == ""


FORMAT = (
    "transponder_report:uint64_t timestamp;uint32_t icao_address;double lat;double lon;"
    "float altitude;float heading;float hor_velocity;float ver_velocity;uint16_t flags;"
    "uint8_t altitude_type;uint8_t tslc;char[9] callsign;"
)


def ulog(*reports: tuple[Any, ...]) -> bytes:
    """A log of transponder reports, in the order of FORMAT's fields."""

    def record(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<H", len(body)) + kind + body

    content = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    content += record(b"B", bytes(40)) + record(b"F", FORMAT.encode())
    content += record(b"A", struct.pack("<BH", 0, 1) + b"transponder_report")
    for report in reports:
        content += record(b"D", struct.pack("<H", 1) + struct.pack("<QIddffffHBB9s", *report))
    return content


def test_reports_of_the_transponder(tmp_path: Path) -> None:
    pytest.importorskip("pyulog")
    everything = 1 | 2 | 4 | 8 | 16
    (tmp_path / "a.ulg").write_bytes(
        ulog(
            (5_000_000, 0xABC123, 45.0, 14.0, 900.0, -1.0, 50.0, 2.0, everything, 1, 2, b"N123 \0"),
            (6_000_000, 0xABC124, 45.0, 14.0, 800.0, 0.5, 50.0, 2.0, 1 | 2, 0, 0, b"XX"),
            (7_000_000, 0xABC125, 45.0, 14.0, 800.0, 0.5, 50.0, 2.0, 2, 0, 0, b""),
            (8_000_000, 0, 45.0, 14.0, 0.0, 0.0, 0.0, 0.0, 1, 0, 0, b""),
        )
    )
    recording = read_traffic(tmp_path / "a.ulg")
    assert recording.clock == "relative"
    assert dict(recording.left_out) == {"no position": 1, "no address": 1}
    first, second = recording.reports
    assert (first.address, first.callsign, first.time_s) == ("abc123", "N123", 3.0)
    assert (first.altitude_kind, first.geometric_altitude_m) == ("geometric", 900.0)
    assert first.track_rad == pytest.approx(2 * np.pi - 1.0)
    assert (first.ground_speed_mps, first.vertical_rate_mps) == (50.0, 2.0)
    assert (second.altitude_kind, second.altitude_m) == ("barometric", 800.0)
    assert second.geometric_altitude_m is None
    assert (second.ground_speed_mps, second.track_rad, second.callsign) == (None, None, "")


def test_without_the_package_the_extra_is_named(
    data_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "pyulog")
    for read in (read_traffic, read_ulog):
        with pytest.raises(MissingExtraError, match=r"clearway\[ulog\]"):
            read(data_dir / LOG)


# --- BlueSky ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "aircraft", "commands"), [("super16", 16, 8), ("wall", 21, 0), ("ASAS-05", 2, 57)]
)
def test_real_scenarios(data_dir: Path, name: str, aircraft: int, commands: int) -> None:
    recording = read_traffic(data_dir / f"daa/bluesky/{name}.scn")
    assert recording.format == "BlueSky scenario"
    assert len(recording.reports) == aircraft
    assert recording.of_use.get("other command", 0) == commands
    assert recording.messages == aircraft + commands
    assert not recording.left_out


def test_aircraft_of_the_circle(data_dir: Path) -> None:
    """Sixteen on a circle of half a degree, each heading nearly across it, at 20 km."""
    reports = read_traffic(data_dir / "daa/bluesky/super16.scn").reports
    for report in reports:
        assert np.hypot(report.latitude_deg, report.longitude_deg) == pytest.approx(0.5, abs=1e-3)
        assert report.altitude_m == pytest.approx(20_000.0, abs=0.1)
        # 110 kt of calibrated air speed are 200 m/s there.
        assert report.ground_speed_mps == pytest.approx(200.0, rel=0.01)


def scenario(path: Path, text: str) -> Any:
    path.write_text(text)
    return read_traffic(path)


def test_values_of_a_scenario(tmp_path: Path) -> None:
    recording = scenario(
        tmp_path / "a.scn",
        "# a comment\n0:00:05>cre AB1 B744 N45.5 W14 90 FL350 .8\n"
        "01:02:03.5>CRE,AB2,B744,S45.5,-14,0,0,100\r00:00:06>CRE AB3,B744 EHAM 05 90 0 100\n"
        "00:00:07>DEL AB1\n",
    )
    first, second = recording.reports
    assert (first.time_s, first.latitude_deg, first.longitude_deg) == (5.0, 45.5, -14.0)
    assert first.altitude_m == pytest.approx(35_000 * FOOT_M)
    # Mach 0.8 at 35,000 ft: 461 kt, by any table of the standard atmosphere.
    assert first.ground_speed_mps / KNOT_MPS == pytest.approx(461.0, abs=1.0)
    assert first.track_rad == pytest.approx(np.pi / 2.0)
    assert (second.time_s, second.latitude_deg) == (3723.5, -45.5)
    # At sea level calibrated and true air speed are the same.
    assert second.ground_speed_mps == pytest.approx(100 * KNOT_MPS)
    assert dict(recording.left_out) == {"no position": 1}
    assert recording.notes == ("line 4: AB3 begins at EHAM 05",)


def test_values_that_no_aircraft_has(tmp_path: Path) -> None:
    recording = scenario(
        tmp_path / "a.scn",
        "0:00:05>CRE AB1 B744 45 14 90 1e9 200\n0:00:05>CRE AB2 B744 45 14 90 100 1e200\n"
        "0:00:05>CRE AB3 B744 45 14 90 100\n0:00:05>CRE AB4 B744 45 14 90 100 200\n"
        "0:00:06>DEL AB4\n",
    )
    assert [report.address for report in recording.reports] == ["AB4"]
    assert dict(recording.left_out) == {"impossible value": 2, "damaged": 1}
    assert recording.notes[0] == "line 3: CRE with 6 values of 7"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("00:00:00.00>CRE AB1,B744,45.0,1", "truncated: line 1, the last one"),
        ("00:00:00.00>CRE AB1,B744,45.0\n", "1 of 1 messages cannot be read\n.*CRE with 3 values"),
    ],
)
def test_bad_scenarios(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        scenario(tmp_path / "a.scn", text)


# --- what else a file may be ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "meaning"),
    [
        ("daa/em-models/uncor_1200only_fwse_v1p2.txt", "an encounter model"),
        ("daa/daidalus/Configurations/DO_365A_no_SUM.conf", "parameters of DAIDALUS"),
        ("daa/daidalus/gold/DaidalusqAlerting-no_sum.csv", "output of DAIDALUS"),
        (LOG, "a ULog"),
        ("daa/bluesky/super16.scn", "a BlueSky scenario"),
        ("lidar/pcd/vlp16_1673400472138016708.pcd", "a point cloud"),
        ("lidar/aerial/autzen_trim.laz", "an aerial survey"),
        ("maps/voxel/skir.bag", "a robot recording"),
        ("lidar/bag/vlp16_rosbag2/metadata.yaml", "metadata of a ROS 2 bag"),
        ("lidar/ouster/OS-0-128-U1_v2.3.0_1024x10.pcap", "captured packets"),
        ("lidar/ouster/OS-0-128-U1_v2.3.0_1024x10.json", "metadata of an Ouster"),
        ("maps/missions/qgc_MissionPlanner.waypoints", "waypoints"),
        ("maps/missions/mavsdk_qgroundcontrol_sample.plan", "a plan"),
        ("maps/cityjson/delft.city.json", "a map"),
        ("maps/geozones/cis_source_sample_ed318.json", "a map"),
        ("maps/geozones/cis_source_sample_ed269.json", "a map"),
        ("maps/obstacles/Cologne_DEM_merged_from_LAS_25x25.tif", "a raster"),
    ],
)
def test_what_a_file_is_when_it_went_to_the_wrong_command(
    data_dir: Path, name: str, meaning: str
) -> None:
    assert f"; it looks like {meaning}" in what_content((data_dir / name).read_bytes())


@pytest.mark.parametrize(
    ("command", "name", "meaning"),
    [
        ("map", "daa/daidalus/gold/DaidalusqAlerting-no_sum.csv", "output of DAIDALUS"),
        ("map", "daa/daidalus/Configurations/DO_365A_no_SUM.conf", "parameters of DAIDALUS"),
        ("map", "daa/em-models/uncor_1200only_fwse_v1p2.txt", "an encounter model"),
        ("map", "lidar/ouster/OS-0-128-U1_v2.3.0_1024x10.json", "metadata of an Ouster"),
        ("map", "maps/missions/qgc_MissionPlanner.waypoints", "waypoints"),
        ("assess --scan", "daa/daidalus/gold/DaidalusqAlerting-no_sum.csv", "output of DAIDALUS"),
        ("assess --scan", "daa/em-models/uncor_1200only_fwse_v1p2.txt", "an encounter model"),
        ("assess --scan", "maps/cityjson/delft.city.json", "a map: `clearway map` takes it"),
        ("assess --scan", LOG, "a ULog"),
        ("traffic", "maps/obstacles/Cologne_DEM_merged_from_LAS_25x25.tif", "a raster"),
        ("traffic", "lidar/pcd/vlp16_1673400472138016708.pcd", "a point cloud"),
    ],
)
def test_a_file_for_another_command(
    data_dir: Path, tmp_path: Path, command: str, name: str, meaning: str
) -> None:
    done = clearway(*command.split(), data_dir / name, cwd=tmp_path)
    assert done.exit_code == 2
    assert f"; it looks like {meaning}" in done.stderr
    assert done.stderr.startswith(str(data_dir / name))
    assert not list(tmp_path.iterdir())


def test_what_nobody_knows_is_not_guessed_at() -> None:
    assert what_content(b"hello, world\n") == ""
