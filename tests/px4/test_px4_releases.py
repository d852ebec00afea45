"""Releases of PX4 by their topics, and messages by the hash that PX4 makes of their fields."""

from __future__ import annotations

import pytest

pytest.importorskip("rosbags", reason="needs the packages of [ros2]")

from clearway.base.errors import InputError
from clearway.px4.releases import RELEASES, TOPICS, format_hash
from clearway.px4.setup import find_release
from clearway.ros2.bus import SENSOR, wire_kind
from px4_for_tests import End, Topics

OF_PX4 = (
    ("ArmingCheckReply", "1.16", 0x03EA8A66),
    ("ArmingCheckReply", "1.17 1.18", 0x7C350DE4),
    ("ArmingCheckRequest", "1.17 1.18", 0x6E29CDCD),
    ("ArmingCheckRequest", "1.16", 0x7B7B8DAE),
    ("HomePosition", "1.17 1.18", 0x159BAB7E),
    ("HomePosition", "1.16", 0x28DEE799),
    ("MessageFormatRequest", "1.16 1.17 1.18", 0x24E20CB7),
    ("MessageFormatResponse", "1.16 1.17 1.18", 0x60A08C2D),
    ("ModeCompleted", "1.16 1.17 1.18", 0xB73037B7),
    ("ObstacleDistance", "1.16 1.17 1.18", 0xD66F0045),
    ("RegisterExtComponentReply", "1.16 1.17", 0x3F5A272F),
    ("RegisterExtComponentReply", "1.18", 0x4A5465B5),
    ("RegisterExtComponentRequest", "1.18", 0x28168DD6),
    ("RegisterExtComponentRequest", "1.16 1.17", 0x35CDE621),
    ("SetpointConfig", "1.18", 0x7E529496),
    ("SetpointConfigReply", "1.18", 0xC7B4F2F4),
    ("TrajectorySetpoint", "1.16 1.17 1.18", 0xF614ACDE),
    ("UnregisterExtComponent", "1.16 1.17 1.18", 0x58239BA9),
    ("VehicleCommand", "1.16 1.17 1.18", 0xCBA514AF),
    ("VehicleControlMode", "1.16 1.17", 0x25A90612),
    ("VehicleLandDetected", "1.16 1.17 1.18", 0x4C30E23F),
    ("VehicleLocalPosition", "1.16 1.17 1.18", 0x5141D2F7),
    ("VehicleOdometry", "1.16 1.17 1.18", 0x3AF07476),
    ("VehicleStatus", "1.18", 0x53EE3679),
    ("VehicleStatus", "1.16 1.17", 0xF779FA65),
)
"""Hashes by the rule of px4_ros2 of the fields in px4_msgs, release by release."""


@pytest.mark.parametrize(("message", "releases", "value"), OF_PX4)
def test_fields_are_those_of_px4(message: str, releases: str, value: int) -> None:
    for name in releases.split():
        plain = f"px4_msgs/msg/{message}"
        kind = RELEASES[name].kind(message) if message in TOPICS else plain
        assert wire_kind(kind) == plain
        assert format_hash(kind) == value


def test_topics_end_with_the_version() -> None:
    topics = {name: RELEASES[name].topic("VehicleStatus") for name in RELEASES}
    assert topics["1.16"] == topics["1.17"] == "/fmu/out/vehicle_status_v1"
    assert topics["1.18"] == "/fmu/out/vehicle_status_v4"
    assert RELEASES["1.16"].topic("VehicleLocalPosition") == "/fmu/out/vehicle_local_position"
    assert RELEASES["1.18"].topic("RegisterExtComponentRequest").endswith("request_v2")


def px4_with(*topics: str) -> End:
    shared = Topics()
    talker, other = End(shared), End(shared)
    for topic in topics:
        kind = "VehicleLocalPosition" if "local" in topic else "VehicleStatusV4"
        talker.advertise(topic, f"px4_msgs/msg/{kind}", SENSOR)
    return other


@pytest.mark.parametrize("name", RELEASES)
@pytest.mark.parametrize("prefix", ["", "/px4_1"])
def test_a_release_is_found_by_what_it_publishes(name: str, prefix: str) -> None:
    told = [prefix + RELEASES[name].topic(m) for m in ("VehicleStatus", "VehicleLocalPosition")]
    assert find_release(px4_with(*told), prefix, 5.0).name == name


def test_an_unknown_release_is_named() -> None:
    bus = px4_with("/fmu/out/vehicle_status_v7", "/fmu/out/vehicle_local_position_v1")
    with pytest.raises(InputError, match=r"VehicleStatus of version 7.*update PX4 or clearway"):
        find_release(bus, "", 5.0)


def test_no_px4_says_what_to_look_for() -> None:
    with pytest.raises(InputError, match=r"MicroXRCEAgent.*ROS_DOMAIN_ID"):
        find_release(px4_with(), "", 0.3)
