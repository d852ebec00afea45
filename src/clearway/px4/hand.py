"""The second process of a flight mode of PX4: what is handed to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from clearway.hand.handover import Packet
from clearway.live.handing import Encoding, Says
from clearway.live.link.set_point import SetPoint
from clearway.px4.mode import ARMED
from clearway.px4.topics import Px4Topics
from clearway.ros2.bus import USUAL, Quality
from clearway.ros2.hand import TopicEncoding
from clearway.ros2.messages import pack_message

HOLD = 2
UNREGISTER = 3
ANSWER = 4
"""Channels, after those of set-points and diagnostics."""
ON_CHANNELS = ("VehicleCommand", "UnregisterExtComponent", "ArmingCheckReply")
SET_POINT = 0


@dataclass(frozen=True, slots=True)
class ModeEncoding(TopicEncoding):
    """Set-points, and the answer to PX4's arming checks meanwhile; at the end Hold."""

    link: Px4Topics[Any]
    module: ClassVar[str] = "clearway.px4.hand_process"

    def topics(self) -> list[tuple[str, str, Quality]]:
        link = self.link
        more = [
            (link.names(link.topic(name)), link.release.kind(name), USUAL) for name in ON_CHANNELS
        ]
        return [*TopicEncoding.topics(self), *more]

    def more(self) -> dict[str, object]:
        link = self.link
        heard = ("VehicleStatus", "ArmingCheckRequest")
        return {
            "heard": [(link.topic(name), link.release.kind(name)) for name in heard],
            "armed": ARMED,
            "in_mode": (SET_POINT, HOLD),
            "hold": HOLD,
            "answer": (ANSWER, link.release.kind("ArmingCheckReply")),
        }

    def encoding(self) -> Encoding:
        return Encoding(self.set_points, self.says, self._mode, lambda: self.link.leads)

    def _mode(self) -> tuple[str, int] | None:
        mode = self.link.mode
        return None if mode.mode_id is None else (mode.name, mode.mode_id)

    def set_points(self, points: Sequence[tuple[float, SetPoint]]) -> list[tuple[Packet, ...]]:
        if not points:
            return []  # PX4 may not have given the mode a number yet.
        link = self.link
        (topic,) = link.parameters.set_points.values()
        raws = [
            link.in_local_frame(self._message(topic, point, time_s)) for time_s, point in points
        ]
        link.own_set_points.note_handed(raws)
        answer = Packet(ANSWER, pack_message(link.mode.answer_message(0, can_run=True)))
        return [(Packet(SET_POINT, raw), answer) for raw in raws]

    def says(self, time_s: float) -> Says:
        begins, over, nothing = TopicEncoding.says(self, time_s)
        mode = self.link.mode
        leaves = [Packet(HOLD, pack_message(mode.hold_message()))]
        if mode.mode_id is not None:
            leaves.append(Packet(UNREGISTER, pack_message(mode.unregister_message(mode.mode_id))))
        return Says(begins, (*over, *leaves), (*nothing, *leaves))
