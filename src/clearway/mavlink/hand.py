"""The second process of a MAVLink link: how set-points and texts are handed to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from clearway.hand.hand import Notice, SecondProcess
from clearway.hand.handover import Packet
from clearway.live.handing import (
    ENDED,
    FLOWN,
    NO_SIMULATED_TIME,
    NOT_FLOWN,
    TURNED_OFF,
    Encoding,
    Handing,
    Says,
)
from clearway.live.link.loop import Loop
from clearway.live.link.set_point import SetPoint
from clearway.mavlink.dialect import Message
from clearway.mavlink.mavlink_link import MavlinkLink

MODULE = "clearway.mavlink.hand_process"
CRITICAL = 2
"""MAV_SEVERITY_CRITICAL."""


@dataclass(frozen=True, slots=True)
class FrameEncoding:
    """Frames of one link, packed ahead of their time."""

    link: MavlinkLink[Any]

    def set_points(self, points: Sequence[tuple[float, SetPoint]]) -> list[tuple[Packet, ...]]:
        encode = self.link.session.encode
        messages = [encode(point, time_s) for time_s, point in points]
        return [tuple(self._pack(one)) for one in messages]

    def says(self, _time_s: float) -> Says:
        text = self.link.session.sayings.text
        return Says(*(tuple(self._pack(text(t, CRITICAL))) for t in (FLOWN, ENDED, NOT_FLOWN)))

    def peer(self) -> tuple[str, int] | None:
        return self.link.frames.peer

    def _pack(self, messages: Iterable[Message]) -> list[Packet]:
        return [Packet(0, frame) for frame in self.link.outbox.pack_ahead(messages)]


def begin_mavlink_hand(
    loop: Loop,
    link: MavlinkLink[Any],
    *,
    key: Path | None,
    wanted: bool,
    log: int | None,
    notice: Notice,
) -> None:
    """Start the second process of a link, or say why there is none."""
    terms = link.session.terms.session
    if not terms.act:
        return
    why_none = (
        (TURNED_OFF, not wanted),
        (NO_SIMULATED_TIME, terms.speedup is None),
    )
    none = next((why for why, holds in why_none if holds), None)
    if none is not None:
        notice(none)
        return
    frames = link.frames
    sender = {
        "descriptor": frames.fileno(),
        "line": frames.stream,
        "key": None if key is None else str(key),
    }
    hand = SecondProcess.start(
        MODULE, sender, (frames.fileno(),), loop.longest_s, log=log, notice=notice
    )
    if key is not None:
        hand.on_return = partial(_sign_later, link, hand)
    way = FrameEncoding(link)
    encoding = Encoding(way.set_points, way.says, way.peer)
    link.handing = Handing(hand, encoding, loop.period_s)


def _sign_later(link: MavlinkLink[Any], hand: SecondProcess) -> None:
    """Both sides sign later than the other has."""
    link.outbox.leap()
    hand.wants_all = True
