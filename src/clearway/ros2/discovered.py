"""Publishers that DDS has discovered, and why a reader does not hear one of them."""

from __future__ import annotations

from typing import Any, NamedTuple

from clearway.ros2.bus import Quality, wire_kind

MOST = 10_000
"""Publications that are looked through."""
FIELDS_UNKNOWN = (
    "a publisher, but Cyclone DDS cannot read its type, as with Fast DDS of ROS 2 Kilted: start "
    "that node with examples/ros2/fast_dds.xml, or use --backend rclpy"
)


class Offer(NamedTuple):
    """What a publisher announces."""

    kind: str
    reliable: bool
    latched: bool


def why_unmatched(offer: Offer, kind: str, quality: Quality) -> str:
    """Why a reader of a kind does not match a publisher; "" where the two match."""
    package, _, name = wire_kind(kind).replace("/msg/", "/").partition("/")
    if offer.kind != f"{package}/msg/{name}":
        return f"a publisher, but of {offer.kind}"
    if quality.reliable and not offer.reliable:
        return "a publisher, but best effort where reliable is asked for (QoS)"
    if quality.latched and not offer.latched:
        return "a publisher, but volatile where transient local is asked for (QoS)"
    return ""


class DiscoveredPublishers:
    """What the participants on a domain say that they publish."""

    def __init__(self, participant: Any) -> None:
        from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication

        self._reader: Any = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)

    def why_unheard(self, topic: str, kind: str, quality: Quality) -> str:
        """Why a reader that has no match hears nobody; "" where nobody publishes."""
        from cyclonedds.core import InstanceState

        for found in self._reader.read(MOST):
            alive = found.sample_info.instance_state == InstanceState.Alive
            if not alive or found.topic_name != f"rt{topic}":
                continue
            told = found.type_name.replace("::dds_::", "::").removesuffix("_").replace("::", "/")
            offers = found.qos.asdict() if found.qos is not None else {}
            offer = Offer(
                told,
                reliable="BestEffort" not in str(offers.get("Reliability")),
                latched="Volatile" not in str(offers.get("Durability")),
            )
            return why_unmatched(offer, kind, quality) or FIELDS_UNKNOWN
        return ""
