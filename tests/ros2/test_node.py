"""The node told by hand: what comes in, what goes out, and what becomes of everything wrong."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.base.errors import InputError
from clearway.ros2.clouds import read_cloud_points
from clearway.ros2.messages import damages, make_message, pack_message, unpack_cdr
from clearway.ros2.parameter_file import read_parameters
from clearway.ros2.parameters import Names
from clearway.ros2.told import header, point
from clearway.ros2.transforms import MOST_GAPS, Transforms
from ros2_for_tests import (
    BEGAN_S,
    RosBench,
    cloud,
    odometry,
    transform,
    transponder,
)


@pytest.fixture
def bench() -> RosBench:
    return RosBench()


def test_it_flies_and_says_so_in_every_way(bench: RosBench) -> None:
    outcome = bench.fly(3)
    assert str(outcome.state) == "flying"
    row = json.loads(bench.sent("/clearway/decision")[-1].data)
    assert row["mode"] in ("navigation", "avoidance")
    assert row["explanation"]
    plan = bench.sent("/clearway/plan")[-1]
    assert plan.header.frame_id == "map"
    assert plan.poses[-1].pose.position.x > 5.0
    px4, mavros = bench.sent("/px4")[-1], bench.sent("/mavros")[-1]
    place, velocity = mavros.position, mavros.velocity
    assert px4.position == pytest.approx([place.y, place.x, -place.z], abs=1e-5)
    assert px4.velocity == pytest.approx([velocity.y, velocity.x, -velocity.z], abs=1e-5)
    assert px4.yaw == pytest.approx(0.5 * math.pi - mavros.yaw, abs=1e-5)
    assert np.isnan(px4.acceleration).all()
    assert 1.0 <= bench.sent("/cmd_vel")[-1].linear.x <= 1.3  # Drawn to its place.
    assert len(bench.sent("/follow")[-1].poses) == 2
    lines = {one.ns: one for one in bench.sent("/clearway/markers")[-1].markers}
    assert set(lines) == {"plan", "escape", "why"}
    status = bench.sent("/diagnostics")[-1].status[0]
    assert status.level == 0 or status.message.startswith("waiting")


def test_read_only_sends_no_set_points() -> None:
    bench = RosBench(act=False)
    bench.fly(3)
    assert bench.sent("/clearway/plan")
    assert not any(bench.sent(topic) for topic in ("/px4", "/mavros", "/cmd_vel", "/follow"))


@pytest.mark.parametrize("acts", [True, False])
def test_only_who_is_led_tells_the_wind(acts: bool) -> None:
    bench, winds = RosBench(act=acts), [np.zeros(3)]
    bench.session.terms = replace(bench.session.terms, act=acts)
    for tick in range(60):
        now = 0.1 * tick
        aside = (now, 0.3 * now, 0.0)  # Carried off, or flown so by a pilot.
        bench.bus.tell("/odom", odometry(BEGAN_S + now, aside))
        bench.bus.tell("/points", cloud(BEGAN_S + now, [(5.0, 4.0, 0.0)]))
        flight = bench.tick(now).flight
        winds += [] if flight is None else [flight.decision.wind_mps]
    assert winds[-1] == pytest.approx([0.0, 0.3 if acts else 0.0, 0.0], abs=0.02)


def test_what_stands_ahead_is_flown_round(bench: RosBench) -> None:
    grid = np.linspace(-1.5, 1.5, 15)
    wall = [(5.0, y, z) for y in grid for z in grid]
    bench.fly(4, points=wall)
    row = json.loads(bench.sent("/clearway/decision")[-1].data)
    assert row["mode"] == "avoidance"


def test_an_aircraft_is_kept_clear_of(bench: RosBench) -> None:
    bench.fly(2)
    bench.bus.tell("/adsb", transponder())
    bench.fly(2, begins=2)
    assert bench.link.topics["/adsb"].refused == 0
    assert "abcdef" in bench.session._intruders


def told_in_a_frame(frame: str = "map", at_s: float = 0.1, **more: Any) -> Any:
    fields = {
        "address": 0x123456, "position": point(np.array([0.0, 8.0, 0.0])), "radius": 0.4,
        "velocity": point(np.array([-1.0, 0.0, 0.0]), "Vector3"),
    } | more  # fmt: skip
    return make_message(
        "clearway_msgs/msg/Aircraft", header=header(BEGAN_S + at_s, frame), **fields
    )


def test_one_of_our_own_message_in_any_frame_that_is_tied_to_the_map() -> None:
    bench = RosBench(traffic={"seen": {"topic": "seen", "type": "Aircraft"}})
    bench.fly(2)
    bench.bus.tell("/tf_static", transform("arena", "map", (10.0, 0.0, 0.0), yaw=0.5 * math.pi))
    bench.bus.tell("/seen", told_in_a_frame("arena"))
    bench.fly(1, begins=2)
    (seen,) = bench.session._intruders.values()
    assert seen.position_m == pytest.approx([2.0, 0.0, 0.0], abs=1e-6)
    assert seen.velocity_mps == pytest.approx([0.0, -1.0, 0.0], abs=1e-6)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (
            {"frame": "nowhere"},
            "traffic: no transform from 'nowhere' to 'map': "
            "'nowhere' comes on neither /tf nor /tf_static",
        ),
        ({"position": point(np.array([math.nan, 0.0, 0.0]))}, "traffic: no position"),
        ({"radius": -1.0}, "traffic: no position"),
        ({"at_s": 1e6}, "clock: from another time"),
    ],
)
def test_one_that_says_nothing_is_counted(wrong: dict[str, Any], reason: str) -> None:
    bench = RosBench(traffic={"seen": {"topic": "seen", "type": "Aircraft"}})
    bench.fly(2)
    bench.bus.tell("/seen", told_in_a_frame(**wrong))
    bench.fly(1, begins=2)
    assert not bench.session._intruders
    assert bench.counts[reason] == 1


def test_goals_take_the_place_of_the_mission(bench: RosBench) -> None:
    bench.fly(2)
    goal = make_message("geometry_msgs/msg/PoseStamped", header=header(BEGAN_S, "map"))
    goal.pose.position.x, goal.pose.position.y = 20.0, 20.0
    bench.bus.tell("/goal_pose", goal)
    bench.fly(1, begins=2)
    assert bench.session.system.mission.goals_m.tolist() == [[20.0, 20.0, 0.0]]
    goal.header.frame_id = "nowhere"
    bench.bus.tell("/goal_pose", goal)
    bench.fly(1, begins=3)
    assert bench.counts["/goal_pose: no place in the map frame"] == 1


def test_an_unknown_frame_is_waited_for_and_told(bench: RosBench) -> None:
    bench.bus.tell("/odom", odometry(BEGAN_S, frame="odom"))
    assert str(bench.tick(0.0).state) == "waiting"
    assert [one for one in bench.counts if one.startswith("own position: no transform from 'odom'")]
    assert any("no transform from 'odom'" in line for line in bench.link.missing())
    for tick in range(1, 4):
        now = 0.1 * tick
        moved = transform("odom", "map", (100.0, 0.0, 0.0), 0.5 * math.pi, BEGAN_S + now)
        bench.bus.tell("/tf", moved)
        bench.bus.tell("/odom", odometry(BEGAN_S + now, (now, 0.0, 0.0), frame="odom"))
        bench.bus.tell("/points", cloud(BEGAN_S + now, [(5.0, 4.0, 0.0)]))
        bench.tick(now)
    assert bench.session.motion is not None
    assert bench.session.motion.position_m == pytest.approx([100.0, 0.3, 0.0])
    assert bench.session.motion.heading_rad == pytest.approx(0.5 * math.pi)
    assert bench.session.motion.velocity_mps == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (
            "nobody",
            "cloud: no transform from 'nobody' to 'base_link': "
            "'nobody' comes on neither /tf nor /tf_static",
        ),
        ("turned", "cloud: its sensor is mounted elsewhere than the mission says"),
    ],
)
def test_clouds_of_other_places_are_refused(bench: RosBench, frame: str, reason: str) -> None:
    bench.bus.tell("/tf_static", transform("turned", "base_link", (0.2, 0.0, 0.1), 0.1))
    bench.bus.tell("/odom", odometry(BEGAN_S))
    bench.bus.tell("/points", cloud(BEGAN_S, [(5.0, 0.0, 0.0)], frame))
    assert str(bench.tick(0.0).state) == "waiting"
    assert bench.counts[reason] == 1
    assert any(reason in line for line in bench.link.missing())


def test_a_gap_between_frames_is_told_by_their_names() -> None:
    """Frames that are not there, trees that nothing joins, transforms of another time."""
    frames = Transforms(Counter())
    frames.take(transform("odom", "map", (0.0, 0.0, 0.0), time_s=5.0), static=False)
    frames.take(transform("lidar", "mast", (0.0, 0.0, 1.0)), static=True)
    assert "'base' comes on neither /tf nor /tf_static" in frames.describe_gap("base", "map", 5.0)
    apart = frames.describe_gap("lidar", "odom", 5.0)
    assert "one is in 'mast' at last, the other in 'map', and nothing joins them" in apart
    late = frames.describe_gap("odom", "map", 9.0)
    assert "'odom' in 'map' comes, but not within 0.5 s of the stamp" in late


def test_frames_without_end_are_not_named_without_end() -> None:
    frames = Transforms(Counter())
    told = {frames.describe_gap(f"{number}" * 100, "map\n", 0.0) for number in range(100)}
    assert len(told) == MOST_GAPS + 1
    assert max(map(len, told)) < 300
    assert not any("\n" in one for one in told)


def test_a_late_transform_of_the_sensor_is_enough() -> None:
    bench = RosBench()
    bench.bus.came.clear()  # The static transform of the bench.
    bench.fly(2)
    assert str(bench.session.state) == "waiting"
    bench.bus.tell("/tf_static", transform("lidar", "base_link", (0.2, 0.0, 0.1)))
    assert str(bench.fly(2, begins=2).state) == "flying"


def test_empty_clouds_free_nothing(bench: RosBench) -> None:
    bench.fly(2)
    bench.bus.tell("/points", cloud(BEGAN_S + 0.2, np.zeros((0, 3))))
    bench.tick(0.2)
    assert bench.counts["cloud: empty, which says nothing"] == 1


def test_a_million_points_and_nan_are_taken(bench: RosBench) -> None:
    many = np.random.default_rng(1).uniform(4.0, 9.0, (1_000_000, 3))
    many[::3] = np.nan
    many[1::1000] = np.inf
    bench.fly(1, points=many)
    outcome = bench.fly(2, begins=1)
    assert str(outcome.state) == "flying"


def test_covariance_widens_the_margin(bench: RosBench) -> None:
    for variance, std in ((0.04, 0.2), (-1.0, 0.0), (math.nan, 0.0), (1e9, 0.0)):
        bench.bus.tell("/odom", odometry(BEGAN_S + 1e-3 * abs(std), variance=variance))
        bench.link.hear(0.0)
        heard = bench.link._own._last
        assert heard is not None
        assert heard.position_std_m == pytest.approx(std)


@pytest.mark.parametrize("place", [(math.nan, 0.0, 0.0), (1e12, 0.0, 0.0)])
def test_places_that_are_none_are_left_out(bench: RosBench, place) -> None:
    bench.bus.tell("/odom", odometry(BEGAN_S, place))
    assert str(bench.tick(0.0).state) == "waiting"
    assert bench.counts["own position: no pose"] == 1


def test_time_that_jumps_ends_in_a_restart_and_strays_do_not(bench: RosBench) -> None:
    bench.fly(5)
    bench.bus.tell("/odom", odometry(BEGAN_S + 500.0))
    assert str(bench.fly(2, begins=5).state) == "flying"
    for _ in range(8):
        bench.bus.tell("/odom", odometry(BEGAN_S - 100.0))
    assert str(bench.tick(0.8).state) == "autopilot restarted"


def test_silence_is_told_and_a_hold_is_sent(bench: RosBench) -> None:
    bench.fly(5)
    states = [str(bench.tick(0.5 + 0.1 * k).state) for k in range(45)]
    assert states.index("ageing") < states.index("stale position")
    assert states[-1] in ("link lost", "position lost")
    last = bench.sent("/mavros")[-1]
    assert last.type_mask == 0x9F8, "to hold"
    assert str(bench.fly(2, begins=51).state) == "flying", "a publisher that comes back"


def test_points_are_moved_to_the_stamp(bench: RosBench) -> None:
    """A sweep of 0.1 s at 1 m/s past one point: seen 0.1 m nearer at its end."""
    bench.fly(4)
    seen = np.array([[5.0, 0.0, 0.0], [4.9, 0.0, 0.0]])
    maker = bench.link._clouds.maker(
        "front", read_cloud_points(cloud(BEGAN_S, seen, later_s=[0.0, 0.1]), "PointCloud2"),
        BEGAN_S + 0.1,
        deskew=True,
    )  # fmt: skip
    state = bench.session.system.situation(BEGAN_S + 0.3)[0].state
    placed = maker(state, 0.0).points_m
    assert placed[:, 0] == pytest.approx([5.0, 5.0], abs=0.004)


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("rows", [1, 4])
def test_clouds_of_any_layout(big_endian: bool, rows: int) -> None:
    points = np.arange(24.0).reshape(8, 3) + 1.0
    later = np.arange(8) * 0.01
    message = cloud(1.0, points, later_s=later, big_endian=big_endian, rows=rows)
    found = read_cloud_points(
        unpack_cdr(pack_message(message), "sensor_msgs/msg/PointCloud2"), "PointCloud2"
    )
    assert found.points_m == pytest.approx(points)
    assert found.later_s == pytest.approx(later)


def test_laser_scans() -> None:
    message = make_message(
        "sensor_msgs/msg/LaserScan", angle_min=0.0, angle_increment=0.5 * math.pi,
        range_min=0.1, range_max=10.0, ranges=np.array([1.0, 2.0, np.inf, np.nan], np.float32),
    )  # fmt: skip
    found = read_cloud_points(message, "LaserScan")
    assert found.points_m == pytest.approx(np.array([[1.0, 0, 0], [0, 2.0, 0]]), abs=1e-6)


def fuzzed(bench: RosBench, number: int, seed: int) -> None:
    """Messages that are cut, flipped or made up, between good ones: nothing but counts grow."""
    rng = np.random.default_rng(seed)
    good = {
        "/odom": pack_message(odometry(BEGAN_S)),
        "/points": pack_message(cloud(BEGAN_S, rng.normal(size=(20, 3)))),
        "/tf": pack_message(transform("a", "b")),
        "/tf_static": pack_message(transform("c", "b")),
        "/adsb": pack_message(transponder()),
        "/goal_pose": pack_message(make_message("geometry_msgs/msg/PoseStamped")),
        "/path_in": pack_message(make_message("nav_msgs/msg/Path")),
    }
    topics = list(good)
    for count in range(number):
        topic = topics[int(rng.integers(len(topics)))]
        raw = bytearray(good[topic])
        how = int(rng.integers(4))
        if how == 0:
            raw = raw[: int(rng.integers(len(raw)))]
        elif how == 1:
            for at in rng.integers(4, len(raw), size=int(rng.integers(1, 9))):
                raw[at] = int(rng.integers(256))
        elif how == 2:
            raw = bytearray(rng.bytes(int(rng.integers(200))))
        else:
            at = int(rng.integers(4, max(5, len(raw) - 4)))
            raw[at : at + 4] = b"\xff\xff\xff\xff"
        bench.bus.tell(topic, bytes(raw))
        if count % 50 == 49:
            bench.link.hear(1e-3 * count)
    bench.link.hear(1e-3 * number)


def test_what_is_malformed_is_counted_and_forgotten(bench: RosBench) -> None:
    fuzzed(bench, 1500, seed=5)
    assert sum(topic.refused for topic in bench.link.topics.values()) > 300
    assert len(bench.counts) < 60
    assert len(bench.link.transforms.frames) < 1100


@pytest.mark.nightly
def test_a_hundred_thousand_malformed_messages(bench: RosBench) -> None:
    import resource

    fuzzed(bench, 20_000, seed=6)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    fuzzed(bench, 80_000, seed=7)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 64 * 1024
    assert len(bench.counts) < 80


def test_bytes_that_are_no_message_raise_what_is_foreseen() -> None:
    for raw in (b"", b"\0", b"\0\1\0\0", b"\0\1\0\0" + b"\xff" * 40):
        with pytest.raises(damages()):
            unpack_cdr(raw, "nav_msgs/msg/Odometry")


GENERAL = "/**: {ros__parameters: {mission: m.toml, rate: 5.0}}"
POINTS = "ros__parameters: {rate: 20.0, clouds.front.topic: points}"
OWN = {
    "own name": ("", "clearway: {ros__parameters: {rate: 20, clouds: {front: {topic: points}}}}"),
    "full name": ("robot", f"/robot/clearway: {{{POINTS}}}"),
    "nested": ("robot", f"robot: {{clearway: {{{POINTS}}}}}"),
    "any depth": ("a/b", f"/**/clearway: {{{POINTS}}}"),
    "one deep": ("a", f"/*/clearway: {{{POINTS}}}"),
}


@pytest.mark.parametrize("form", OWN)
def test_parameters_are_those_of_the_node(tmp_path, form: str) -> None:
    namespace, own = OWN[form]
    others = (
        "other: {ros__parameters: {rate: 1.0}}\n/*/*/*/clearway: {ros__parameters: {rate: 2.0}}"
    )
    path = tmp_path / "p.yaml"
    path.write_text("\n".join([GENERAL, own, others]))
    given = read_parameters(path, namespace=namespace)
    assert (given.rate, given.act, given.clouds["front"].topic) == (20.0, False, "points")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "no ros__parameters"),
        ("[1, 2", "no YAML"),
        ("/**: {ros__parameters: {mission: m, speed: 3}}", "speed: Extra inputs"),
        ("/**: {ros__parameters: {rate: 0, mission: m}}", "rate: Input should be greater"),
        ("/**: {ros__parameters: {own: {type: Pose}, mission: m}}", "own.type"),
        ("other: {ros__parameters: {mission: m}}", "no ros__parameters of /clearway"),
        ("&a [*a]", "no "),
        ("/**: {ros__parameters: &a {mission: *a}}", "nested too deeply"),
        (
            "/**: {ros__parameters: {mission: m, set_points: [{topic: cmd_vel, type: Twist}]}}",
            r"set_points: {first: {topic: cmd_vel, type: Twist}}",
        ),
    ],
)
def test_parameters_that_are_wrong_are_named(tmp_path, text: str, problem: str) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=problem):
        read_parameters(path)


def test_names_are_those_of_ros() -> None:
    names = Names("robot", remap=["points:=/os1/points", "~/plan:=plan"])
    assert names("points") == "/os1/points"
    assert names("~/plan") == "/robot/plan"
    assert names("~/decision") == "/robot/clearway/decision"
    assert names("/diagnostics") == "/diagnostics"
    with pytest.raises(InputError, match="FROM:=TO"):
        Names(remap=["nonsense"])
