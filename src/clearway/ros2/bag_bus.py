"""A recorded bag in place of live topics: the same messages through the same code."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.scans.bag import RawMessage
from clearway.io.scans.open_bag import open_bag
from clearway.ros2.bus import Quality, TopicMessage

STEP_S = 0.02
"""Recorded within this time comes at once."""


class BagBus:
    """A `bus.TopicBus` that plays a ROS 2 bag or MCAP file as fast as it is waited for.

    What was recorded at once comes once for each wait: a reader that looks again before a tick must
    not run ahead of it.
    """

    def __init__(self, path: Path) -> None:
        self.name, self.recorded, self.ended = f"the recording {path}", True, False
        self.lost: Counter[str] = Counter()
        self.sent: dict[str, list[bytes]] = {}
        """What would have been published, by topic."""
        self._kinds: dict[str, str] = {}
        self._stack = ExitStack()
        self._bag = self._stack.enter_context(open_bag(path, decoded=False))
        if self._bag.kind == "ROS 1 bag":
            self.close()
            raise InputError(str(path), "is a ROS 1 bag; one of ROS 2 is needed")
        self._there = {topic.name: topic for topic in self._bag.topics}
        self._coming: Iterator[RawMessage] | None = None
        self._next: RawMessage | None = None
        self._is_due = False

    def subscribe(self, topic: str, kind: str, quality: Quality) -> None:
        del quality
        if topic in self._there and self._there[topic].type != kind:
            there = self._there[topic].type
            self.close()
            raise InputError(topic, f"is {there} in the recording, not {kind}")
        self._kinds[topic] = kind

    def advertise(self, topic: str, kind: str, quality: Quality) -> None:
        del kind, quality
        self.sent[topic] = []

    def publish(self, topic: str, raw: bytes) -> bool:
        self.sent[topic].append(raw)
        return True

    def take(self) -> Sequence[TopicMessage]:
        if not self._is_due:
            return []
        self._is_due = False
        if self._coming is None:
            self._coming = self._bag.messages([t for t in self._kinds if t in self._there])
            self._next = next(self._coming, None)
        found: list[TopicMessage] = []
        begins_s = self._next.logged_s if self._next is not None else 0.0
        while self._next is not None and self._next.logged_s <= begins_s + STEP_S:
            one = self._next
            found.append(TopicMessage(one.topic, one.type, one.raw, one.logged_s))
            self._next = next(self._coming, None)
        self.ended = self._next is None
        return found

    def publishers(self, topic: str) -> int:
        return int(topic in self._there)

    def why_unheard(self, topic: str) -> str:
        del topic
        return ""

    def wait(self, seconds: float) -> None:
        del seconds
        self._is_due = True

    def close(self) -> None:
        self._stack.close()
