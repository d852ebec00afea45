"""The second process of a flight mode of PX4: it sends only while PX4 flies that mode.

PX4's own modes would obey its set-points too, so it hears PX4's status. And PX4 leaves a mode that
answers no arming checks, so it answers them in place of the deciding process.
"""

from __future__ import annotations

import math
import sys
import time
from typing import Any, Final

from clearway.hand.handover import Packet
from clearway.hand.process import watch_over
from clearway.ros2.bus import Quality, TopicBus
from clearway.ros2.hand_process import TopicSender, open_end
from clearway.ros2.messages import pack_message, unpack_cdr

SETTLES_S: Final = 0.1
"""Topics have no order among each other: Hold follows the last set-point so late."""
LOST_S: Final = 3.0
"""Without PX4's status for so long, nobody knows which mode it flies."""
NEWEST = Quality(reliable=False, depth=1)


class ModeSender(TopicSender):
    """Publishes what is encoded; set-points and commands only while PX4 flies the mode.

    given: topics as of a `TopicSender`; "heard": status and arming checks, as (topic, kind) each;
    "in_mode": channels that are sent in the mode alone; "hold": that of the command to Hold;
    "answer": channel and kind of answers.
    """

    def __init__(self, bus: TopicBus, given: dict[str, Any]) -> None:
        super().__init__(bus, [topic for topic, *_ in given["topics"]])
        (self._status_topic, _), _ = given["heard"]
        self._kinds: dict[str, str] = dict(given["heard"])
        for topic, kind in self._kinds.items():
            bus.subscribe(topic, kind, NEWEST)
        self._armed, self._in_mode = given["armed"], given["in_mode"]
        self._answer_on, self._answer_kind = given["answer"]
        self._hold_on = given["hold"]
        self._answer: bytes | None = None
        self._question: int | None = None
        self._mode: int | None = None
        self._flown: int | None = None
        self._status_s = -math.inf

    def send(self, packet: Packet, peer: tuple[str, int] | None, age_s: float) -> bool:
        self._mode = None if peer is None else peer[1]
        self._hear()
        if packet.channel == self._answer_on:
            self._answer = packet.data
            self._reply()
            return True
        if packet.channel == self._hold_on:
            self.wait(SETTLES_S)
        if packet.channel in self._in_mode and not self._leads:
            return False
        return super().send(packet, peer, age_s)

    def wait(self, seconds: float) -> bool:
        until = time.monotonic() + seconds
        while self._hear() and self._leads:
            self._reply()
            left_s = until - time.monotonic()
            if left_s <= 0.0:
                return True
            self._bus.wait(left_s)
        return False

    @property
    def _leads(self) -> bool:
        """Whether PX4 flies the mode, as far as is known."""
        is_known = time.monotonic() - self._status_s <= LOST_S
        return is_known and self._mode is not None and self._flown == self._mode

    def _hear(self) -> bool:
        """Take what has come; false where that is not possible any more."""
        try:
            for came in self._bus.take():
                message = unpack_cdr(came.raw, self._kinds[came.topic])
                if came.topic != self._status_topic:
                    self._question = int(message.request_id)
                    continue
                is_armed = message.arming_state == self._armed
                self._flown = int(message.nav_state) if is_armed else None
                self._status_s = time.monotonic()
        except Exception:
            self._flown = None  # Whoever hears nothing sends nothing.
            return False
        return True

    def _reply(self) -> None:
        """Answer the newest arming check, where there is one: the mode can run on."""
        question, self._question = self._question, None
        if question is None or self._answer is None or not self._leads:
            return
        answer = unpack_cdr(self._answer, self._answer_kind)
        answer.request_id = question
        super().send(Packet(self._answer_on, pack_message(answer)), None, 0.0)


def open_mode(given: dict[str, Any]) -> ModeSender:
    """The sender on the bus that the deciding process is on."""
    return ModeSender(open_end(given), given)


if __name__ == "__main__":
    sys.exit(watch_over(sys.argv[1:], open_mode))
