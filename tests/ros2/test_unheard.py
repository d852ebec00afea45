"""A publisher that is there and not heard is said to be so, with what keeps it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.ros2.bus import LATCHED, SENSOR, USUAL, Quality
from clearway.ros2.dds import DdsBus
from clearway.ros2.discovered import FIELDS_UNKNOWN
from clearway.ros2.heard import HeardTopic
from ros2_for_tests import DOMAIN, LOOPBACK, until

PATH, CLOUD = "nav_msgs/msg/Path", "sensor_msgs/msg/PointCloud2"
OTHERS = {
    "another type": (PATH, USUAL, CLOUD, USUAL, "but of nav_msgs/msg/Path"),
    "best effort": (CLOUD, SENSOR, CLOUD, USUAL, "best effort where reliable is asked for"),
    "volatile": (CLOUD, USUAL, CLOUD, LATCHED, "volatile where transient local is asked for"),
    # Of one name, but other fields: as where types cannot be read.
    "other fields": (
        "px4_msgs/msg/VehicleStatusV4", USUAL, "px4_msgs/msg/VehicleStatusV1", USUAL,
        FIELDS_UNKNOWN,
    ),
}  # fmt: skip


@pytest.fixture
def sides(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[DdsBus, DdsBus]]:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    talker, listener = DdsBus(DOMAIN + 2), DdsBus(DOMAIN + 2)
    yield talker, listener
    talker.close()
    listener.close()


@pytest.mark.parametrize("what", OTHERS)
def test_it_is_said_what_keeps_it(what: str, sides: tuple[DdsBus, DdsBus]) -> None:
    told, offers, asked, wants, why = OTHERS[what]
    talker, listener = sides
    talker.advertise("/there", told, offers)
    listener.subscribe("/there", asked, wants)
    assert until(lambda: listener.why_unheard("/there"))
    assert listener.publishers("/there") == 0
    words = HeardTopic(asked, needed=True).words("/there", listener)
    assert why in words
    assert "no publisher" not in words


def test_nobody_there_stays_no_publisher(sides: tuple[DdsBus, DdsBus]) -> None:
    _, listener = sides
    listener.subscribe("/there", CLOUD, Quality())
    assert listener.why_unheard("/there") == ""
    assert "no publisher and no message" in HeardTopic(CLOUD, needed=True).words("/there", listener)


def test_a_publisher_that_fits_is_no_reason(sides: tuple[DdsBus, DdsBus]) -> None:
    talker, listener = sides
    talker.advertise("/there", CLOUD, USUAL)
    listener.subscribe("/there", CLOUD, SENSOR)
    assert until(lambda: listener.publishers("/there"))
    assert "1 publishers, but no message" in HeardTopic(CLOUD, needed=True).words(
        "/there", listener
    )


def test_ends_are_counted_again_where_the_binding_fails_as_one_comes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from cyclonedds.sub import DataReader

    count, fails = DataReader.get_matched_publications, [True]

    def counted(self: DataReader) -> list[int]:
        if fails.pop() if fails else False:
            raise IndexError("invalid index")  # As it does where one comes between its two calls.
        return list(count(self))

    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    bus = DdsBus(DOMAIN)
    bus.subscribe("/late", PATH, USUAL)
    monkeypatch.setattr(DataReader, "get_matched_publications", counted)
    assert bus.publishers("/late") == 0
    assert not fails
    bus.close()
