"""Topics over DDS as ROS 2 names them, by Cyclone DDS: no ROS is needed.

Messages stay serialised. Types are made from the same definitions as messages are, so that others
can check that theirs are the same.
"""

from __future__ import annotations

import atexit
import os
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from typing import Any

from clearway.base.errors import InputError, MissingExtraError
from clearway.ros2.bus import Quality, TopicMessage, wire_kind
from clearway.ros2.discovered import DiscoveredPublishers
from clearway.ros2.messages import message_types

MOST_DOMAIN = 232
"""Ports of higher domain ids do not exist."""
MOST_AT_ONCE = 256
"""Messages of one topic taken at a time; the reader keeps no more than its depth anyway."""
LARGE_BUFFERS = (
    "<CycloneDDS><Domain><Internal><SocketReceiveBufferSize max='16MB'/></Internal>"
    "</Domain></CycloneDDS>"
)
"""Asked for, and as much of it taken as the kernel grants (net.core.rmem_max): Cyclone's own 1 MiB
holds half a cloud of 100,000 points, and the rest is lost where its reader is late by a moment."""
BASES = {
    "bool": "bool", "octet": "uint8", "byte": "uint8", "char": "uint8", "uint8": "uint8",
    "int8": "int8", "int16": "int16", "uint16": "uint16", "int32": "int32", "uint32": "uint32",
    "int64": "int64", "uint64": "uint64", "float32": "float32", "float64": "float64",
}  # fmt: skip


def domain_id(told: str | None = None) -> int:
    """ROS_DOMAIN_ID, 0 where nobody set it."""
    text = os.environ.get("ROS_DOMAIN_ID", "") if told is None else told
    if not text:
        return 0
    if not text.isdigit() or int(text) > MOST_DOMAIN:
        raise InputError("ROS_DOMAIN_ID", f"{text!r} is no number from 0 to {MOST_DOMAIN}")
    return int(text)


LONGEST_STOP_S = 3.0
"""For so long an ending process waits for its domains to stop. Others hear of its end by that; but
once in a while Cyclone waits for ever for a participant that is gone already."""
_OPENED: dict[int, Any] = {}
"""Domains by number: one is set up once in a process."""


def _open_domain(domain: int) -> None:
    """Set a domain up with large buffers; what CYCLONEDDS_URI says counts before it."""
    from cyclonedds.core import DDSException
    from cyclonedds.domain import Domain

    if domain not in _OPENED:
        if not _OPENED:
            atexit.register(_stop_domains)
        told = os.environ.get("CYCLONEDDS_URI", "")
        # Where it is there already, or what is reported is wrong, the participant finds out.
        with suppress(DDSException, UnicodeError):
            _OPENED[domain] = Domain(domain, f"{LARGE_BUFFERS},{told}" if told else LARGE_BUFFERS)


def _stop_domains() -> None:
    stopping = threading.Thread(target=_OPENED.clear, daemon=True)
    stopping.start()
    stopping.join(LONGEST_STOP_S)


class DdsBus:
    """A `bus.TopicBus` on a DDS domain."""

    def __init__(self, domain: int) -> None:
        try:
            from cyclonedds.core import DDSException
            from cyclonedds.domain import DomainParticipant
        except ImportError as cause:
            raise MissingExtraError("ROS 2 topics without ROS", "ros2") from cause
        _open_domain(domain)
        try:
            self._participant: Any = DomainParticipant(domain)
        except DDSException as refused:
            raise InputError(f"DDS domain {domain}", f"cannot be opened: {refused}") from refused
        self.name, self.recorded, self.domain = f"DDS domain {domain}", False, domain
        self._discovered = DiscoveredPublishers(self._participant)
        self._asked: dict[str, tuple[str, Quality]] = {}
        self._topics: dict[str, Any] = {}
        self._readers: dict[str, tuple[str, Any]] = {}
        self._writers: dict[str, Any] = {}
        self._waitset: Any = None
        self.lost: Counter[str] = Counter()
        """Messages by topic that DDS knows to have been lost on their way here."""

    def subscribe(self, topic: str, kind: str, quality: Quality) -> None:
        from cyclonedds.core import (
            InstanceState,
            Listener,
            ReadCondition,
            SampleState,
            ViewState,
            WaitSet,
        )
        from cyclonedds.sub import DataReader, Subscriber

        def note_lost(_reader: Any, status: Any) -> None:
            self.lost[topic] = int(status.total_count)

        reader = DataReader(
            Subscriber(self._participant),
            self._topic(topic, kind),
            qos=_policies(quality),
            listener=Listener(on_sample_lost=note_lost),  # type: ignore[no-untyped-call]
        )
        self._readers[topic], self._asked[topic] = (kind, reader), (kind, quality)
        if self._waitset is None:
            self._waitset = WaitSet(self._participant)
        anything = SampleState.NotRead | ViewState.Any | InstanceState.Any
        self._waitset.attach(ReadCondition(reader, anything))

    def advertise(self, topic: str, kind: str, quality: Quality) -> None:
        from cyclonedds.pub import DataWriter, Publisher

        writer = DataWriter(
            Publisher(self._participant), self._topic(topic, kind), qos=_policies(quality)
        )
        self._writers[topic] = writer

    def publish(self, topic: str, raw: bytes) -> bool:
        from cyclonedds._clayer import ddspy_write

        # Cyclone reads whole words.
        padded = raw.ljust((len(raw) + 3) & ~3, b"\0")
        return bool(ddspy_write(self._writers[topic]._ref, padded) >= 0)

    def take(self) -> Sequence[TopicMessage]:
        from cyclonedds._clayer import ddspy_take
        from cyclonedds.core import InstanceState, SampleState, ViewState

        anything = SampleState.Any | ViewState.Any | InstanceState.Any
        found = []
        for topic, (kind, reader) in self._readers.items():
            taken = ddspy_take(reader._ref, anything, MOST_AT_ONCE)
            if isinstance(taken, int):
                continue
            found += [
                TopicMessage(topic, kind, bytes(raw)) for raw, info in taken if info.valid_data
            ]
        return found

    def publishers(self, topic: str) -> int:
        reader = self._readers[topic][1]
        return _count(reader.get_matched_publications)

    def why_unheard(self, topic: str) -> str:
        return self._discovered.why_unheard(topic, *self._asked[topic])

    def subscribers(self, topic: str) -> int:
        """How many others hear a topic that is published."""
        return _count(self._writers[topic].get_matched_subscriptions)

    def resolve(self, topic: str) -> str:
        """A topic as it is named here."""
        return topic

    def wait(self, seconds: float) -> None:
        if self._waitset is None or seconds <= 0.0:
            threading.Event().wait(max(0.0, seconds))
            return
        self._waitset.wait(int(seconds * 1e9))

    def close(self) -> None:
        self._waitset = self._discovered = None  # type: ignore[assignment]
        self._readers.clear()
        self._writers.clear()
        self._topics.clear()
        self._participant = None

    def _topic(self, name: str, kind: str) -> Any:
        from cyclonedds.topic import Topic

        if name not in self._topics:
            self._topics[name] = Topic(self._participant, "rt" + name, idl_type(kind))
        return self._topics[name]


def _policies(quality: Quality) -> Any:
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.util import duration

    durable, local = Policy.Durability.Volatile, Policy.Durability.TransientLocal
    reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
    return Qos(
        reliable if quality.reliable else Policy.Reliability.BestEffort,
        local if quality.latched else durable,
        Policy.History.KeepLast(quality.depth),
    )


@cache
def idl_type(kind: str) -> Any:
    """A type for Cyclone of a message "package/msg/Name"."""
    from cyclonedds.idl import make_idl_struct

    package, _, name = wire_kind(kind).replace("/msg/", "/").partition("/")
    fields = {field: _idl(node) for field, node in message_types().FIELDDEFS[kind][1]}
    if not fields:
        from cyclonedds.idl import types

        fields = {"structure_needs_at_least_one_member": types.uint8}
    return make_idl_struct(f"{name}_", f"{package}::msg::dds_::{name}_", fields)


def _idl(node: tuple[Any, Any]) -> Any:
    from cyclonedds.idl import types

    array: Any = types.array
    sequence: Any = types.sequence
    which, inner = int(node[0]), node[1]
    if which == 1:
        if inner[0] == "string":
            return str
        return bool if inner[0] == "bool" else getattr(types, BASES[inner[0]])
    if which == 2:
        return idl_type(inner)
    base, length = inner
    if which == 3:
        return array[_idl(base), length]
    return sequence[_idl(base), length] if length else sequence[_idl(base)]


def _count(matched: Callable[[], Sequence[int]]) -> int:
    """How many ends match; asked again where one came while the binding counted, and it failed."""
    while True:
        with suppress(IndexError):
            return len(matched())
