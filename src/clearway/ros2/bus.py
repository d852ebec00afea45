"""The small protocol of topics behind which DDS, rclpy and recordings stand."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from clearway.base.errors import InputError


class MissingMessageError(InputError):
    """A message that the ROS which carries a topic does not have."""


@dataclass(frozen=True, slots=True)
class Quality:
    """How messages of a topic are to be brought, as far as ROS users choose it."""

    reliable: bool = True
    latched: bool = False
    """Whether the last is kept for those who come later: transient local."""
    depth: int = 10


SENSOR = Quality(reliable=False, depth=5)
USUAL = Quality()
LATCHED = Quality(latched=True, depth=1)
STATIC_TF = Quality(latched=True, depth=100)


def wire_kind(kind: str) -> str:
    """The name of a kind on topics: without the version of a message of PX4."""
    return re.sub(r"V\d+$", "", kind) if kind.startswith("px4_msgs/") else kind


class TopicMessage(NamedTuple):
    """Of a topic, serialised."""

    topic: str
    type: str
    raw: bytes
    recorded_s: float | None = None
    """When it came, where it is played back."""


class TopicBus(Protocol):
    """Topics, from wherever they come."""

    name: str
    """For people."""
    recorded: bool
    """Whether it plays what was recorded: time is that of the recording, clock or not."""

    lost: Counter[str]
    """Messages by topic that are known to have been lost on their way here."""

    def subscribe(self, topic: str, kind: str, quality: Quality) -> None:
        """Hear a topic, by its full name; kind: "package/msg/Name"."""
        ...

    def advertise(self, topic: str, kind: str, quality: Quality) -> None:
        """Be ready to publish."""
        ...

    def publish(self, topic: str, raw: bytes) -> bool:
        """Send CDR with its head; whether it went."""
        ...

    def take(self) -> Sequence[TopicMessage]:
        """All that has come since the last call; never waits."""
        ...

    def publishers(self, topic: str) -> int:
        """How many others publish a topic that is heard."""
        ...

    def why_unheard(self, topic: str) -> str:
        """Why a publisher that is there is not heard; "" where that is not known, or none is."""
        ...

    def wait(self, seconds: float) -> None:
        """Until something comes, but no longer."""
        ...

    def close(self) -> None: ...
