"""Topics by rclpy, where ROS is there: the same serialised messages, on a node that ROS sees."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from clearway.ros2.bus import MissingMessageError, Quality, TopicMessage, wire_kind


def rclpy_is_there() -> bool:
    """Whether this Python has rclpy."""
    try:
        import_module("rclpy")
    except ImportError:
        return False
    return True


class RclpyBus:
    """A `bus.TopicBus` on a node of rclpy."""

    def __init__(self, node: str, namespace: str, ros_args: Sequence[str] = ()) -> None:
        self._rclpy: Any = import_module("rclpy")
        signals: Any = import_module("rclpy.signals")
        # Whoever runs it ends it: at Ctrl-C a hold is still to be sent.
        self._rclpy.init(
            args=list(ros_args), signal_handler_options=signals.SignalHandlerOptions.NO
        )
        self._node = self._rclpy.create_node(node, namespace=namespace or None)
        self.name = f"rclpy, node {self._node.get_fully_qualified_name()}"
        self.recorded, self.namespace = False, namespace
        self.lost: Counter[str] = Counter()
        self._came: list[TopicMessage] = []
        self._writers: dict[str, Any] = {}

    def subscribe(self, topic: str, kind: str, quality: Quality) -> None:
        def came(raw: bytes) -> None:
            self._came.append(TopicMessage(topic, kind, bytes(raw)))

        self._node.create_subscription(_type(kind), topic, came, self._profile(quality), raw=True)

    def advertise(self, topic: str, kind: str, quality: Quality) -> None:
        self._writers[topic] = self._node.create_publisher(
            _type(kind), topic, self._profile(quality)
        )

    def publish(self, topic: str, raw: bytes) -> bool:
        self._writers[topic].publish(raw)
        return True

    def take(self) -> Sequence[TopicMessage]:
        while True:
            before = len(self._came)
            self._rclpy.spin_once(self._node, timeout_sec=0.0)
            if len(self._came) == before:
                break
        came, self._came = self._came, []
        return came

    def publishers(self, topic: str) -> int:
        return int(self._node.count_publishers(topic))

    def why_unheard(self, topic: str) -> str:
        del topic
        return ""

    def wait(self, seconds: float) -> None:
        self._rclpy.spin_once(self._node, timeout_sec=max(0.0, seconds))

    def close(self) -> None:
        self._node.destroy_node()
        self._rclpy.try_shutdown()

    def _profile(self, quality: Quality) -> Any:
        qos: Any = import_module("rclpy.qos")
        return qos.QoSProfile(
            depth=quality.depth,
            reliability=qos.ReliabilityPolicy.RELIABLE
            if quality.reliable
            else qos.ReliabilityPolicy.BEST_EFFORT,
            durability=qos.DurabilityPolicy.TRANSIENT_LOCAL
            if quality.latched
            else qos.DurabilityPolicy.VOLATILE,
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
