"""The second process on ROS 2 topics: it has its own end of the bus, found by others beforehand."""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import Any

from clearway.hand.handover import Packet
from clearway.hand.process import Sender, watch_over
from clearway.ros2.bus import MissingMessageError, Quality, TopicBus
from clearway.ros2.dds import DdsBus
from clearway.ros2.rclpy_bus import RclpyBus

NODE = "clearway_second_process"


class TopicSender(Sender):
    """Publishes what is encoded; a packet's channel is the number of its topic."""

    def __init__(self, bus: TopicBus, topics: list[str]) -> None:
        self._bus, self._topics = bus, topics

    def send(self, packet: Packet, _peer: tuple[str, int] | None, _age_s: float) -> bool:
        try:
            return self._bus.publish(self._topics[packet.channel], packet.data)
        except Exception:
            return False


def open_topics(given: dict[str, Any]) -> TopicSender:
    """The sender on the bus that the deciding process is on."""
    bus = open_end(given)
    return TopicSender(bus, [topic for topic, *_ in given["topics"]])


def open_end(given: dict[str, Any]) -> TopicBus:
    """An end of the bus of its own, ready to publish."""
    domain, namespace = given["domain"], given["namespace"]
    bus: TopicBus = RclpyBus.on_own_node(NODE, namespace) if domain is None else DdsBus(domain)
    for topic, kind, quality in given["topics"]:
        with suppress(MissingMessageError):  # Diagnostics: set-points the first process has too.
            bus.advertise(topic, kind, Quality(*quality))
    return bus


if __name__ == "__main__":
    sys.exit(watch_over(sys.argv[1:], open_topics))
