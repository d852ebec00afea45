"""`clearway assess` on clouds of cameras, on broken recordings, and for the vehicle that flies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.io.samples.recordings import write_mcap_sample as write_flight
from in_process import Done, clearway
from repository import REPOSITORY
from robot_messages import Message, Types, write_mcap

BAD = REPOSITORY.parent / "shared" / "bad_input"
CAMERA = "camera_depth_optical_frame"
QUIET = ("--no-plots", "--json")


def wall() -> np.ndarray:
    """Returns of a wall 6 m ahead, x ahead."""
    y, z = np.meshgrid(np.linspace(-3.0, 3.0, 80), np.linspace(-1.9, 2.1, 60))
    return np.stack([np.full(y.size, 6.0), y.ravel(), z.ravel()], axis=-1)


def optical(points_m: np.ndarray) -> np.ndarray:
    """z ahead, x right, y down."""
    return np.stack([-points_m[:, 1], -points_m[:, 2], points_m[:, 0]], axis=-1)


def recorded(path: Path, frame: str, *clouds: np.ndarray) -> Path:
    types = Types()
    messages = [
        Message("/points", 1.0 + n, types.cloud2(1.0 + n, frame, points))
        for n, points in enumerate(clouds)
    ]
    return write_mcap(path, types, messages)


def result_of(*arguments: object, cwd: Path) -> dict[str, Any]:
    done = clearway("assess", *arguments, *QUIET, cwd=cwd)
    assert done.exit_code == 0, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def told(done: Done) -> str:
    return " ".join(done.stderr.split())


def test_a_wall_ahead_is_the_same_whichever_axes_it_is_told_in(tmp_path: Path) -> None:
    recorded(tmp_path / "lidar.mcap", "velodyne", wall(), wall())
    recorded(tmp_path / "camera.mcap", CAMERA, optical(wall()), optical(wall()))
    np.save(tmp_path / "camera.npy", optical(wall().astype(np.float32)))
    expected = result_of("--scan", "lidar.mcap", "--all", cwd=tmp_path)["scans"]
    assert all(one["hits"] == len(wall()) for one in expected)
    by_name = clearway("assess", "--scan", "camera.mcap", "--all", *QUIET, cwd=tmp_path)
    assert json.loads(by_name.stdout)["scans"] == expected
    assert f"as the frame {CAMERA} is called; --frame body leaves them" in told(by_name)
    one = result_of("--scan", "lidar.mcap", cwd=tmp_path)
    for arguments in (("camera.mcap",), ("camera.npy", "--frame", "optical")):
        other = result_of("--scan", *arguments, cwd=tmp_path)
        for key in ("hits", "detected", "visibility", "rating", "reachability", "space"):
            assert other[key] == one[key], key


def test_a_scene_keeps_the_axes_that_were_stated(tmp_path: Path) -> None:
    np.save(tmp_path / "camera.npy", optical(wall()))
    stated = result_of("--scan", "camera.npy", "--frame", "optical", "--out", "a", cwd=tmp_path)
    again = result_of(tmp_path / "a" / "scene.toml", cwd=tmp_path)
    assert again["hits"] == stated["hits"]
    (tmp_path / "scene.toml").write_text('[scan]\nfile = "camera.npy"\nframe = "optical"\n')
    assert result_of("scene.toml", cwd=tmp_path)["hits"] == stated["hits"]


def test_axes_that_nobody_states_are_asked_about_and_nothing_is_left_behind(tmp_path: Path) -> None:
    (tmp_path / "scans").mkdir()
    for number in range(2):
        np.save(tmp_path / "scans" / f"{number}.npy", optical(wall()))
    recorded(tmp_path / "camera.mcap", "camera_link", optical(wall()))
    ways = (("scans", "--all"), ("scans",), ("camera.mcap", "--all"), ("camera.mcap",))
    for arguments in ways:
        done = clearway("assess", "--scan", *arguments, *QUIET, cwd=tmp_path)
        assert done.exit_code == 2
        assert "--frame optical" in told(done)
        assert "--frame body" in told(done)
    assert not (tmp_path / "clearway-out").exists()
    for arguments in ways:
        stated = clearway("assess", "--scan", *arguments, "--frame", "body", *QUIET, cwd=tmp_path)
        assert stated.exit_code == 0
        assert "nothing ahead was seen" in told(stated)


def test_an_attitude_that_may_turn_twice_is_asked_about(tmp_path: Path) -> None:
    """A camera that looks down by 20 deg, by a scene: of its own axes, or of the file's."""
    recorded(tmp_path / "camera.mcap", CAMERA, optical(wall()))
    scene = '[scan]\nfile = "camera.mcap"\nattitude_deg = [-90, 0, -90]\n'
    (tmp_path / "scene.toml").write_text(scene)
    done = clearway("assess", "scene.toml", *QUIET, cwd=tmp_path)
    assert done.exit_code == 2
    assert "may turn its points twice" in told(done)
    (tmp_path / "scene.toml").write_text(scene + 'frame = "body"\n')
    by_hand = np.array(result_of("scene.toml", cwd=tmp_path)["hits"])
    assert by_hand.sum() == len(wall())
    ahead = scene.replace("[-90, 0, -90]", "[0, 0, 0]") + 'frame = "optical"\n'
    (tmp_path / "scene.toml").write_text(ahead)
    np.testing.assert_array_equal(result_of("scene.toml", cwd=tmp_path)["hits"], by_hand)


@pytest.mark.parametrize(
    ("turn", "where"),
    [((2, -1.0), "below"), ((1, 1.0), "left of"), ((1, -1.0), "right of"), ((0, -1.0), "behind")],
)
def test_a_sensor_that_looks_elsewhere_is_assessed_with_a_note(
    tmp_path: Path, turn: tuple[int, float], where: str
) -> None:
    """A survey from above, a camera to the side: that is how it may be."""
    axis, sign = turn
    points = np.roll(wall(), axis, axis=1) * [sign if n == axis else 1.0 for n in range(3)]
    np.save(tmp_path / "scan.npy", points)
    done = clearway("assess", "--scan", "scan.npy", *QUIET, cwd=tmp_path)
    assert done.exit_code == 0
    assert f"all points lie {where} the vehicle, so nothing ahead was seen" in told(done)


@pytest.mark.parametrize("name", ["optical", "lidar"])
def test_the_wall_of_the_bag_that_was_not_seen(name: str, tmp_path: Path) -> None:
    path = BAD / f"{name}_frame_wall_6m_ahead.bag"
    if not path.is_file():
        pytest.skip("needs data: bags of a wall, in bad_input beside the data folder")
    scans = result_of("--scan", path, "--all", cwd=tmp_path)["scans"]
    assert [one["hits"] for one in scans] == [4800] * 3
    assert all(one["movements"] != ["Straight"] * 10 for one in scans)


# --- recordings with something broken in them ------------------------------------------------


def test_an_empty_cloud_is_counted_and_does_not_end_a_recording(tmp_path: Path) -> None:
    recorded(
        tmp_path / "a.mcap", "lidar", wall(), np.zeros((0, 3)), np.full((9, 3), np.nan), wall()
    )
    done = clearway("assess", "--scan", "a.mcap", "--all", "--no-plots", cwd=tmp_path)
    assert done.exit_code == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].endswith("2 decided, left out 2 without a point")
    assert "left out    scan 1 without a point" in done.stdout
    result = json.loads((tmp_path / "clearway-out/play-a/result.json").read_text())
    assert result["left_out"] == {"without a point": 2}
    assert [one["scan"] for one in result["scans"]] == [0, 3]


def test_without_a_number_the_first_usable_scan_is_assessed(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap", "lidar", np.zeros((0, 3)), wall())
    done = clearway("assess", "--scan", "a.mcap", *QUIET, cwd=tmp_path)
    assert done.exit_code == 0
    assert "a.mcap: left out scan 0 without a point" in told(done)
    assert np.array(json.loads(done.stdout)["hits"]).sum() == len(wall())
    assert clearway("assess", "--scan", "a.mcap", "--at", "0", *QUIET, cwd=tmp_path).exit_code == 2


def test_one_wrong_stamp_does_not_take_all_later_scans_along(tmp_path: Path) -> None:
    types, messages = Types(), []
    for n, stamp in enumerate((1.0, 2.0, 9e8, 4.0, 5.0)):
        messages.append(Message("/points", 1.0 + n, types.cloud2(stamp, "lidar", wall())))
    write_mcap(tmp_path / "a.mcap", types, messages)
    result = result_of("--scan", "a.mcap", "--all", cwd=tmp_path)
    assert [one["scan"] for one in result["scans"]] == [0, 1, 3, 4]
    assert result["left_out"] == {"later than the one after it": 1}


def test_the_empty_cloud_that_ended_a_recording(tmp_path: Path) -> None:
    path = BAD / "empty_cloud_in_the_middle.mcap"
    if not path.is_file():
        pytest.skip("needs data: a recording with an empty cloud, in bad_input")
    result = result_of("--scan", path, "--all", cwd=tmp_path)
    assert [one["scan"] for one in result["scans"]] == [0, 2]
    assert result["left_out"] == {"without a point": 1}


# --- the vehicle -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples")
    write_flight(folder / "flight.mcap", np.random.default_rng(0))
    return folder


@pytest.mark.parametrize(
    "range_m",
    [
        15,
        *(pytest.param(one, marks=pytest.mark.nightly) for one in (20, 30, 50)),
    ],
)
def test_the_sample_flight_is_flown_on_at_any_range(range_m: int, samples: Path) -> None:
    """A copter stops before what it has not seen; a plane must know where to turn round."""
    flight = ("--scan", "flight.mcap", "--all", "--airframe-radius", "0.5", "--range", range_m)
    done = clearway("assess", *flight, *QUIET, cwd=samples)
    result = json.loads(done.stdout)
    assert {one["mode"] for one in result["scans"]} <= {"navigation", "avoidance"}
    assert result["vehicle"] == {"kind": "inertialess", "speed_mps": range_m / 10.0}
    assert f"an inertialess one of up to {range_m / 10.0:g} m/s is assumed; state yours" in told(
        done
    )


def test_a_plane_is_stated_and_what_it_lacks_is_told(samples: Path) -> None:
    flight = ("--scan", "flight.mcap", "--all", "--airframe-radius", "0.5", "--range", "30")
    done = clearway("assess", *flight, "--vehicle", "plane", "--no-plots", cwd=samples)
    assert "is assumed" not in done.stderr
    assert "vehicle     plane, 3 m/s" in done.stdout
    assert "no plan of a plane at 3 m/s keeps an escape" in done.stdout
    assert "--vehicle inertialess can stop" in done.stdout


def test_the_vehicle_of_a_scene_and_of_one_moment(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap", "lidar", wall())
    scene = tmp_path / "scene.toml"
    scene.write_text('[scan]\nfile = "a.mcap"\n[vehicle]\nkind = "plane"\n')
    plane = clearway("assess", "scene.toml", "--no-plots", cwd=tmp_path)
    assert "plane, 1 m/s" in plane.stdout
    assert "is assumed" not in plane.stderr
    copter = clearway("assess", "--scan", "a.mcap", "--no-plots", cwd=tmp_path)
    assert "inertialess, 1 m/s" in copter.stdout
    scene.write_text("[grid]\n")
    assert "plane, 1 m/s" in clearway("assess", "scene.toml", "--no-plots", cwd=tmp_path).stdout
    wrong = clearway("assess", "scene.toml", "--vehicle", "boat", "--no-plots", cwd=tmp_path)
    assert wrong.exit_code == 2
    assert "vehicle.kind: should be 'plane', 'multirotor' or 'inertialess'" in told(wrong)


def test_a_kind_alone_leaves_the_vehicle_where_it_was_recorded(tmp_path: Path) -> None:
    types = Types()
    messages = [
        Message("/odom", 1.0, types.odometry(1.0, (7.0, 0.0, 2.0))),
        Message("/points", 1.0, types.cloud2(1.0, "base_link", wall())),
    ]
    write_mcap(tmp_path / "a.mcap", types, messages)
    scene = '[scan]\nfile = "a.mcap"\n[[obstacle]]\nshape = "ball"\nposition_m = [13, 0, 2]\n'
    scene += "radius_m = 0.5\n"
    (tmp_path / "scene.toml").write_text(scene + '[vehicle]\nkind = "plane"\n')
    result = result_of("scene.toml", "--out", "a", cwd=tmp_path)
    assert np.array(result["map_base"]).max() > 0.0
    again = result_of(tmp_path / "a" / "scene.toml", cwd=tmp_path)
    assert again["map_base"] == result["map_base"]
