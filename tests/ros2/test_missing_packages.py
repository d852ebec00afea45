"""A ROS without some packages of messages: what needs none of them works, and the rest is named."""

from __future__ import annotations

import pytest

pytest.importorskip("rosbags", reason="needs the packages of [ros2]")

from clearway.ros2.bus import MissingMessageError, Quality
from clearway.ros2.rclpy_bus import _type
from ros2_for_tests import LocalBus, RosBench

HEARD, TOLD = LocalBus.subscribe, LocalBus.advertise


def without(monkeypatch: pytest.MonkeyPatch, *packages: str) -> None:
    """A bus whose ROS lacks these."""

    def refuse(kind: str) -> None:
        if kind.partition("/")[0] in packages:
            raise MissingMessageError("--backend rclpy", f"this ROS has no {kind}")

    def subscribe(bus: LocalBus, topic: str, kind: str, quality: Quality) -> None:
        refuse(kind)
        HEARD(bus, topic, kind, quality)

    def advertise(bus: LocalBus, topic: str, kind: str, quality: Quality) -> None:
        refuse(kind)
        TOLD(bus, topic, kind, quality)

    monkeypatch.setattr(LocalBus, "subscribe", subscribe)
    monkeypatch.setattr(LocalBus, "advertise", advertise)


def test_a_message_that_ros_lacks_is_an_error_with_its_cure() -> None:
    with pytest.raises(MissingMessageError, match=r"no mavros_msgs/msg/ADSBVehicle: install mav"):
        _type("mavros_msgs/msg/ADSBVehicle")


def test_what_nothing_depends_on_may_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "px4_msgs", "mavros_msgs", "visualization_msgs", "diagnostic_msgs")
    bench = RosBench(set_points={"velocity": {"topic": "cmd_vel", "type": "Twist"}})
    assert str(bench.fly(10).state) == "flying"
    assert bench.sent("/cmd_vel")
    named = [reason for reason in bench.counts if "this ROS has no" in reason]
    assert {reason.split(":")[0] for reason in named} == {
        "/adsb", "/clearway/markers", "/diagnostics"
    }  # fmt: skip
    assert not bench.sent("/diagnostics")
    assert [one for one in bench.link.missing() if "/adsb: not heard" in one], "a check lists it"


@pytest.mark.parametrize("package", ["nav_msgs", "sensor_msgs", "geometry_msgs"])
def test_what_is_needed_may_not(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, package)
    with pytest.raises(MissingMessageError):
        RosBench(set_points={"velocity": {"topic": "cmd_vel", "type": "Twist"}})
