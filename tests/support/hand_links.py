"""Each link from a deciding process and its second one to a vehicle, with texts for set-points.

On topics a text is a TrajectorySetpoint whose position tells word and number.
"""

from __future__ import annotations

import socket
import time
from collections import deque
from dataclasses import astuple
from types import SimpleNamespace
from typing import Any, Protocol

import numpy as np

from clearway.hand.handover import Packet
from free_ports import own_domain

WORDS = ("own", "hand", "begins", "over", "nothing", "broken", "stops")
DOMAIN = own_domain(96)
"""Of these processes alone."""
TOPIC, KIND = "/fmu/in/trajectory_setpoint", "px4_msgs/msg/TrajectorySetpoint"
MODE, MODE_ID, RELEASE = "clearway", 23, "1.18"
STATUS_S, QUESTION_S = 0.05, 0.3
"""Between two of PX4's: sooner than its own 0.2 s or more, so that a test begins sooner."""
LOOKS_S = 0.02


class Way(Protocol):
    """The deciding process's end of a link."""

    module: str
    """Of the second process."""
    sender: dict[str, object]
    descriptors: tuple[int, ...]
    peer: tuple[str, int] | None

    def packets(self, text: str) -> tuple[Packet, ...]:
        """As they are handed over."""
        ...

    def send(self, text: str) -> object: ...


class DatagramWay(Way):
    """MAVLink's: a socket that both processes have."""

    module = "clearway.mavlink.hand_process"

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.descriptors, self.peer = (self._socket.fileno(),), ("127.0.0.1", port)
        self.sender = {"descriptor": self.descriptors[0], "line": False, "key": None}

    def packets(self, text: str) -> tuple[Packet, ...]:
        return (Packet(0, text.encode()),)

    def send(self, text: str) -> object:
        return self._socket.sendto(text.encode(), self.peer)


class TopicWay(Way):
    """ROS 2's: each process has its own end of the bus; over DDS, as without ROS."""

    def __init__(self, domain: int) -> None:
        from clearway.px4.releases import RELEASES
        from clearway.ros2.dds import DdsBus

        release = RELEASES[RELEASE]
        one = SimpleNamespace(topic=TOPIC, type="TrajectorySetpoint")
        parameters = SimpleNamespace(set_points={"one": one})
        self.link: Any = SimpleNamespace(
            names=lambda name: name, topic=release.topic, release=release, parameters=parameters
        )
        encoding = self.encoding()
        self.module, self.descriptors, self.peer = encoding.module, (), None
        self._bus = DdsBus(domain)
        for topic, kind, quality in encoding.topics():
            self._bus.advertise(topic, kind, quality)
        topics = [(topic, kind, astuple(quality)) for topic, kind, quality in encoding.topics()]
        self.sender = {"domain": domain, "namespace": None, "topics": topics, **encoding.more()}

    def encoding(self) -> Any:
        from clearway.ros2.hand import TopicEncoding

        return TopicEncoding(self.link)

    def packets(self, text: str) -> tuple[Packet, ...]:
        return (Packet(0, encode_text(text)),)

    def send(self, text: str) -> object:
        return self._bus.publish(TOPIC, encode_text(text))


class ModeWay(TopicWay):
    """That of PX4's flight mode: with answers to its arming checks, and Hold at the end."""

    def __init__(self, domain: int) -> None:
        super().__init__(domain)
        self.peer = (MODE, MODE_ID)

    def encoding(self) -> Any:
        from clearway.px4.hand import ModeEncoding

        return ModeEncoding(self.link)

    def packets(self, text: str) -> tuple[Packet, ...]:
        from clearway.px4.hand import ANSWER, HOLD
        from clearway.ros2.messages import make_message, pack_message

        kind = self.link.release.kind
        found = super().packets(text)
        if text.startswith("hand"):
            answer = make_message(kind("ArmingCheckReply"), can_arm_and_run=True)
            return (*found, Packet(ANSWER, pack_message(answer)))
        if text in ("over", "nothing"):
            return (*found, Packet(HOLD, pack_message(make_message(kind("VehicleCommand")))))
        return found


class Ear(Protocol):
    """The vehicle's end of a link."""

    link: str
    at: int
    """Port or domain."""
    timeout_s: float

    def next(self) -> str:
        """The next text; raises TimeoutError."""
        ...

    def is_ready(self) -> bool:
        """Whether both processes are found."""
        ...

    def close(self) -> None: ...


class DatagramEar(Ear):
    link = "mavlink"

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.at, self.timeout_s = int(self._socket.getsockname()[1]), 3.0

    def next(self) -> str:
        self._socket.settimeout(self.timeout_s)
        return self._socket.recv(4096).decode()

    def is_ready(self) -> bool:
        return True

    def close(self) -> None:
        self._socket.close()


class TopicEar(Ear):
    link = "ros2"

    def __init__(self) -> None:
        from clearway.ros2.bus import USUAL
        from clearway.ros2.dds import DdsBus

        self.at, self.timeout_s = DOMAIN, 3.0
        self._bus, self._texts = DdsBus(DOMAIN), deque[str]()
        self._bus.subscribe(TOPIC, KIND, USUAL)

    def next(self) -> str:
        until = time.monotonic() + self.timeout_s
        while not self._texts:
            self.speak()
            left_s = until - time.monotonic()
            if left_s <= 0.0:
                raise TimeoutError
            self._bus.wait(min(left_s, LOOKS_S))
            self._texts += [decode_text(one.raw) for one in self._bus.take()]
        return self._texts.popleft()

    def speak(self) -> None:
        """Publish what is due."""

    def is_ready(self) -> bool:
        return self._bus.publishers(TOPIC) == 2

    def close(self) -> None:
        self._bus.close()


class ModeEar(TopicEar):
    """A PX4 that flies the mode."""

    link = "px4"

    def __init__(self) -> None:
        from clearway.px4.releases import RELEASES
        from clearway.ros2.bus import SENSOR

        super().__init__()
        self._release = RELEASES[RELEASE]
        self._spoken_s = {"VehicleStatus": 0.0, "ArmingCheckRequest": 0.0}
        for message in self._spoken_s:
            kind = self._release.kind(message)
            self._bus.advertise(self._release.topic(message), kind, SENSOR)

    def speak(self) -> None:
        from clearway.px4.mode import ARMED

        self._publish("VehicleStatus", STATUS_S, nav_state=MODE_ID, arming_state=ARMED)
        self._publish("ArmingCheckRequest", QUESTION_S)

    def _publish(self, message: str, every_s: float, **fields: int) -> None:
        from clearway.ros2.messages import make_message, pack_message

        if time.monotonic() < self._spoken_s[message] + every_s:
            return
        self._spoken_s[message] = time.monotonic()
        told = make_message(self._release.kind(message), **fields)
        self._bus.publish(self._release.topic(message), pack_message(told))

    def is_ready(self) -> bool:
        return (
            super().is_ready() and self._bus.subscribers(self._release.topic("VehicleStatus")) == 1
        )


WAYS = {"mavlink": DatagramWay, "ros2": TopicWay, "px4": ModeWay}
EARS = {"mavlink": DatagramEar, "ros2": TopicEar, "px4": ModeEar}


def encode_text(text: str) -> bytes:
    from clearway.ros2.messages import make_message, pack_message

    word, _, number = text.partition(" ")
    told = np.array([WORDS.index(word), int(number or -1), 0.0], np.float32)
    return pack_message(make_message(KIND, position=told))


def decode_text(raw: bytes) -> str:
    from clearway.ros2.messages import unpack_cdr

    at, number, _ = (int(one) for one in unpack_cdr(raw, KIND).position)
    return WORDS[at] if number < 0 else f"{WORDS[at]} {number}"
