"""Every file of the shared data: read with the figures that its index states, or refused.

And a copy of each that is cut off: a clear error through the command, or a partial read that says
how far it went; never a traceback.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from clearway.io.foreign import read_json
from clearway.io.maps.cityjson import read_cityjson
from clearway.io.maps.faa_obstacles import read_faa_obstacles
from clearway.io.maps.maps import read_map
from clearway.io.maps.terrain_file import read_terrain
from clearway.io.plans.qgc_plan import read_plan
from clearway.io.plans.waypoint_file import read_waypoints
from clearway.io.poses.ulog import read_ulog
from clearway.io.scans.scan_formats import read_points
from clearway.io.scans.sequences import open_scans
from clearway.io.traffic.traffic import read_traffic
from in_process import clearway

TRAFFIC, MAP = ("traffic", "--json"), ("map", "--no-plots", "--json")
SCAN, FLY = ("assess", "--no-plots", "--json", "--scan"), ("fly", "--no-plots", "--json")


class Known(NamedTuple):
    """A file of the index."""

    command: tuple[str, ...]
    """That takes it, or says why not."""
    figures: Callable[[Path], Any]
    expected: Any
    with_files: tuple[str, ...] = ()
    """Files beside it without which it says nothing."""
    given: str = ""
    """What the command is given in its place: the file or folder that it belongs to."""
    cut: str = ""
    """What a copy cut in its middle is read as, where that is not refused."""


def traffic(path: Path) -> tuple[int, int]:
    """Messages, and addresses heard of."""
    recording = read_traffic(path)
    return recording.messages, len(recording.heard)


def points(path: Path) -> int:
    cloud = read_points(path)
    return len(cloud.points_m) + sum(cloud.counts.values())


def scans(path: Path) -> list[int]:
    """Points of each scan."""
    return [len(scan.read().points_m) for scan in open_scans(path)]


def on_map(path: Path) -> tuple[int, int]:
    """Obstacles with what was left out, and zones."""
    found = read_map(path)
    return len(found.obstacles) + sum(found.counts.values()), len(found.keep_out)


def buildings(path: Path) -> tuple[int, int]:
    """Buildings, also those left out as too low, and bridges."""
    found = read_cityjson(path, read_json(path))
    names = {feature.name for feature in found.features}
    low = sum(count for reason, count in found.counts.items() if reason.startswith("Building"))
    return sum(n.startswith("Building") for n in names) + low, sum(
        n.startswith("Bridge") for n in names
    )


def raster(path: Path) -> tuple[tuple[int, ...], float, float]:
    terrain = read_terrain(path).terrain
    assert terrain is not None
    height = terrain.height_m
    return height.shape, round(float(height.min()), 1), round(float(height.max()), 1)


def log(path: Path) -> tuple[int, int, float]:
    """Messages of traffic, those of nobody, and the height reached."""
    recording = read_traffic(path)
    top = float(np.max(read_ulog(path).track.position_m[:, 2]))
    return recording.messages, recording.left_out["no address"], round(top, 1)


def refused(path: Path) -> str:
    """The reason of a refusal."""
    done = clearway("traffic", path, cwd=path.parent)
    assert done.exit_code == 2
    return done.stderr.split("; it looks like ")[1].split(":")[0].split(",")[0].strip()


OS0, OS1 = "OS-0-128-U1_v2.3.0_1024x10", "OS-1-128_v2.3.0_1024x10"
BAG = "lidar/bag/vlp16_rosbag2/"
PACKETS = [14_885, 14_845, 14_868, 14_816]
OUSTER_1 = [107_647, 107_357, 107_532]
KNOWN = {
    "adsb/raw_atlanta_60s_20250729.csv": Known(TRAFFIC, traffic, (486, 9)),
    "adsb/beast_sample_dump1090.bin": Known(TRAFFIC, traffic, (239, 4)),
    # 1194 rows with a position, and 418 heartbeats.
    "adsb/tracks_brc_20min_20230830.jsonl": Known(TRAFFIC, traffic, (1194 + 418, 19)),
    "adsb/tracks_monterey_20250601.jsonl.gz": Known(TRAFFIC, traffic, (44_120, 521)),
    "adsb/readsb_trace_full_aa178d_c172.json.gz": Known(TRAFFIC, traffic, (985, 1)),
    "adsb/traj_calfire_202009.json.gz": Known(TRAFFIC, traffic, (9955, 45)),
    "adsb/traj_helicopter_samu31_20190517.json.gz": Known(TRAFFIC, traffic, (378, 1)),
    "daa/daidalus/Scenarios/C0_0_120.daa": Known(TRAFFIC, traffic, (242, 2)),
    "daa/daidalus/Scenarios/C1_0_120.daa": Known(TRAFFIC, traffic, (242, 2)),
    "daa/daidalus/Scenarios/H0_0_120.daa": Known(TRAFFIC, traffic, (242, 2)),
    "daa/daidalus/Scenarios/H1.daa": Known(TRAFFIC, traffic, (2 * 230, 2)),
    "daa/bluesky/super16.scn": Known(
        TRAFFIC, traffic, (24, 16), cut="the last one, has no line end: cut off?"
    ),
    "daa/bluesky/wall.scn": Known(TRAFFIC, traffic, (21, 1 + 20)),
    "daa/bluesky/ASAS-05.scn": Known(TRAFFIC, traffic, (59, 2)),
    "daa/daidalus/gold/DaidalusqAlerting-no_sum.csv": Known(
        TRAFFIC, refused, "output of DAIDALUS (alert levels by time)"
    ),
    "daa/daidalus/Configurations/DO_365A_no_SUM.conf": Known(
        TRAFFIC, refused, "parameters of DAIDALUS"
    ),
    "daa/daidalus/Configurations/DO_365B_no_SUM.conf": Known(
        TRAFFIC, refused, "parameters of DAIDALUS"
    ),
    **{
        f"daa/em-models/{model}.txt": Known(
            TRAFFIC, refused, "an encounter model (Bayesian network of aircraft tracks)"
        )
        for model in (
            "balloon_v1",
            "fai1_v1",
            "haa_v1",
            "paraglider_v1",
            "skydiving_v1",
            "uncor_1200exclude_fwme_v1p2",
            "uncor_1200only_fwse_v1p2",
            "uncor_allcode_rotorcraft_v1",
        )
    },
    "logs/px4_sitl_sample_px4_events.ulg": Known(
        TRAFFIC, log, (583 + 1, 1, 2.2), cut="bytes are half a record; what is before was read"
    ),
    f"lidar/ouster/{OS1}_lb_n3.pcap": Known(
        SCAN, scans, OUSTER_1, with_files=(f"{OS1}.json",), cut="cut off inside packet 133"
    ),
    f"lidar/ouster/{OS1}.json": Known(
        SCAN,
        lambda path: scans(path.with_name(f"{OS1}_lb_n3.pcap")),
        OUSTER_1,
        with_files=(f"{OS1}_lb_n3.pcap",),
        given=f"{OS1}_lb_n3.pcap",
    ),
    f"lidar/ouster/{OS0}.pcap": Known(
        SCAN, scans, [97_299], with_files=(f"{OS0}.json",), cut="cut off inside packet 44"
    ),
    f"lidar/ouster/{OS0}.json": Known(
        SCAN,
        lambda path: scans(path.with_suffix(".pcap")),
        [97_299],
        with_files=(f"{OS0}.pcap",),
        given=f"{OS0}.pcap",
    ),
    f"{BAG}1673400471837873222_0.db3": Known(SCAN, scans, PACKETS, with_files=("metadata.yaml",)),
    f"{BAG}metadata.yaml": Known(
        SCAN,
        lambda path: scans(path.parent),
        PACKETS,
        with_files=("1673400471837873222_0.db3",),
        given=".",
    ),
    "lidar/pcd/vlp16_1673400472138016708.pcd": Known(SCAN, points, 14_831),
    "lidar/pcd/vls128_1585897255376374245.pcd": Known(SCAN, points, 208_680),
    "lidar/aerial/autzen_trim.laz": Known(SCAN, points, 110_000),
    "lidar/aerial/nebraska_tree_building.las": Known(SCAN, points, 25_408),
    "lidar/aerial/ahn_powerline_12AN2_20.laz": Known(SCAN, points, 624_961),
    "maps/voxel/skir.bag": Known(SCAN, scans, [290_725]),
    "maps/obstacles/LAC_obstacles_v1.csv": Known(MAP, on_map, (73, 0)),
    "maps/obstacles/faa_dof_5records_ASSEMBLED.dat": Known(
        MAP, lambda path: len(read_faa_obstacles(path, 20.0).features), 5
    ),
    "maps/obstacles/Cologne_DEM_merged_from_LAS_25x25.tif": Known(
        MAP, raster, ((440, 520), 37.4, 81.2)
    ),
    "maps/geozones/cis_source_sample_ed318.json": Known(MAP, on_map, (0, 3)),
    "maps/geozones/cis_source_sample_ed269.json": Known(MAP, on_map, (0, 1)),
    "maps/cityjson/delft.city.json": Known(MAP, buildings, (160, 3)),
    "maps/missions/qgc_MissionPlanner.waypoints": Known(
        FLY, lambda path: len(read_waypoints(path).items), 5
    ),
    "maps/missions/mavsdk_qgroundcontrol_sample.plan": Known(
        FLY, lambda path: len(read_plan(path).items), 5
    ),
}


OF_STUDIES = ("worlds/", "daa/horizontalcas/")
"""Rivals' worlds and networks: tables of numbers that no reader takes for anything."""


def test_no_file_of_the_index_is_forgotten(data_dir: Path) -> None:
    there = {
        str(path.relative_to(data_dir))
        for path in data_dir.rglob("*")
        if path.is_file() and "licenses" not in path.parts and path.name != "INDEX.md"
    }
    read = {name for name in there if not name.startswith(OF_STUDIES)}
    assert read == set(KNOWN)
    rows = re.findall(r"^\| (\S+/\S+?)(?:, \S+)? \|", (data_dir / "INDEX.md").read_text(), re.M)
    assert len(rows) > 35
    assert {row for row in rows if not row.startswith(OF_STUDIES) and "{" not in row} <= set(KNOWN)


@pytest.mark.parametrize("name", KNOWN)
def test_each_is_read_as_the_index_says_or_refused(data_dir: Path, name: str) -> None:
    known = KNOWN[name]
    assert known.figures(data_dir / name) == known.expected


@pytest.mark.nightly
@pytest.mark.parametrize("name", KNOWN)
def test_a_copy_cut_off_is_refused_or_says_how_far_it_goes(
    data_dir: Path, tmp_path: Path, name: str
) -> None:
    known, whole = KNOWN[name], data_dir / name
    for beside in known.with_files:
        shutil.copy(whole.parent / beside, tmp_path)
    content, file = whole.read_bytes(), tmp_path / whole.name
    for kept in (6 * len(content) // 10, 10, 0):
        file.write_bytes(content[:kept])
        given = tmp_path / known.given if known.given else file
        done = clearway(*known.command, given, cwd=tmp_path)
        if known.cut and kept > 10:
            assert done.exit_code == 0, done.stderr
            assert known.cut in done.stderr + done.stdout
        elif done.exit_code == 0:
            assert "truncated: " in done.stdout
        else:
            assert done.exit_code == 2
            assert done.stdout == ""
            assert str(tmp_path) in done.stderr
            assert "Traceback" not in done.stderr
    shutil.rmtree(tmp_path / "clearway-out", ignore_errors=True)
    assert {path.name for path in tmp_path.iterdir()} == {file.name, *known.with_files}
