"""The second process of a node on topics: how set-points and diagnostics are handed to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Any, ClassVar

from clearway.hand.hand import Notice, SecondProcess
from clearway.hand.handover import Packet
from clearway.live.handing import (
    ENDED,
    FLOWN,
    NO_SIMULATED_TIME,
    NOT_FLOWN,
    TURNED_OFF,
    Encoding,
    Handing,
    Says,
)
from clearway.live.link.loop import Loop
from clearway.live.link.set_point import SetPoint
from clearway.ros2 import told
from clearway.ros2.bus import USUAL, Quality
from clearway.ros2.dds import DdsBus
from clearway.ros2.kinds import SET_POINT_KINDS, base_of
from clearway.ros2.messages import pack_message
from clearway.ros2.parameters import SetPointParameters
from clearway.ros2.rclpy_bus import RclpyBus
from clearway.ros2.topic_link import TopicLink
from clearway.ros2.topic_teller import DIAGNOSTICS

NO_BUS = "no second process: it cannot open this bus"


@dataclass(frozen=True, slots=True)
class TopicEncoding:
    """Messages of one node, serialised ahead of their time."""

    link: TopicLink[Any]
    module: ClassVar[str] = "clearway.ros2.hand_process"
    """What the second process runs."""

    def topics(self) -> list[tuple[str, str, Quality]]:
        """Topics that the second process publishes, by channel."""
        link = self.link
        told_on = [
            (link.names(one.topic), SET_POINT_KINDS[one.type], USUAL)
            for one in link.parameters.set_points.values()
        ]
        return [*told_on, DIAGNOSTICS]

    def more(self) -> dict[str, object]:
        """What else the second process's sender is to know."""
        return {}

    def encoding(self) -> Encoding:
        """As a link hands it over."""
        return Encoding(self.set_points, self.says)

    def set_points(self, points: Sequence[tuple[float, SetPoint]]) -> list[tuple[Packet, ...]]:
        topics = self.link.parameters.set_points.values()
        return [
            tuple(
                Packet(channel, pack_message(self._message(one, point, time_s)))
                for channel, one in enumerate(topics)
            )
            for time_s, point in points
        ]

    def _message(self, one: SetPointParameters, point: SetPoint, time_s: float) -> Any:
        """As `TopicLink.set_point_message` of a vehicle that is where it should be."""
        given = self.link.parameters
        if one.type not in ("Twist", "TwistStamped"):
            return told.make_set_point_message(one.type, point, time_s, given.map_frame)
        speed, base = self.link.session.speed_mps, base_of(one, given)
        velocity, rate = point.as_velocity(point.position_m, point.yaw_rad, speed)
        yaw = None if base is None else point.yaw_rad
        frame = base or given.map_frame
        return told.twist_message(one.type, velocity, rate, time_s, frame, yaw)

    def says(self, time_s: float) -> Says:
        channel = len(self.link.parameters.set_points)
        words = ((told.ERROR, FLOWN), (told.ERROR, ENDED), (told.ERROR, NOT_FLOWN))
        found = (told.diagnostics("clearway", level, text, {}, time_s) for level, text in words)
        return Says(*((Packet(channel, pack_message(one)),) for one in found))


def begin_ros2_hand(loop: Loop, way: TopicEncoding, *, wanted: bool, notice: Notice) -> None:
    """Start the second process of a node, or say why there is none."""
    link = way.link
    bus = link.bus
    if not link.parameters.act:
        return
    why_none = (
        (TURNED_OFF, not wanted),
        (NO_SIMULATED_TIME, loop.session.terms.speedup is None),
    )
    none = next((why for why, holds in why_none if holds), None)
    if none is not None or not isinstance(bus, DdsBus | RclpyBus):
        notice(none or NO_BUS)
        return
    sender = {
        "domain": getattr(bus, "domain", None),
        "namespace": getattr(bus, "namespace", None),
        "topics": [
            (bus.resolve(topic), kind, astuple(quality)) for topic, kind, quality in way.topics()
        ],
        **way.more(),
    }
    hand = SecondProcess.start(way.module, sender, (), loop.longest_s, log=None, notice=notice)
    link.handing = Handing(hand, way.encoding(), loop.period_s)
