"""Messages out: packed as MAVLink 2 frames of our component, signed where there is a key."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable

from clearway.mavlink.dialect import OBSTACLE_AVOIDANCE, Message, dialect
from clearway.mavlink.signing import TICKS_PER_S, SignatureCheck, signing_time

ONBOARD_CONTROLLER = 18
"""MAV_TYPE_ONBOARD_CONTROLLER."""
NO_AUTOPILOT = 8
"""MAV_AUTOPILOT_INVALID."""
# MAV_STATE.
STANDBY = 3
ACTIVE = 4
CRITICAL = 5
REMEMBERED = 256
"""Frames sent."""
LEAP = TICKS_PER_S // 1000
"""By which signatures are later after another process has signed: a millisecond."""
LEAP_HEARD = TICKS_PER_S // 5
"""By which they are later where the newest time is that of a message of others: 0.2 s."""


class Packer:
    """Numbers, signs and packs the messages of one component.

    check: of what is heard with the same key; signatures are never older than those.
    """

    def __init__(
        self,
        system: int,
        component: int = OBSTACLE_AVOIDANCE,
        key: bytes | None = None,
        check: SignatureCheck | None = None,
    ) -> None:
        self._check = check
        self._codec = dialect().MAVLink(None, srcSystem=system, srcComponent=component)
        if key is not None:
            self._codec.signing.secret_key = key
            self._codec.signing.sign_outgoing = True
            self._codec.signing.timestamp = signing_time()

    def pack(self, message: Message) -> bytes:
        """The frame of a message."""
        signing = self._codec.signing
        if signing.sign_outgoing:
            # A computer without a clock keeps up with the others by what it hears of them.
            heard = 0 if self._check is None else self._check.newest
            signing.timestamp = max(signing.timestamp, signing_time(), heard)
        frame = bytes(message.pack(self._codec))
        self._codec.seq = (self._codec.seq + 1) % 256
        return frame

    def pack_ahead(self, messages: Iterable[Message]) -> list[bytes]:
        """Frames that another process may send later: the numbers of ours do not count them."""
        signing, number = self._codec.signing, self._codec.seq
        stamp, frames = signing.timestamp, []
        for message in messages:
            frames.append(self.pack(message))
            signing.timestamp = stamp  # Their sender signs them anew, by the time since.
        self._codec.seq = number
        return frames

    def leap(self) -> None:
        """Sign later than another process has that sent for this one.

        By this computer's clock time has passed since. What others' clocks report steps.
        """
        heard, now = 0 if self._check is None else self._check.newest, signing_time()
        signing = self._codec.signing
        leap = LEAP if heard <= now else LEAP_HEARD
        signing.timestamp = max(signing.timestamp, max(now, heard) + leap)


class Outbox:
    """Sends messages and counts those that went, by type."""

    def __init__(self, packer: Packer, send: Callable[[bytes], bool]) -> None:
        self.sent: Counter[str] = Counter()
        self._packer, self._send = packer, send
        self._lately: deque[bytes] = deque(maxlen=REMEMBERED)

    def pack_ahead(self, messages: Iterable[Message]) -> list[bytes]:
        """As `Packer.pack_ahead`."""
        return self._packer.pack_ahead(messages)

    def leap(self) -> None:
        """As `Packer.leap`."""
        self._packer.leap()

    def is_ours(self, frame: bytes) -> bool:
        """Whether a frame is one of the last that were sent: routers may bring them back."""
        return frame in self._lately

    def send(self, messages: Iterable[Message]) -> None:
        for message in messages:
            frame = self._packer.pack(message)
            self._lately.append(frame)
            if self._send(frame):
                self.sent[message.get_type()] += 1


def heartbeat(status: int) -> Message:
    """HEARTBEAT of an onboard computer."""
    return dialect().MAVLink_heartbeat_message(ONBOARD_CONTROLLER, NO_AUTOPILOT, 0, 0, status, 3)
