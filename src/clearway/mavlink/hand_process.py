"""The second process over MAVLink: it sends through the descriptor that the first one opened.

Frames come encoded; a signed one is signed anew, since signatures count time.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any

from clearway.hand.handover import Packet
from clearway.hand.process import DescriptorSender, Sender, watch_over
from clearway.mavlink.signing import TICKS_PER_S, read_key, signing_time
from clearway.mavlink.wire import SIGNATURE

TIME_AT = 1
"""Where a signature has its time."""
HASH_AT = 7
"""Where a signature has its hash."""


class SigningSender(DescriptorSender):
    """Signs each frame at the time it is sent, later than any that was signed before."""

    def __init__(self, descriptor: int, *, line: bool, key: bytes) -> None:
        super().__init__(descriptor, line=line)
        self._key, self._newest = key, 0

    def send(self, packet: Packet, peer: tuple[str, int] | None, age_s: float) -> bool:
        body, block = packet.data[:-SIGNATURE], packet.data[-SIGNATURE:]
        # The deciding process may keep another clock than this computer's: that of the autopilot.
        told = int.from_bytes(block[TIME_AT:HASH_AT], "little") + int(age_s * TICKS_PER_S)
        self._newest = max(self._newest + 1, told, signing_time())
        signed = body + block[:TIME_AT] + self._newest.to_bytes(HASH_AT - TIME_AT, "little")
        right = hashlib.sha256(self._key + signed).digest()[: SIGNATURE - HASH_AT]
        return super().send(Packet(packet.channel, signed + right), peer, age_s)


def open_frames(given: dict[str, Any]) -> Sender:
    """The sender of a link that the deciding process opened."""
    descriptor, line, key = given["descriptor"], given["line"], given["key"]
    if key is None:
        return DescriptorSender(descriptor, line=line)
    return SigningSender(descriptor, line=line, key=read_key(Path(key)))


if __name__ == "__main__":
    sys.exit(watch_over(sys.argv[1:], open_frames))
