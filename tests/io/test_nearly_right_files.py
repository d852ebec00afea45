"""Files that nearly fit: read with what is stated beside them, or told what they are."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.base.plain_text import LONGEST_MESSAGE
from clearway.io.maps.maps import read_maps
from clearway.io.samples import maps, plans, scans, telemetry, traffic
from clearway.io.scans.scan_formats import read_points
from clearway.io.traffic.traffic import read_traffic
from clearway.io.what_file import what_content
from clearway.missions.world_file import read_mission
from in_process import clearway

TLOG_CUTS = (0.3, 0.5, 0.77, 0.999)
RNG = np.random.default_rng(0)


def test_the_traffic_library_s_own_json_is_what_its_rows_say(tmp_path: Path) -> None:
    traffic.write_trajectories(tmp_path / "rows.json", RNG)
    traffic.write_trajectory_columns(tmp_path / "columns.json", RNG)
    rows, columns = (read_traffic(tmp_path / name) for name in ("rows.json", "columns.json"))
    assert columns.reports == rows.reports
    assert len(rows.reports) == 242


@pytest.mark.parametrize("kept", [0.2, 0.7])
def test_columns_that_are_cut_off_are_refused(tmp_path: Path, kept: float) -> None:
    traffic.write_trajectory_columns(tmp_path / "a.json", RNG)
    content = (tmp_path / "a.json").read_bytes()
    (tmp_path / "a.json").write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError, match="no whole JSON object"):
        read_traffic(tmp_path / "a.json")


def write_raster(path: Path, heights: Any, **about: Any) -> Path:
    rasterio = pytest.importorskip("rasterio")
    transform = rasterio.transform.from_origin(428_000.0, 5_539_000.0, 100.0, 100.0)
    with rasterio.open(
        path, "w", driver="GTiff", width=heights.shape[1], height=heights.shape[0], count=1,
        dtype="float32", crs="EPSG:25832", transform=transform,
    ) as raster:  # fmt: skip
        raster.write(heights.astype("float32"), 1)
        raster.update_tags(**about)
    return path


@pytest.mark.parametrize(
    ("name", "heights", "about", "told"),
    [
        ("population_2020.tif", 50.0 + np.zeros((6, 8)), {}, "'population'"),
        ("cells.tif", 50.0 + np.zeros((6, 8)), {"TITLE": "Population count"}, "'population'"),
        ("counts.tif", RNG.permutation(np.linspace(0.0, 5000.0, 48)).reshape(6, 8), {}, "45 deg"),
    ],
)
def test_what_is_hardly_terrain_is_told(
    tmp_path: Path, name: str, heights: Any, about: dict[str, str], told: str
) -> None:
    (found,) = read_maps([write_raster(tmp_path / name, heights, **about)])
    assert any("IS THIS TERRAIN?" in note and told in note for note in found.notes)


def test_a_slope_is_terrain_whose_unit_nobody_tells(tmp_path: Path) -> None:
    heights = np.add.outer(np.arange(6.0), 20.0 * np.arange(8.0))
    (found,) = read_maps([write_raster(tmp_path / "ground.tif", heights)])
    assert not any("IS THIS TERRAIN" in note for note in found.notes)
    assert any("nothing in the file says that its band is heights" in note for note in found.notes)


def test_a_class_that_strays_is_left_out_before_the_tile_is_measured(tmp_path: Path) -> None:
    laspy = pytest.importorskip("laspy")
    scans.write_survey(tmp_path / "survey.las", RNG)
    tile = laspy.read(tmp_path / "survey.las")
    tile.classification[:3] = 5
    tile.x = np.where(np.arange(len(tile.x)) < 3, np.array(tile.x) + 2e6, np.array(tile.x))
    tile.write(tmp_path / "survey.las")
    with pytest.raises(InputError, match="leave_out_classes leaves noise out"):
        read_points(tmp_path / "survey.las")
    cloud = read_points(tmp_path / "survey.las", [5])
    assert cloud.counts["class not wanted"] == 3
    assert np.ptp(cloud.points_m, axis=0).max() < 100.0
    with pytest.raises(InputError, match="no usable point in it"):
        read_points(tmp_path / "survey.las", [2, 5, 6])


def test_a_model_without_reference_system_takes_one_that_is_stated(tmp_path: Path) -> None:
    maps.write_cityjson(tmp_path / "city.json", RNG)
    (whole,) = read_maps([tmp_path / "city.json"])
    city = json.loads((tmp_path / "city.json").read_text())
    del city["metadata"]
    (tmp_path / "city.json").write_text(json.dumps(city))
    with pytest.raises(InputError, match="--crs EPSG:7415"):
        read_maps([tmp_path / "city.json"])
    (found,) = read_maps([tmp_path / "city.json"], crs="EPSG:25832")
    assert found.origin == whole.origin
    assert "EPSG:25832 as stated" in found.notes
    with pytest.raises(InputError):
        read_maps([tmp_path / "city.json"], crs="EPSG:nonsense")


@pytest.mark.parametrize("home", [[50.0, 8.0, 100.0], [0.0, 0.0, 0.0]])
def test_fences_alone_serve_a_mission_with_waypoints_of_its_own(
    tmp_path: Path, home: list[float]
) -> None:
    pytest.importorskip("shapely")
    plans.write_plan_sample(tmp_path / "fence.plan", RNG)
    plan = json.loads((tmp_path / "fence.plan").read_text())
    plan["mission"] |= {"items": [], "plannedHomePosition": home}
    (tmp_path / "fence.plan").write_text(json.dumps(plan))
    with pytest.raises(InputError, match=r"no waypoint in it: .*fences alone will do"):
        read_mission(tmp_path / "fence.plan")
    (tmp_path / "own.toml").write_text(
        '[mission]\nname = "own"\nplan = "fence.plan"\nwaypoints_m = [[10, 0, 30]]\n'
        "origin_geodetic = [50.0, 8.0, 100.0]\n[vehicle]\nposition_m = [0, 0, 30]\n"
    )
    told: list[str] = []
    mission = read_mission(tmp_path / "own.toml", told.append)
    assert mission.mission.waypoints_m == ((10.0, 0.0, 30.0),)
    assert len(mission.obstacle) > 3
    assert any("its 1 fences are taken" in note for note in told)


@pytest.mark.parametrize(
    ("head", "told"),
    [
        (b"\x00\x06\x25\x80" + bytes(4) + b"\xfd\x09\x00\x00", "`clearway traffic` takes it"),
        (b"\x00\x05\x25\x80" + bytes(4) + b"\xfe\x09\x00\x00", "`clearway traffic` takes it"),
        (b"\xa3\x95\x80\x80\x59FMT", "DataFlash log"),
        (struct.pack("<II", 100, 24) + b"OSF!" + bytes(20), "OSF recording"),
        (b"PK\x03\x04\x14\x00", "a zip archive: unpack it"),
    ],
)
def test_what_no_command_takes_is_told_by_name(head: bytes, told: str) -> None:
    assert told in what_content(head)


def test_a_telemetry_log_has_the_own_way_and_what_was_heard(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    telemetry.write_telemetry(tmp_path / "a.tlog", RNG)
    traffic.write_states_table(tmp_path / "a.csv", RNG)
    recording, other = read_traffic(tmp_path / "a.tlog"), read_traffic(tmp_path / "a.csv")
    drone = next(one.address for one in recording.reports if one.source == "remote id")
    assert recording.heard == {"own": 121, "3c0001": 121, "3c0002": 121, drone: 121}
    assert recording.own_address == "own"
    heard = [one for one in recording.reports if one.address not in ("own", drone)]
    for mine, theirs in zip(heard, other.reports, strict=True):
        assert (mine.address, mine.callsign) == (theirs.address, theirs.callsign)
        assert mine.time_s == pytest.approx(theirs.time_s, abs=0.02)
        for name in ("latitude_deg", "longitude_deg"):
            assert getattr(mine, name) == pytest.approx(getattr(theirs, name), abs=1e-6)
        for name in ("altitude_m", "ground_speed_mps", "track_rad"):
            assert getattr(mine, name) == pytest.approx(getattr(theirs, name), abs=0.01)
    own = [one for one in recording.reports if one.address == "own"]
    assert own[0].altitude_m == pytest.approx(168.0)
    assert own[0].altitude_kind == "geometric"


@pytest.mark.parametrize("kept", TLOG_CUTS)
def test_a_telemetry_log_that_is_cut_or_damaged_is_read_around_it(
    tmp_path: Path, kept: float
) -> None:
    pytest.importorskip("pymavlink")
    telemetry.write_telemetry(tmp_path / "a.tlog", RNG)
    content = (tmp_path / "a.tlog").read_bytes()
    end = int(kept * len(content))
    (tmp_path / "a.tlog").write_bytes(content[:end])
    cut = read_traffic(tmp_path / "a.tlog")
    assert 0 < len(cut.reports) < 484
    # Somewhere in the middle other bytes: what is before and behind them is read.
    (tmp_path / "a.tlog").write_bytes(content[:end] + b"\x00\xff" * 9 + content[end:])
    damaged = read_traffic(tmp_path / "a.tlog")
    assert len(damaged.reports) >= 360 or kept > 0.99
    assert damaged.left_out.get("damaged", 0) + damaged.left_out.get("cut off", 0) >= 1


@pytest.mark.parametrize(
    ("command", "name", "content", "taken"),
    [
        (("fly",), "a.csv", "id,lat,lon,h\n1,47,8,30\n", "clearway map"),
        (
            ("assess",),
            "s.pcd",
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\n",
            "clearway assess --scan",
        ),
        (("traffic",), "a.csv", "name,lat,lon,height\nx,47,8,30\n", "clearway map"),
        (("map",), "a.csv", "1753827785.8,8dada5265851e6616376c2eb4463\n", "clearway traffic"),
        (("replay",), "m.toml", "[mission]\nname = 'm'\n", "clearway fly"),
        (("campaign",), "p.plan", '{"fileType": "Plan"}', "clearway fly"),
        (("risk",), "c.toml", "[[family]]\nfamily = 'balls'\n", "clearway campaign"),
        (("alerts",), "s.toml", "[[obstacle]]\nshape = 'ball'\n", "clearway assess"),
        (("traffic",), "t.csv", "tie,icao24,lat,lon,velocity,height\n", "clearway map"),
    ],
)
def test_a_file_of_another_kind_brings_the_command_that_takes_it(
    tmp_path: Path, command: tuple[str, ...], name: str, content: str, taken: str
) -> None:
    (tmp_path / name).write_text(content)
    done = clearway(*command, name, cwd=tmp_path)
    assert done.returncode == 2
    assert f"{name}: it looks like" in done.stderr
    assert f"`{taken}` takes" in done.stderr
    assert max(map(len, done.stderr.splitlines())) <= LONGEST_MESSAGE


OWN = [
    ("traffic masts.csv", "clearway map"),
    ("alerts masts.csv", "clearway map"),
    ("assess --scan masts.csv", "clearway map"),
    ("traffic masts.dat", "clearway map"),
    ("traffic sweep.csv", "clearway assess --scan"),
    ("fly robot.yaml", "clearway ros2"),
    ("fly volumes.toml", "clearway alerts --volumes"),
]


def test_clearways_own_samples_bring_the_command_that_takes_them(samples: Path) -> None:
    for line, taken in OWN:
        done = clearway(*line.split(), cwd=samples)
        assert done.returncode == 2
        assert f"{line.split()[-1]}: it looks like" in done.stderr, line
        assert f"`{taken}` takes" in done.stderr, line
        assert len(done.stderr.strip()) <= LONGEST_MESSAGE


def test_what_a_command_takes_is_not_sent_to_itself(tmp_path: Path) -> None:
    (tmp_path / "s.pcd").write_text("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\n")
    (tmp_path / "m.toml").write_text("[mission]\nnmae = 'm'\n")
    for command in (("assess", "--scan", "s.pcd"), ("fly", "m.toml"), ("compare", "m.toml")):
        done = clearway(*command, cwd=tmp_path)
        assert done.returncode == 2
        assert "looks like" not in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        ("assess", "--scan"),
        ("map",),
        ("traffic",),
        ("replay",),
        ("campaign", "--summary"),
        ("fly",),
    ],
)
def test_what_is_not_there_is_not_called_damaged(tmp_path: Path, command: tuple[str, ...]) -> None:
    (tmp_path / "flight.mcap").touch()
    done = clearway(*command, "flihgt.mcap", cwd=tmp_path)
    assert done.returncode == 2
    assert "No such file" in done.stderr or "no such" in done.stderr
    assert "flight.mcap" in done.stderr


@pytest.mark.parametrize(
    ("names", "taken"),
    [
        (("metadata.yaml", "a_0.db3"), "clearway assess --scan"),
        (("0.pcd", "1.pcd"), "clearway assess --scan"),
        (("run.mcap", "summary.json", "mission.toml"), "clearway replay"),
    ],
)
def test_a_folder_brings_the_command_that_takes_it(
    tmp_path: Path, names: tuple[str, ...], taken: str
) -> None:
    (tmp_path / "given").mkdir()
    for name in names:
        (tmp_path / "given" / name).write_text("")
    for command in (("assess",), ("fly",), ("map",), ("traffic",)):
        done = clearway(*command, "given", cwd=tmp_path)
        assert done.returncode == 2
        assert "it looks like" in done.stderr
        assert f"`{taken}` takes it" in done.stderr
