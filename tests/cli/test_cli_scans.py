"""`clearway assess` on recordings as a user runs it: any scan of any format, or all of them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from in_process import Done, clearway
from own_process import run_clearway
from robot_messages import Message, Types, write_bag1, write_bag2, write_mcap

BAG = "lidar/bag/vlp16_rosbag2"


def assessed(*arguments: str | Path, cwd: Path) -> Done:
    return clearway("assess", *arguments, cwd=cwd)


def result_of(*arguments: str | Path, cwd: Path) -> dict[str, Any]:
    run = assessed(*arguments, "--json", cwd=cwd)
    assert run.exit_code == 0, run.stderr
    result: dict[str, Any] = json.loads(run.stdout)
    return result


def refused(*arguments: str | Path, cwd: Path) -> str:
    """The message of a run that must end with status 2, say why, and leave nothing behind."""
    before = sorted(cwd.rglob("*"))
    run = assessed(*arguments, cwd=cwd)
    assert run.exit_code == 2, run.stderr
    assert run.stdout == ""
    assert sorted(cwd.rglob("*")) == before
    return run.stderr


def test_what_reads_velodyne_packets_tells_nothing_at_the_end(
    data_dir: Path, tmp_path: Path
) -> None:
    if not (data_dir / BAG).is_dir():
        pytest.skip("needs data: a bag of a Velodyne")
    options = ("--range", "30", "--elevation-deg", "15", "--airframe-radius", "1.2", "--no-plots")
    done = run_clearway("assess", "--scan", data_dir / BAG, *options, cwd=tmp_path)
    assert done.returncode in (0, 1), done.stderr
    assert "velodyne" not in done.stderr
    assert "nanobind" not in done.stderr


def ball(ahead_m: float) -> np.ndarray:
    """Returns of a ball of half a metre straight ahead."""
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(400, 3))
    return 0.5 * directions / np.linalg.norm(directions, axis=1)[:, None] + [ahead_m, 0.0, 0.0]


def approach(types: Types) -> list[Message]:
    """A vehicle that flies at a ball 8 m ahead at 1 m/s, and what its LiDAR sees each second."""
    messages = []
    for n in range(3):
        odometry = types.odometry(100.0 + n, (float(n), 0.0, 2.0))
        cloud = types.cloud2(100.0 + n, "base_link", ball(8.0 - n))
        messages += [Message("/odom", 100.0 + n, odometry), Message("/points", 100.0 + n, cloud)]
    return messages


def every_format(folder: Path) -> dict[str, Path]:
    """The same scan in every format that can be written here."""
    import laspy
    from pypcd4 import PointCloud

    folder.mkdir()
    points = ball(4.0).astype(np.float32)
    paths = {suffix: folder / f"scan.{suffix}" for suffix in ("pcd", "bin", "npy", "csv", "laz")}
    PointCloud.from_points(points, ("x", "y", "z"), (np.float32,) * 3).save(paths["pcd"])
    np.column_stack([points, np.zeros(len(points))]).astype("<f4").tofile(paths["bin"])
    np.save(paths["npy"], points)
    np.savetxt(paths["csv"], points, delimiter=",")
    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.header.scales = [1e-5] * 3
    las.x, las.y, las.z = points.T.astype(np.float64)
    las.write(str(paths["laz"]))
    ros1, ros2 = Types(ros2=False), Types()
    message = [Message("/points", 1.0, ros2.cloud2(1.0, "lidar", points))]
    paths["bag"] = write_bag1(
        folder / "a.bag", ros1, [Message("/points", 1.0, ros1.cloud2(1.0, "lidar", points))]
    )
    paths["ROS 2 bag"] = write_bag2(folder / "bag2", ros2, message)
    paths["mcap"] = write_mcap(folder / "a.mcap", ros2, message)
    paths["folder"] = folder / "scans"
    paths["folder"].mkdir()
    shutil.copy(paths["bin"], paths["folder"] / "000000.bin")
    return paths


def test_the_same_scan_of_every_format_rates_the_same(tmp_path: Path) -> None:
    paths = every_format(tmp_path / "scans")
    results = {
        name: result_of("--scan", path, "--no-plots", cwd=tmp_path) for name, path in paths.items()
    }
    first = results["pcd"]
    assert np.array(first["hits"]).sum() == 400
    for name, result in results.items():
        assert result["hits"] == first["hits"], name
        np.testing.assert_allclose(result["detected"], first["detected"], atol=0.02, err_msg=name)


def test_any_scan_of_a_recording(data_dir: Path, tmp_path: Path) -> None:
    by_number = result_of(
        "--scan", data_dir / BAG, "--at", "3", "--no-plots", "--out", "a", cwd=tmp_path
    )
    by_time = result_of("--scan", data_dir / BAG, "--at", "0.31s", "--no-plots", cwd=tmp_path)
    assert by_time == by_number
    assert by_number["scans"][0]["pattern_from"] == "file"
    assert by_number["scans"][0]["pattern"] == "vlp16"
    assert sum(by_number["scans"][0]["points"].values()) >= 14_816
    first = result_of("--scan", data_dir / BAG, "--no-plots", "--pattern", "vlp16", cwd=tmp_path)
    assert first["hits"] != by_number["hits"]
    assert first["scans"][0]["pattern_from"] == "stated"
    again = result_of(tmp_path / "a" / "scene.toml", "--no-plots", cwd=tmp_path)
    unlike = {"name": "", "provenance": {}}
    assert {**again, **unlike} == {**by_number, **unlike}


def test_ouster_packets_know_their_beams(data_dir: Path, tmp_path: Path) -> None:
    pytest.importorskip("ouster.sdk")
    scan = data_dir / "lidar/ouster/OS-1-128_v2.3.0_1024x10_lb_n3.pcap"
    run = assessed("--scan", scan, "--at", "0.2s", "--range", "50", "--no-plots", cwd=tmp_path)
    assert run.exit_code == 0, run.stderr
    assert "scan        107532 points" in run.stdout
    assert "beams       file: OS-1-128 of its metadata, 128 x 1024" in run.stdout
    assert "metadata of OS-1-128_v2.3.0_1024x10.json" in run.stderr


def test_a_recorded_pose_places_map_and_scan(tmp_path: Path) -> None:
    """The ball is on the map where the scans see it, so both meet in one cell at every moment."""
    write_mcap(tmp_path / "a.mcap", Types(), approach(Types()))
    (tmp_path / "scene.toml").write_text(
        '[scan]\nfile = "a.mcap"\nat = 2\n'
        '[[obstacle]]\nshape = "ball"\nposition_m = [8, 0, 2]\nradius_m = 0.5\n'
    )
    result = result_of("scene.toml", "--no-plots", cwd=tmp_path)
    hits, base = np.array(result["hits"]), np.array(result["map_base"])
    assert hits.sum() == 400
    assert np.all(base[hits > 0] > 0.0)
    (tmp_path / "scene.toml").write_text(
        (tmp_path / "scene.toml").read_text() + "[vehicle]\nposition_m = [0, 0, 2]\n"
    )
    elsewhere = np.array(result_of("scene.toml", "--no-plots", cwd=tmp_path)["map_base"])
    assert np.all(elsewhere[hits > 0] == 0.0)


def test_where_the_sensor_sits_is_stated(tmp_path: Path) -> None:
    """A LiDAR that looks to the left sees straight ahead what is to its right."""
    np.save(tmp_path / "a.npy", ball(5.0) @ [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    scene = '[scan]\nfile = "a.npy"\n'
    (tmp_path / "scene.toml").write_text(scene)
    assert np.array(result_of("scene.toml", "--no-plots", cwd=tmp_path)["hits"]).sum() == 0
    (tmp_path / "scene.toml").write_text(
        scene + "attitude_deg = [0, 0, 90]\nposition_m = [1, 0, 0]\n"
    )
    hits = np.array(result_of("scene.toml", "--no-plots", cwd=tmp_path)["hits"])
    assert hits.sum() == 400
    assert hits[5:7].sum() == 400


# --- all of them ------------------------------------------------------------------------------


def test_a_recording_with_poses_is_played(tmp_path: Path) -> None:
    write_bag2(tmp_path / "flight", Types(), approach(Types()))
    result = result_of("--scan", "flight", "--all", cwd=tmp_path)
    assert result["poses"] is True
    assert result["left_out"] == {}
    scans = result["scans"]
    assert [one["scan"] for one in scans] == [0, 1, 2]
    assert [one["time_s"] for one in scans] == [100.0, 101.0, 102.0]
    assert [one["position_m"] for one in scans] == [[0, 0, 2], [1, 0, 2], [2, 0, 2]]
    assert [one["hits"] for one in scans] == [400, 400, 400]
    nearest = [one["nearest_m"] for one in scans]
    assert nearest == pytest.approx([7.5, 6.5, 5.5], abs=0.02)
    for one in scans:
        assert one["mode"] == "avoidance"
        assert one["clearance_m"] >= one["margin_m"] > 0.0
        assert 0.0 <= one["p_decision"] <= 1.0
        assert one["movements"]
        assert one["explanation"].startswith("avoidance: ")
    folder = tmp_path / "clearway-out" / "play-flight"
    left = {path.name for path in folder.iterdir() if not path.name.startswith(".")}
    assert left == {"playback.png", "result.json", "scene.toml"}
    assert json.loads((folder / "result.json").read_text()) == result


def test_real_scans_are_played_in_words(data_dir: Path, tmp_path: Path) -> None:
    run = assessed("--scan", data_dir / BAG, "--all", "--no-plots", cwd=tmp_path)
    assert run.exit_code == 0, run.stderr
    lines = run.stdout.splitlines()
    assert lines[0].endswith("frame velodyne: 4 decided, left out 0")
    assert lines[1] == "beams       file: vlp16"
    assert lines[2] == "vehicle     inertialess, 1 m/s"
    assert lines[3] == "poses       none: hovering, goal straight ahead, no memory"
    assert [line.split()[:3] for line in lines[5:9]] == [
        ["0", "0.000", "14885"],
        ["1", "0.100", "14845"],
        ["2", "0.200", "14868"],
        ["3", "0.301", "14816"],
    ]


def test_a_bench_about_the_sensor_is_told_and_what_is_near_beyond_it(
    data_dir: Path, tmp_path: Path
) -> None:
    run = assessed("--scan", data_dir / BAG, "--all", "--no-plots", cwd=tmp_path)
    told = " ".join(run.stderr.split())
    assert "probably a rig or a bench about the sensor" in told
    assert "--airframe-radius 1.2, leaves them out" in told
    assert "nearest return is 0.50 m away" in run.stdout.splitlines()[-1]
    run = assessed(
        *("--scan", data_dir / BAG, "--all", "--no-plots", "--airframe-radius", "1.2"),
        *("--vehicle", "plane"),
        cwd=tmp_path,
    )
    assert "still in each of" not in run.stderr
    assert "is assumed" not in run.stderr
    assert "nearest return is 1.20 m away" in run.stdout.splitlines()[-1]


def test_a_scan_of_which_nothing_is_kept_is_said_to_be_one(tmp_path: Path) -> None:
    np.save(tmp_path / "sweep.npy", np.random.default_rng(0).normal(5.0, 1.0, (500, 3)))
    options = ("--scan", "sweep.npy", "--no-plots", "--pattern", "vlp16")
    said = "sweep: not one return of a scan is kept, nothing seen counts: 500 airframe"
    assert said in assessed(*options, "--airframe-radius", "1000", cwd=tmp_path).stderr
    assert "not one return" not in assessed(*options, cwd=tmp_path).stderr


def test_scans_of_no_use_are_counted(tmp_path: Path) -> None:
    folder = tmp_path / "scans"
    folder.mkdir()
    for number, time_s in enumerate((1.0, 2.0, 2.0, 9.0)):
        np.save(folder / f"{number}.npy", ball(6.0))
        with (folder / "times.txt").open("a") as file:
            file.write(f"{time_s}\n")
    np.save(folder / "3.npy", np.full((5, 3), np.nan))
    (tmp_path / "poses.csv").write_text("1,0,0,0,0,0,0\n2,0,0,0,0,0,0\n3,0,0,0,0,0,0\n")
    result = result_of(
        "--scan", "scans", "--all", "--poses", "poses.csv", "--no-plots", cwd=tmp_path
    )
    assert [one["scan"] for one in result["scans"]] == [0, 1]
    assert result["left_out"] == {"not later than the one before": 1, "no pose at its time": 1}
    hovering = result_of("--scan", "scans", "--all", "--no-plots", cwd=tmp_path)
    assert [one["points"] for one in hovering["scans"]] == [400, 400]
    assert hovering["left_out"] == {"not later than the one before": 1, "without a point": 1}
    assert "5 not finite" in hovering["left_out_first"]["without a point"]


# --- what cannot be done ----------------------------------------------------------------------


def test_bad_recordings_and_options(data_dir: Path, tmp_path: Path) -> None:
    bag = data_dir / BAG
    np.save(tmp_path / "a.npy", ball(5.0))
    (tmp_path / "poses.csv").write_text("5,0,0,0,0,0,0\n6,1,0,0,0,0,0\n")
    (tmp_path / "simulated.toml").write_text("[scan.simulate]\n")
    (tmp_path / "both.toml").write_text("[scan]\nat = 1\n[scan.simulate]\n")
    wide = Types().cloud2(1.0, "lidar", np.array([[-5000.0, 0, 0], [5000.0, 0, 0]]))
    empty = Types().cloud2(1.0, "lidar", np.zeros((0, 3)))
    write_mcap(tmp_path / "wide.mcap", Types(), [Message("/points", 1.0, wide)])
    write_mcap(tmp_path / "empty.mcap", Types(), [Message("/points", 1.0, empty)])
    for arguments, message in (
        (("--scan", bag, "--topic", "/points"), "valid: /velodyne_packets (velodyne_msgs"),
        (("--scan", bag, "--at", "4"), "no scan number 4; it has 4, numbered 0 to 3"),
        (("--scan", bag, "--at", "soon"), "seconds such as 1.5s"),
        (("--scan", bag, "--poses", "/odom"), "no poses of topic '/odom'; valid: none in it"),
        (("--scan", "a.npy", "--topic", "/points"), "only bags and MCAP files have topics"),
        (("--scan", "a.npy", "--at", "1"), "no scan number 1; it has 1"),
        (("--scan", "a.npy", "--poses", "absent.csv"), "no such file of poses"),
        (
            ("--scan", "a.npy", "--poses", "poses.csv"),
            "poses.csv: no pose at scan 0, 0.000 s; it has 2 poses, from 5.000 to 6.000 s",
        ),
        (("--scan", "a.npy", "--all", "--at", "0"), "--at takes one scan, --all takes them all"),
        (("--all",), "nothing to assess"),
        (("simulated.toml", "--all"), "--all: needs a scan file, a folder of scans"),
        (("--scan", "a.npy", "--all", "--method", "full"), "decides with the reach set flying"),
        (("both.toml",), "`at` belong to `file`"),
        (("--scan", "wide.mcap"), "points extend 10,000 x 0 x 0 m"),
        (("--scan", "empty.mcap"), "no usable point in it"),
        (("--scan", "empty.mcap", "--all"), "no usable point in it"),
        (("--scan", "."), "a folder of scans needs files of one kind"),
    ):
        assert message in refused(*arguments, "--no-plots", cwd=tmp_path), message


def test_an_absent_package_is_told_by_its_extra_through_the_real_entry_point(
    tmp_path: Path,
) -> None:
    (tmp_path / "hidden").mkdir()
    for package in ("rosbags", "ouster", "pyulog"):
        (tmp_path / "hidden" / f"{package}.py").write_text("raise ImportError('hidden')\n")
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
    command = shutil.which("clearway", path=Path(sys.executable).parent)
    assert command is not None
    done = subprocess.run(
        [command, "assess", "--scan", "a.bag"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "hidden")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == (
        "reading a.bag needs an optional package: pip install 'clearway[lidar]'\n"
    ).replace("a.bag", str(tmp_path / "a.bag"))


def test_a_map_with_its_corner_at_the_origin_is_told_from_a_scan(tmp_path: Path) -> None:
    cells = np.stack(np.meshgrid(*[np.arange(1.0, 13.0)] * 3), axis=-1).reshape(-1, 3)
    np.save(tmp_path / "map.npy", cells)
    np.save(tmp_path / "scan.npy", cells - [0.0, 6.5, 3.0])
    said = {
        name: clearway("assess", "--scan", name, "--no-plots", cwd=tmp_path).stderr
        for name in ("map.npy", "scan.npy")
    }
    assert "a map with its corner at the origin" in said["map.npy"]
    assert "corner" not in said["scan.npy"]
