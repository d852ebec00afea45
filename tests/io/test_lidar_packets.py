"""Packets of Velodyne and Ouster LiDARs: real ones, lost ones, and what beams they have."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from absent_packages import without
from clearway.base.errors import InputError, MissingExtraError
from clearway.io.scans.ouster import metadata_beside
from clearway.io.scans.scan_formats import read_points
from clearway.io.scans.sequences import open_scans
from clearway.io.scans.velodyne import CALIBRATIONS, NAMED, model_pattern
from clearway.sensors import find_pattern


def test_velodyne_packets_against_their_truth(data_dir: Path) -> None:
    from scipy.spatial import cKDTree

    scans = list(open_scans(data_dir / "lidar/bag/vlp16_rosbag2"))
    assert len(scans) == 4
    last = scans[-1].read()
    assert last.points_m.shape == (14_816, 3)
    truth = read_points(data_dir / "lidar/pcd/vlp16_1673400472138016708.pcd").points_m
    assert len(truth) == 14_831
    for these, those in ((last.points_m, truth), (truth, last.points_m)):
        apart = cKDTree(those).query(these)[0]
        assert np.median(apart) < 0.006
        assert apart.max() < 0.07
    assert last.pattern is not None
    assert last.pattern.name == "vlp16"
    assert scans[0].time_s == pytest.approx(1673400471.7378, abs=1e-3)
    file = data_dir / "lidar/bag/vlp16_rosbag2/1673400471837873222_0.db3"
    assert [scan.time_s for scan in open_scans(file)] == [scan.time_s for scan in scans]


def test_lost_packets_are_no_evidence_of_free_space(data_dir: Path) -> None:
    """Of a real scan, packets 40 to 70 are lost: 31 of 151 parts of the turn."""
    pytest.importorskip("velodyne_decoder")
    from clearway.io.scans.open_bag import open_bag
    from clearway.io.scans.velodyne import VelodyneDecoder

    path = data_dir / "lidar/bag/vlp16_rosbag2"
    decoder = VelodyneDecoder(path)
    with open_bag(path) as bag:
        scan = bag.decoded(next(bag.messages(["/velodyne_packets"])))
    whole = decoder.cloud(scan, "whole")
    assert whole.complete
    assert whole.notes == ()
    scan.packets = scan.packets[:40] + scan.packets[71:]
    part = decoder.cloud(scan, "part")
    assert not part.complete
    assert part.notes == ("packets of 75 deg are missing",)
    assert part.pattern is not None
    assert part.pattern.beams == pytest.approx(28_800 * (1.0 - 75.0 / 360.0), rel=0.01)
    azimuth = np.arctan2(part.points_m[:, 1], part.points_m[:, 0])
    gone = np.setdiff1d(
        np.round(np.degrees(np.unique(find_pattern("vlp16").azimuth_rad))),
        np.round(np.degrees(np.unique(part.pattern.azimuth_rad))),
    )
    assert len(gone) == pytest.approx(74, abs=1)
    assert not np.isin(np.round(np.degrees(azimuth)), gone[2:-2]).any()


@pytest.mark.parametrize("model", [*CALIBRATIONS, *NAMED])
def test_beams_of_velodynes_by_name(model: str) -> None:
    pytest.importorskip("velodyne_decoder")
    pattern = model_pattern(model)
    assert pattern is not None
    lasers = len(np.unique(np.round(pattern.elevation_rad, 9)))
    assert lasers == {"VLS128": 128, "AlphaPrime": 128}.get(
        model, 32 if model in ("HDL32E", "VLP32A", "VLP32B", "VLP32C") else 16
    )
    assert pattern.beams % lasers == 0


def test_a_velodyne_whose_units_differ_has_no_beams_by_name() -> None:
    assert model_pattern("HDL64E_S2") is None


@pytest.mark.parametrize(
    ("name", "returns", "times_s"),
    [
        (
            "OS-1-128_v2.3.0_1024x10_lb_n3",
            (107_647, 107_357, 107_532),
            (991.587, 991.687, 991.787),
        ),
        ("OS-0-128-U1_v2.3.0_1024x10", (97_299,), (1462.559,)),
    ],
)
def test_ouster_packets(
    data_dir: Path, name: str, returns: tuple[int, ...], times_s: tuple[float, ...]
) -> None:
    pytest.importorskip("ouster.sdk")
    scans = list(open_scans(data_dir / f"lidar/ouster/{name}.pcap"))
    found = [scan.read() for scan in scans]
    assert tuple(len(cloud.points_m) for cloud in found) == returns
    assert [scan.time_s for scan in scans] == pytest.approx(times_s, abs=1e-3)
    ranges = np.linalg.norm(found[0].points_m, axis=1)
    nearest, farthest = (1.26, 216.8) if name.startswith("OS-1") else (0.24, 128.5)
    assert ranges.min() == pytest.approx(nearest, abs=0.05)
    assert ranges.max() == pytest.approx(farthest, abs=0.1)
    pattern = found[0].pattern
    assert pattern is not None
    assert pattern.beams == 128 * 1024
    assert pattern.max_range_m >= ranges.max()
    # Returns lie on the beams of the metadata: the beams' origins are centimetres off the middle.
    far = found[0].points_m[ranges > 10.0][::500]
    cosines = (far / np.linalg.norm(far, axis=1, keepdims=True)) @ pattern.directions.T
    assert np.degrees(np.arccos(np.clip(cosines.max(axis=1), -1, 1))).max() < 0.3


def test_a_capture_that_ends_in_a_packet_is_read_as_far_as_it_goes(
    data_dir: Path, tmp_path: Path
) -> None:
    pytest.importorskip("ouster.sdk")
    name = "OS-1-128_v2.3.0_1024x10"
    content = (data_dir / f"lidar/ouster/{name}_lb_n3.pcap").read_bytes()
    (tmp_path / "cut.pcap").write_bytes(content[: 6 * len(content) // 10])
    with pytest.raises(InputError, match=r"no metadata beside it: .* needs cut\.json.*: none"):
        open_scans(tmp_path / "cut.pcap")
    shutil.copy(data_dir / f"lidar/ouster/{name}.json", tmp_path / "cut.json")
    sequence = open_scans(tmp_path / "cut.pcap")
    assert any("cut off inside packet 133" in note for note in sequence.notes)
    whole, part = (scan.read() for scan in sequence)
    assert whole.complete
    assert len(whole.points_m) == 107_647
    assert not part.complete
    assert part.notes == ("208 of 1024 columns are missing",)
    # What did not come is no evidence of free space.
    assert part.pattern is not None
    assert part.pattern.beams == 128 * 816


@pytest.mark.parametrize(
    ("there", "found"),
    [
        (["drive.json", "drive_0.json"], "drive.json"),
        (["drive_0.json", "drive_1.json", "other.json"], "drive_0.json"),
        (["d.json", "dri.json", "drive-2.json"], "dri.json"),
    ],
)
def test_metadata_beside_packets(tmp_path: Path, there: list[str], found: str) -> None:
    """A longer name than the recording's is written by Ouster's own tools: NAME_0.json."""
    for name in ("drive.pcap", *there):
        (tmp_path / name).touch()
    assert metadata_beside(tmp_path / "drive.pcap").name == found


def test_an_ouster_recording_of_another_form_is_told_how_to_become_packets(tmp_path: Path) -> None:
    core, osf = pytest.importorskip("ouster.sdk.core"), pytest.importorskip("ouster.sdk.osf")
    path = tmp_path / "drive.osf"
    writer = osf.Writer(str(path), [core.SensorInfo.from_default(core.LidarMode._1024x10)])
    writer.close()
    with pytest.raises(InputError, match=r"an OSF recording .*: save it as packets \(`ouster-cli"):
        open_scans(path)
    content = bytearray(path.read_bytes())
    content[8:12] = b"XYZ!"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"bytes 8 to 11 of this one are b'XYZ!' instead of"):
        open_scans(path)
    path.write_bytes(b"")
    with pytest.raises(InputError, match=r"bytes 8 to 11 of this one are b'' instead of"):
        open_scans(path)


def test_packets_of_another_sensor_than_the_metadata_are_refused(
    data_dir: Path, tmp_path: Path
) -> None:
    pytest.importorskip("ouster.sdk")
    folder = data_dir / "lidar/ouster"
    shutil.copy(folder / "OS-0-128-U1_v2.3.0_1024x10.pcap", tmp_path / "a.pcap")
    shutil.copy(folder / "OS-1-128_v2.3.0_1024x10.json", tmp_path / "a.json")
    with pytest.raises(InputError, match=r"no packet in it of the sensor of a\.json \(OS-1-128\)"):
        list(open_scans(tmp_path / "a.pcap"))


@pytest.mark.parametrize("kept", [0, 10, 2000])
def test_damaged_ouster_metadata(data_dir: Path, tmp_path: Path, kept: int) -> None:
    pytest.importorskip("ouster.sdk")
    name = "OS-0-128-U1_v2.3.0_1024x10"
    shutil.copy(data_dir / f"lidar/ouster/{name}.pcap", tmp_path)
    content = (data_dir / f"lidar/ouster/{name}.json").read_bytes()
    (tmp_path / f"{name}.json").write_bytes(content[:kept])
    with pytest.raises(InputError, match=r"json: damaged or truncated Ouster metadata"):
        open_scans(tmp_path / f"{name}.pcap")


def test_packets_without_their_decoder_name_the_extra(
    data_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "velodyne_decoder")
    with pytest.raises(MissingExtraError, match=r"clearway\[lidar\]"):
        next(iter(open_scans(data_dir / "lidar/bag/vlp16_rosbag2")))
