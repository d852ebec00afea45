"""Mission, fence and rally points of an autopilot, taken over a link and written as a plan.

The mission protocol: the list is asked for, its length comes, items are asked for one by one, and
the end is acknowledged. What does not come is asked for again.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError
from clearway.io.plans.flight_plan import NO_HOME
from clearway.io.plans.plan_commands import (
    CIRCLE_INSIDE,
    CIRCLE_OUTSIDE,
    DO_JUMP,
    FENCE_INSIDE,
    FENCE_OUTSIDE,
)
from clearway.io.plans.qgc_plan import PX4
from clearway.mavlink import dialect as known
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.inbox import Inbox, ReceivedMessage
from clearway.mavlink.links import FrameLink
from clearway.mavlink.own_state import DEGREES_E7

KINDS = {"mission": 0, "fence": 1, "rally": 2}
"""MAV_MISSION_TYPE."""
ASK_AGAIN_S = 1.0
MOST_ASKED = 5
MOST_ITEMS = 10_000
REQUEST_MESSAGE = 512
UNSTATED = (-(2**31), 2**31 - 1)
"""Latitude and longitude of an item that states none."""
IN_PLACES = (5, 6, 11, 0, 3, 10)
"""MAV_FRAME of places on Earth."""


class ListDownload:
    """One list; ask `to_send` for what is to be sent, and tell it what comes."""

    def __init__(self, kind: int, system: int, component: int) -> None:
        self.items: list[Message] = []
        self.done = False
        self.missing = False
        """Whether the autopilot has no such list, or never answered."""
        self._kind, self._target = kind, (system, component)
        self._count: int | None = None
        self._asked_s, self._asked = -math.inf, 0

    def to_send(self, now_s: float) -> list[Message]:
        """A question, where one is due; at the end the acknowledgement."""
        if self.done or now_s - self._asked_s < ASK_AGAIN_S:
            return []
        if self._asked == MOST_ASKED:
            self.done = self.missing = True
            return []
        self._asked, self._asked_s = self._asked + 1, now_s
        if self._count is None:
            return [dialect().MAVLink_mission_request_list_message(*self._target, self._kind)]
        make = dialect().MAVLink_mission_request_int_message
        return [make(*self._target, len(self.items), self._kind)]

    def hear(self, message: Message, number: int) -> list[Message]:
        """MISSION_COUNT, MISSION_ITEM_INT or MISSION_ACK; what is to be said to it at once."""
        if self.done or message.mission_type != self._kind:
            return []
        if number == known.MISSION_ACK:
            if self._count is None and message.type != 0:
                self.done = self.missing = True
            return []
        if number == known.MISSION_COUNT:
            if self._count is None:
                self._count = min(int(message.count), MOST_ITEMS)
        elif self._count is None or message.seq != len(self.items):
            return []
        else:
            self.items.append(message)
        self._asked, self._asked_s = 0, -math.inf
        if self._count is not None and len(self.items) == self._count:
            self.done = True
            return [dialect().MAVLink_mission_ack_message(*self._target, 0, self._kind)]
        return []


class HeardOn:
    """What has come on a link, at each call; and of it which autopilot it is, and its home.

    Answers go to where the autopilot's heartbeats come from: sensors may send to the same port.
    """

    def __init__(self, link: FrameLink, inbox: Inbox) -> None:
        self.autopilot: int | None = None
        """MAV_AUTOPILOT."""
        self.home: list[float] | None = None
        self._link, self._inbox = link, inbox

    def __call__(self) -> list[ReceivedMessage]:
        found = self._inbox.take(self._link.receive())
        for arrival in found:
            message = arrival.message
            if arrival.number == known.HEARTBEAT:
                self._link.answer_to(arrival.peer)
                self.autopilot = int(message.autopilot)
            elif arrival.number == known.HOME_POSITION:
                place = (message.latitude * DEGREES_E7, message.longitude * DEGREES_E7)
                self.home = [*(round(value, 7) for value in place), message.altitude / 1000.0]
        return found

    def know_autopilot(
        self,
        send: Callable[[list[Message]], None],
        target: tuple[int, int],
        wait: Callable[[float], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Wait for a heartbeat, and on PX4 ask for home: its mission has none."""
        ask = dialect().MAVLink_command_long_message(
            *target, REQUEST_MESSAGE, 0, known.HOME_POSITION, 0, 0, 0, 0, 0, 0
        )
        until, asked_s = clock() + MOST_ASKED * ASK_AGAIN_S, -math.inf
        while clock() < until:
            if self.autopilot is not None and (self.autopilot != PX4 or self.home is not None):
                return
            if self.autopilot == PX4 and clock() - asked_s >= ASK_AGAIN_S:
                send([ask])
                asked_s = clock()
            wait(0.05)
            self()


def download(
    receive: Callable[[], list[ReceivedMessage]],
    send: Callable[[list[Message]], None],
    system: int,
    component: int,
    wait: Callable[[float], None],
    clock: Callable[[], float] = time.monotonic,
) -> dict[str, list[Message]]:
    """All lists by name; raises InputError where the autopilot gives no mission."""
    found = {}
    for name, kind in KINDS.items():
        one = ListDownload(kind, system, component)
        while not one.done:
            send(one.to_send(clock()))
            wait(0.05)
            for arrival in receive():
                if arrival.number in (
                    known.MISSION_COUNT,
                    known.MISSION_ITEM_INT,
                    known.MISSION_ACK,
                ):
                    send(one.hear(arrival.message, arrival.number))
        found[name] = one.items
        if name == "mission" and (one.missing or len(one.items) < 2):
            raise InputError("--download", "the autopilot gives no mission of two items or more")
    return found


def as_plan(
    lists: dict[str, list[Message]], autopilot: int = 0, home: list[float] | None = None
) -> dict[str, Any]:
    """The lists as the tables of a QGroundControl plan, which clearway reads as a mission.

    autopilot: MAV_AUTOPILOT. home: latitude, longitude and height; the first item of a mission is
    home, but on PX4, which counts its items from 0.
    """
    px4 = autopilot == PX4
    items = lists["mission"] if px4 else lists["mission"][1:]
    return {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "clearway",
        "mission": {
            "version": 2,
            "firmwareType": autopilot,
            "vehicleType": 2,
            "plannedHomePosition": (home or NO_HOME) if px4 else _geodetic(lists["mission"][0]),
            "items": [_item(message, number, px4) for number, message in enumerate(items, 1)],
        },
        "geoFence": {"version": 2, **_fences(lists["fence"])},
        "rallyPoints": {"version": 2, "points": [_geodetic(one) for one in lists["rally"]]},
    }


def write_plan(
    lists: dict[str, list[Message]],
    path: Path,
    autopilot: int = 0,
    home: list[float] | None = None,
) -> None:
    """Write `as_plan`; raises InputError where the file cannot be written."""
    plan = as_plan(lists, autopilot, home)
    try:
        path.write_text(json.dumps(plan, indent=2, allow_nan=False) + "\n")
    except OSError as cause:
        raise InputError("--download", f"{path} cannot be written: {cause.strerror}") from cause


def _item(message: Message, number: int, px4: bool) -> dict[str, Any]:
    first = _finite(message.param1)
    if px4 and message.command == DO_JUMP and first is not None:
        first += 1
    others = map(_finite, (message.param2, message.param3, message.param4))
    there = _place(message) if message.frame in IN_PLACES else [message.x, message.y]
    return {
        "type": "SimpleItem",
        "command": int(message.command),
        "frame": {5: 0, 6: 3, 11: 10}.get(message.frame, int(message.frame)),
        "params": [first, *others, *there, _finite(message.z)],
        "autoContinue": bool(message.autocontinue),
        "doJumpId": number,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _place(message: Message) -> list[float | None]:
    """Latitude and longitude, degrees; None for what is not stated."""
    return [
        None if value in UNSTATED else round(value * DEGREES_E7, 7)
        for value in (message.x, message.y)
    ]


def _geodetic(message: Message) -> list[float]:
    return [*(value or 0.0 for value in _place(message)), _finite(message.z) or 0.0]


def _fences(items: list[Message]) -> dict[str, Any]:
    """Circles and polygons; of a polygon each corner comes as an item."""
    circles, polygons, corners = [], [], []
    for message in items:
        place = _geodetic(message)[:2]
        if message.command in (CIRCLE_INSIDE, CIRCLE_OUTSIDE):
            circle = {"center": place, "radius": float(message.param1)}
            inside = message.command == CIRCLE_INSIDE
            circles.append({"circle": circle, "inclusion": inside, "version": 1})
        elif message.command in (FENCE_INSIDE, FENCE_OUTSIDE):
            corners.append(place)
            if len(corners) >= message.param1:
                inside = message.command == FENCE_INSIDE
                polygons.append({"polygon": corners, "inclusion": inside, "version": 1})
                corners = []
    return {"circles": circles, "polygons": polygons}
