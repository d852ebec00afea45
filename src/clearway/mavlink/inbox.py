"""From pieces of a link to the messages of one vehicle: filtered, checked, bounded, counted.

However much comes between two ticks, the work on it is bounded: of every kind of message only the
newest few are decoded, so that a flood of one kind shuts out no other. With a key, frames are
checked before they wait to be decoded: what is not signed with it takes no place of what is.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from clearway.mavlink import dialect as known
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.links import Peer
from clearway.mavlink.signing import SignatureCheck
from clearway.mavlink.wire import LONGEST_FRAME, MAVLINK_1, MavlinkFrame, frames_in

RATE_OVER = 20
"""So many of the last messages of a kind tell its rate."""
KEPT = {
    known.HEARTBEAT: 16,
    known.SYS_STATUS: 4,
    known.ATTITUDE: 32,
    known.LOCAL_POSITION_NED: 32,
    known.GLOBAL_POSITION_INT: 32,
    known.LOCAL_POSITION_NED_COV: 4,
    known.ODOMETRY: 4,
    known.ESTIMATOR_STATUS: 4,
    known.EKF_STATUS_REPORT: 4,
    known.GPS_GLOBAL_ORIGIN: 4,
    known.HOME_POSITION: 4,
    known.ADSB_VEHICLE: 128,
    known.OPEN_DRONE_ID_LOCATION: 128,
    known.GPS_RAW_INT: 4,
    known.OBSTACLE_DISTANCE: 16,
    known.DISTANCE_SENSOR: 64,
    known.OBSTACLE_DISTANCE_3D: 512,
    known.EXTENDED_SYS_STATE: 4,
    known.POSITION_TARGET_LOCAL_NED: 8,
    known.PARAM_VALUE: 16,
    known.COMMAND_ACK: 16,
    known.COMMAND_INT: 4,
    known.COMMAND_LONG: 8,
    known.SET_POSITION_TARGET_GLOBAL_INT: 4,
    known.TIMESYNC: 8,
    known.MISSION_COUNT: 4,
    known.MISSION_ITEM_INT: 64,
    known.MISSION_ACK: 4,
}
"""Messages that we need, and how many of each are decoded at a tick, the newest."""
FROM_ANY_COMPONENT = (
    known.ADSB_VEHICLE,
    known.OPEN_DRONE_ID_LOCATION,
    known.OBSTACLE_DISTANCE,
    known.DISTANCE_SENSOR,
    known.OBSTACLE_DISTANCE_3D,
)
"""Sensors may be components of their own; all else comes from the autopilot alone."""
FROM_ANY_SYSTEM = (known.COMMAND_INT, known.COMMAND_LONG, known.SET_POSITION_TARGET_GLOBAL_INT)
"""Ground stations ask too; what is not addressed to us is left out later."""
MOST_BYTES = 1 << 18
"""Cut into frames at a tick; older bytes beyond are dropped."""

OTHER_SYSTEM = "another system"
OTHER_COMPONENT = "another component"
OWN_FRAME = "our own frame"
FLOOD = "flood: more than can be used"
UNREADABLE = "cannot be decoded"
ANOTHER_OF_US = "another program with our component id"
MOST_SYSTEMS = 8
DOUBLE = (
    f"another program uses component {known.OBSTACLE_AVOIDANCE} of this system: set-points of two "
    "mix; end one of them"
)
SIGNED = (
    "frames are signed and there is no --signing-key: what they say is not checked, and the "
    "autopilot will refuse our set-points if it asks for signatures"
)


class ReceivedMessage(NamedTuple):
    """A message that may be used."""

    message: Message
    number: int
    peer: Peer
    sender: tuple[int, int] = (1, 1)
    """System and component."""


class Inbox:
    """Takes pieces, gives messages; `refused` and `received` count everything that came."""

    def __init__(
        self,
        system: int,
        component: int,
        signatures: SignatureCheck | None,
        *,
        stream: bool,
        is_ours: Callable[[bytes], bool] = lambda _: True,
        kept: Mapping[int, int] = KEPT,
        from_any: tuple[int, ...] = FROM_ANY_SYSTEM,
    ) -> None:
        self.warnings: list[str] = []
        """What is wrong with who sends."""
        self._is_ours, self._kept, self._from_any = is_ours, kept, from_any
        self._systems: set[int] = set()
        self.received: Counter[str] = Counter()
        self._came_s: dict[str, deque[float]] = {}
        self.refused: Counter[str] = Counter()
        self._system, self._component = system, component
        self._signatures, self._stream = signatures, stream
        self._rest = b""
        messages = dialect().mavlink_map
        self._extras = {number: int(messages[number].crc_extra) for number in kept}
        self._codec = dialect().MAVLink(None)

    def take(self, pieces: Iterable[tuple[bytes, Peer]]) -> list[ReceivedMessage]:
        """Messages in the order of their arrival."""
        newest: dict[int, deque[tuple[int, MavlinkFrame, Peer]]] = {}
        order = 0
        for data, peer in self._bound(list(pieces)):
            frames, rest = frames_in(
                self._rest + data, self._extras, self.refused, stream=self._stream
            )
            self._rest = rest[-LONGEST_FRAME:]
            for frame in frames:
                flaw = self._flaw(frame)
                if flaw is not None:
                    self.refused[flaw] += 1
                    continue
                waiting = newest.setdefault(frame.message, deque(maxlen=self._kept[frame.message]))
                self.refused[FLOOD] += len(waiting) == waiting.maxlen
                waiting.append((order, frame, peer))
                order += 1
        self.refused = +self.refused
        waiting_all = sorted(entry for waiting in newest.values() for entry in waiting)
        return [a for _, frame, peer in waiting_all if (a := self._open(frame, peer)) is not None]

    def _bound(self, pieces: list[tuple[bytes, Peer]]) -> list[tuple[bytes, Peer]]:
        """The newest pieces, MOST_BYTES of them at most; with a key all, which are checked."""
        if self._signatures is not None:
            return pieces
        room, first = MOST_BYTES, len(pieces)
        while first > 0 and len(pieces[first - 1][0]) <= room:
            first -= 1
            room -= len(pieces[first][0])
        if first:
            self.refused[FLOOD] += first
            self._rest = b""
        return pieces[first:]

    def strangers(self) -> list[str]:
        """In words, who sends instead of the autopilot, if anybody does, or in what way."""
        if self.refused[MAVLINK_1]:
            return ["hears MAVLink 1, which is refused: SERIALn_PROTOCOL 2 sends MAVLink 2"]
        if not self._systems and not self.refused[OTHER_COMPONENT]:
            return []
        told = [f"system {number}" for number in sorted(self._systems)]
        told += ["other components"] if self.refused[OTHER_COMPONENT] else []
        wanted = f"waits for system {self._system}, component {self._component}"
        return [f"hears {', '.join(told)}; {wanted}: --system, --component"]

    def report_heard(self, now_s: float) -> dict[str, dict[str, float]]:
        """Of each message how many came, how many in a second of late, and how old the last is."""
        told = {}
        for name, came_s in sorted(self._came_s.items()):
            span_s = came_s[-1] - came_s[0]
            rate_hz = (len(came_s) - 1) / span_s if span_s > 0.0 else 0.0
            told[name] = {
                "messages": self.received[name],
                "rate_hz": round(rate_hz, 3),
                "age_s": round(now_s - came_s[-1], 3),
            }
        return told

    def _flaw(self, frame: MavlinkFrame) -> str | None:
        """Why a frame is left out; what costs least is looked at first."""
        of_us = frame.system == self._system and frame.component == known.OBSTACLE_AVOIDANCE
        if of_us and self._is_ours(frame.data):
            return OWN_FRAME
        of_any = frame.message in self._from_any
        if frame.system != self._system and not of_any:
            if len(self._systems) < MOST_SYSTEMS:
                self._systems.add(frame.system)
            return OTHER_SYSTEM
        from_here = frame.component == self._component or frame.message in FROM_ANY_COMPONENT
        if not (of_us or of_any or from_here):
            return OTHER_COMPONENT
        if self._signatures is not None:
            flaw = self._signatures.flaw(frame)
            if flaw is not None:
                return flaw
        elif frame.signed and frame.system == self._system:
            self._warn(SIGNED)
        if of_us:
            self._warn(DOUBLE)
            return ANOTHER_OF_US
        return None

    def _warn(self, words: str) -> None:
        if words not in self.warnings:
            self.warnings.append(words)

    def _open(self, frame: MavlinkFrame, peer: Peer) -> ReceivedMessage | None:
        """The message in a frame, if it can be decoded."""
        try:
            message = self._codec.decode(bytearray(frame.data))
        except dialect().MAVError:
            self.refused[UNREADABLE] += 1
            return None
        name = message.get_type()
        self.received[name] += 1
        self._came_s.setdefault(name, deque(maxlen=RATE_OVER)).append(time.monotonic())
        return ReceivedMessage(message, frame.message, peer, (frame.system, frame.component))
