"""The guardian on topics: commands pass as they came, or the nearest that is safe goes out."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.base.errors import InputError
from clearway.live.guard.wish import PathWish
from clearway.ros2.messages import make_message, pack_message
from clearway.ros2.parameters import Names, NodeParameters
from clearway.ros2.setup import set_up_ros2_guard
from clearway.ros2.told import header, point
from ros2_for_tests import BEGAN_S, cloud
from ros2_guard_bench import NOWHERE, GuardBench, stamped, twist

AT_WALL = (1.88, 0.0, 0.0)
"""The margin of 0.6 m ends 2 cm farther on."""


def linear(message) -> list[float]:
    return [message.linear.x, message.linear.y, message.linear.z]


def test_nothing_goes_out_before_somebody_wishes() -> None:
    bench = GuardBench()
    for number in range(3):
        bench.tick(number)
    assert not any(bench.bus.sent[topic] for topic in ("/cmd_vel", "/mavros", "/px4"))
    assert not bench.sent("/clearway/decision")


def test_what_is_safe_goes_out_as_it_came_and_in_every_other_form() -> None:
    bench = GuardBench()
    wish = twist(0.0, 0.4, turn=0.3)
    bench.tick(0, yaw=0.5 * math.pi)
    outcome = bench.tick(1, wish, yaw=0.5 * math.pi)
    assert outcome.guarded is not None
    assert outcome.guarded.passed
    assert outcome.wished == pack_message(wish)
    sent = bench.sent("/cmd_vel")[-1]
    assert (linear(sent), sent.angular.z) == ([0.0, 0.4, 0.0], 0.3)
    assert linear(bench.sent("/stamped")[-1].twist) == pytest.approx([-0.4, 0.0, 0.0])
    target, px4 = bench.sent("/mavros")[-1], bench.sent("/px4")[-1]
    assert target.type_mask == 0x5C7
    assert (target.velocity.x, target.yaw_rate) == pytest.approx((-0.4, 0.3))
    assert px4.velocity == pytest.approx([0.0, -0.4, 0.0], abs=1e-6)
    assert px4.yawspeed == pytest.approx(-0.3)
    row = json.loads(bench.sent("/clearway/decision")[-1].data)
    assert row["passed"] is True
    assert row["way_out"]


def test_what_is_not_goes_out_changed_and_says_why() -> None:
    bench = GuardBench()
    outcome = bench.tick(0, place=AT_WALL)
    outcome = bench.tick(1, twist(1.0), AT_WALL)
    assert outcome.guarded is not None
    assert not outcome.guarded.is_wish
    assert "of the map" in outcome.guarded.why
    assert bench.sent("/cmd_vel")[-1].linear.x <= 0.02
    assert bench.sent("/mavros")[-1].type_mask == 0x9C0, "a place too: what is flown is known"
    assert "of the map" in bench.sent("/diagnostics")[-1].status[0].message or bench.tick(
        11, twist(1.0), AT_WALL
    )
    assert bench.session.tally["replaced"] >= 1


def test_what_is_too_fast_is_slowed() -> None:
    bench = GuardBench()
    bench.tick(0)
    outcome = bench.tick(1, twist(0.0, 30.0))
    assert outcome.guarded is not None
    assert outcome.guarded.slowed
    assert linear(bench.sent("/cmd_vel")[-1]) == pytest.approx([0.0, 1.0, 0.0])


def test_the_body_of_a_command_is_that_of_the_moment() -> None:
    """Read anew at every tick: turned towards the wall it no longer passes."""
    bench = GuardBench()
    bench.tick(0, place=AT_WALL, yaw=0.5 * math.pi)
    assert bench.tick(1, twist(0.5), AT_WALL, 0.5 * math.pi).guarded.passed
    assert not bench.tick(2, None, AT_WALL, 0.0).guarded.passed


def test_in_the_frame_of_the_map_yaw_is_nothing() -> None:
    bench = GuardBench(guard={"frame": "map"})
    bench.tick(0, place=AT_WALL, yaw=0.5 * math.pi)
    assert not bench.tick(1, twist(0.5), AT_WALL, 0.5 * math.pi).guarded.passed
    assert bench.tick(2, twist(0.0, 0.5), AT_WALL, 0.5 * math.pi).guarded.passed


def test_who_falls_silent_is_held_for() -> None:
    bench = GuardBench()
    bench.tick(0)
    place = 0.0
    for number in range(1, 25):
        wish = twist(0.0, 1.0) if number == 1 else None
        outcome = bench.tick(number, wish, (0.0, place, 0.0))
        place += 0.1 * bench.sent("/cmd_vel")[-1].linear.y
    assert outcome.guarded.why.startswith("nobody wishes anything")
    assert place <= 1.1, "half a second, and what is in hand"
    assert linear(bench.sent("/cmd_vel")[-1]) == pytest.approx([0.0, 0.0, 0.0], abs=0.02)


def test_who_is_not_where_it_was_told_starts_anew() -> None:
    bench = GuardBench()
    bench.tick(0)
    bench.tick(1, twist(0.0, 1.0))
    assert bench.guardian.held is not None
    bench.tick(20, None, (0.0, 7.0, 0.0))
    assert bench.guardian.held is None, "nobody wishes anything, and nothing is in hand"


def test_the_vehicle_is_lost_for_good_after_a_while() -> None:
    bench = GuardBench(obstacle_map=NOWHERE)
    for number in range(4):
        bench.tick(number, twist(0.3), (0.03 * number, 0.0, 0.0))
    states = [str(bench.quiet(0.4 + 0.1 * k).state) for k in range(45)]
    assert states.index("ageing") < states.index("stale position")
    assert states[-1] in ("link lost", "position lost")
    assert bench.sent("/mavros")[-1].type_mask == 0x9F8, "to hold"
    before = len(bench.sent("/cmd_vel"))
    bench.quiet(6.0)
    assert len(bench.sent("/cmd_vel")) == before


def test_a_vehicle_that_cannot_stop_is_turned_as_it_is_commanded() -> None:
    bench = GuardBench("flies on", NOWHERE)
    bench.tick(0, speed=1.0)
    outcome = bench.tick(1, twist(1.0, turn=0.2), (0.1, 0.0, 0.0), speed=1.0)
    assert outcome.guarded.passed
    assert outcome.guarded.velocity_mps == pytest.approx([math.cos(0.1), math.sin(0.1), 0.0])
    stands = bench.tick(2, twist(), (0.2, 0.0, 0.0), speed=1.0)
    assert not stands.guarded.is_wish
    assert bench.sent("/cmd_vel")[-1].linear.x > 0.5


def test_what_only_a_sensor_sees_stops_a_command() -> None:
    bench = GuardBench(sensor=True)
    near = [(0.7, y, z) for y in np.linspace(-1.0, 1.0, 9) for z in np.linspace(-1.0, 1.0, 9)]
    for number, points in enumerate([[(5.0, 4.0, 0.0)]] * 3 + [near] * 3):
        bench.bus.tell("/points", cloud(BEGAN_S + 0.1 * number, points))
        outcome = bench.tick(number, twist(1.0))
        assert outcome.guarded is None or outcome.guarded.passed is (number < 3)
    assert outcome.guarded.why.startswith("the wish")


def pose(x: float, y: float, frame: str = "map"):
    return make_message(
        "geometry_msgs/msg/PoseStamped", header=header(BEGAN_S, frame),
        pose=make_message("geometry_msgs/msg/Pose", position=point(np.array([x, y, 0.0]))),
    )  # fmt: skip


def test_paths_and_set_points_are_wishes_too() -> None:
    bench = GuardBench(guard={"type": "Path"})
    bench.tick(0)
    path = make_message("nav_msgs/msg/Path", poses=[pose(0.0, 3.0)])
    assert bench.tick(1, path).guarded.passed
    lost = make_message("nav_msgs/msg/Path", poses=[pose(0.0, 3.0, "nowhere")])
    bench.tick(2, lost)
    assert bench.counts["/cmd_vel_in: values that cannot be used"] == 1
    bench = GuardBench(guard={"type": "PositionTarget"})
    bench.tick(0)
    target = make_message("mavros_msgs/msg/PositionTarget", coordinate_frame=1, type_mask=0x5C7)
    target.velocity.y = 0.5
    assert bench.tick(1, target).guarded.passed
    assert bench.sent("/mavros")[-1].velocity.y == 0.5
    target.type_mask, target.position.x = 0xDF8, 9.0
    _, held = bench.tick(2, target), bench.session._wished
    assert isinstance(held.wish_of(bench.session.motion), PathWish)
    bench = GuardBench(guard={"type": "TrajectorySetpoint"})
    bench.tick(0)
    north = make_message(
        "px4_msgs/msg/TrajectorySetpoint", velocity=np.array([0.5, 0, 0], np.float32)
    )
    north.position[:] = np.nan
    north.yawspeed = math.nan
    outcome = bench.tick(1, north)
    assert outcome.guarded.passed
    assert outcome.guarded.velocity_mps == pytest.approx([0.0, 0.5, 0.0])


def test_a_stamped_twist_names_its_frame() -> None:
    bench = GuardBench(guard={"type": "TwistStamped"})
    bench.tick(0, yaw=0.5 * math.pi)
    for frame, velocity in (("base_link", [0.0, 0.5, 0.0]), ("map", [0.5, 0.0, 0.0])):
        outcome = bench.tick(1, stamped(frame, 0.5), yaw=0.5 * math.pi)
        assert outcome.guarded.velocity_mps == pytest.approx(velocity, abs=1e-9)
    bench.tick(2, stamped("camera", 0.5))
    assert bench.counts["/cmd_vel_in: values that cannot be used"] == 1


def test_commands_that_are_none_are_counted() -> None:
    bench = GuardBench()
    bench.tick(0)
    for wrong in (twist(math.nan), twist(math.inf), twist(0.1, turn=math.nan), b"\0\1\0\0"):
        bench.tick(1, wrong)
    assert bench.link.topics["/cmd_vel_in"].refused == 4
    assert not bench.sent("/cmd_vel")


def test_read_only_says_and_sends_nothing() -> None:
    bench = GuardBench(act=False)
    bench.tick(0)
    assert bench.tick(1, twist(0.0, 0.5)).guarded.passed
    assert not bench.bus.sent["/cmd_vel"]
    assert bench.sent("/clearway/decision")


def test_what_it_publishes_is_not_what_it_hears() -> None:
    given = NodeParameters.model_validate({"mission": "m.toml", "guard": {"topic": "cmd_vel"}})
    with pytest.raises(InputError, match="is what the guardian publishes"):
        set_up_ros2_guard(given, Names(), lambda: pytest.fail("not opened"), lambda _: None)
