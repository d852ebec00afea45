"""Topics by rclpy, where ROS is there: the same serialised messages, on a node that ROS sees."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from clearway.ros2.bus import MissingMessageError, Quality, TopicMessage, wire_kind
from clearway.ros2.discovered import Offer, why_unmatched

PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
"""Variables in which Fast DDS looks for its settings: its releases 2 and 3."""
NEWER_RCLPY = 8
"""From this major version of rclpy on, in ROS 2 Kilted, Fast DDS is of release 3."""
PROFILE = Path(__file__).with_name("fast_dds.xml")
MOST_AT_ONCE = 1000
"""Callbacks that are run at a time: a flood must not keep the node from its ticks."""


def rclpy_is_there() -> bool:
    """Whether this Python has rclpy."""
    try:
        import_module("rclpy")
    except ImportError:
        return False
    return True


def begin_rclpy(ros_args: Sequence[str] = ()) -> Any:
    """Return rclpy, begun: with buffers for clouds, unless the user has chosen settings."""
    if not any(name in os.environ for name in PROFILES):
        os.environ[PROFILES[_is_newer()]] = str(PROFILE)
    rclpy: Any = import_module("rclpy")
    signals: Any = import_module("rclpy.signals")
    # Whoever runs it ends it: at Ctrl-C a hold is still to be sent.
    rclpy.init(args=list(ros_args), signal_handler_options=signals.SignalHandlerOptions.NO)
    return rclpy


def _is_newer() -> bool:
    try:
        return int(version("rclpy").partition(".")[0]) >= NEWER_RCLPY
    except (PackageNotFoundError, ValueError):
        return True


class RclpyBus:
    """A `bus.TopicBus` on a node of rclpy, which may be there before it and stay after it."""

    def __init__(self, node: Any, closes: Callable[[], None] = lambda: None) -> None:
        executors: Any = import_module("rclpy.executors")
        self._node, self._closes = node, closes
        self._executor = executors.SingleThreadedExecutor()
        self._executor.add_node(node)
        self.name = f"rclpy, node {node.get_fully_qualified_name()}"
        self.recorded, self.namespace = False, str(node.get_namespace())
        self.lost: Counter[str] = Counter()
        self._came: list[TopicMessage] = []
        self._asked: dict[str, tuple[str, Quality]] = {}
        self._readers: list[Any] = []
        self._writers: dict[str, Any] = {}

    @classmethod
    def on_own_node(cls, node: str, namespace: str) -> RclpyBus:
        """Open a bus that ends with its node, and rclpy with it."""
        rclpy = begin_rclpy()
        made = rclpy.create_node(node, namespace=namespace or None)

        def end() -> None:
            made.destroy_node()
            rclpy.try_shutdown()

        return cls(made, end)

    def subscribe(self, topic: str, kind: str, quality: Quality) -> None:
        def came(raw: bytes) -> None:
            self._came.append(TopicMessage(topic, kind, bytes(raw)))

        profile = _profile(quality)
        reader = self._node.create_subscription(_type(kind), topic, came, profile, raw=True)
        self._readers.append(reader)
        self._asked[topic] = (kind, quality)

    def advertise(self, topic: str, kind: str, quality: Quality) -> None:
        self._writers[topic] = self._node.create_publisher(_type(kind), topic, _profile(quality))

    def publish(self, topic: str, raw: bytes) -> bool:
        self._writers[topic].publish(raw)
        return True

    def take(self) -> Sequence[TopicMessage]:
        for _ in range(MOST_AT_ONCE):
            before = len(self._came)
            self._executor.spin_once(timeout_sec=0.0)
            if len(self._came) == before:
                break
        came, self._came = self._came, []
        return came

    def publishers(self, topic: str) -> int:
        return sum(not why for why in self._whys(topic))

    def why_unheard(self, topic: str) -> str:
        return next((why for why in self._whys(topic) if why), "")

    def _whys(self, topic: str) -> list[str]:
        """For each publisher, why it is not heard; "" of one that is."""
        qos: Any = import_module("rclpy.qos")
        kind, quality = self._asked.get(topic, ("", Quality()))
        return [
            why_unmatched(
                Offer(
                    one.topic_type,
                    reliable=one.qos_profile.reliability != qos.ReliabilityPolicy.BEST_EFFORT,
                    latched=one.qos_profile.durability != qos.DurabilityPolicy.VOLATILE,
                ),
                kind,
                quality,
            )
            for one in self._node.get_publishers_info_by_topic(self.resolve(topic))
        ]

    def subscribers(self, topic: str) -> int:
        """How many others hear a topic that is published."""
        return int(self._writers[topic].get_subscription_count())

    def resolve(self, topic: str) -> str:
        """A topic by the name that ROS's own remappings give it."""
        return str(self._node.resolve_topic_name(topic))

    def wait(self, seconds: float) -> None:
        self._executor.spin_once(timeout_sec=max(0.0, seconds))

    def close(self) -> None:
        for reader in self._readers:
            self._node.destroy_subscription(reader)
        for writer in self._writers.values():
            self._node.destroy_publisher(writer)
        self._readers.clear()
        self._writers.clear()
        self._executor.remove_node(self._node)
        self._executor.shutdown()
        self._closes()


def _profile(quality: Quality) -> Any:
    qos: Any = import_module("rclpy.qos")
    reliable, durable = qos.ReliabilityPolicy, qos.DurabilityPolicy
    return qos.QoSProfile(
        depth=quality.depth,
        reliability=reliable.RELIABLE if quality.reliable else reliable.BEST_EFFORT,
        durability=durable.TRANSIENT_LOCAL if quality.latched else durable.VOLATILE,
    )


def _type(kind: str) -> Any:
    package, _, name = wire_kind(kind).replace("/msg/", "/").partition("/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError) as cause:
        raise MissingMessageError(
            "--backend rclpy", f"this ROS has no {package}/msg/{name}: install {package}, or "
            "source the workspace that builds it, or use --backend dds, which needs none"
        ) from cause  # fmt: skip
