"""The messages that a session needs: asked for, and named where they do not come."""

from __future__ import annotations

import math
from dataclasses import dataclass

from clearway.mavlink import dialect as known
from clearway.mavlink.dialect import Message, dialect

CIRCLES = (known.OBSTACLE_DISTANCE, known.DISTANCE_SENSOR, known.OBSTACLE_DISTANCE_3D)
SET_MESSAGE_INTERVAL = 511
"""MAV_CMD."""
ASK_AGAIN_S = 5.0
SAY_AGAIN_S = 5.0
ANSWER_S = 0.3
"""An answer is waited for so long before the next question, since it names no message."""
REFUSED_AGAIN_S = 60.0
"""What was refused, and flight goes without, is asked for again so seldom: some autopilots tell the
pilot of every such question."""
SPARE = 3.0
"""A message is missing when it is late by so many of its periods, and a second."""
ALONE = "SET_MESSAGE_INTERVAL alone brings it"
"""Of messages that no stream of ArduPilot has."""
REFUSED = {2: "denied", 3: "unsupported", 4: "failed"}
"""MAV_RESULT of what will not come."""


@dataclass(frozen=True, slots=True)
class Stream:
    """A message that the autopilot can be asked for."""

    number: int
    name: str
    rate_hz: float
    parameters: str
    """By which ArduPilot sends it: SRn_ up to 4.6, MAVn_ from 4.7; "none": no stream has it."""
    needed: bool = True
    """Whether nothing goes without it."""


def streams_for(*, act: bool, pitches: bool, sensor: bool) -> tuple[Stream, ...]:
    """What a session needs, and what it can use."""
    found = [
        Stream(known.ATTITUDE, "ATTITUDE", 10.0, "EXTRA1"),
        Stream(known.LOCAL_POSITION_NED, "LOCAL_POSITION_NED", 10.0, "POSITION"),
        Stream(known.GLOBAL_POSITION_INT, "GLOBAL_POSITION_INT", 2.0, "POSITION", needed=False),
        Stream(known.GPS_GLOBAL_ORIGIN, "GPS_GLOBAL_ORIGIN", 0.2, "none", needed=False),
        Stream(known.EXTENDED_SYS_STATE, "EXTENDED_SYS_STATE", 2.0, "none", needed=act),
        Stream(known.HOME_POSITION, "HOME_POSITION", 0.5, "none", needed=act and pitches),
        # One aircraft at a time, each of the list in turn.
        Stream(known.ADSB_VEHICLE, "ADSB_VEHICLE", 25.0, "ADSB", needed=False),
        Stream(
            known.POSITION_TARGET_LOCAL_NED, "POSITION_TARGET_LOCAL_NED", 2.0, "none", needed=False
        ),
        Stream(known.EKF_STATUS_REPORT, "EKF_STATUS_REPORT", 1.0, "EXTRA3", needed=False),
    ]
    if sensor:
        found.append(
            Stream(known.OBSTACLE_DISTANCE, "OBSTACLE_DISTANCE", 10.0, "EXTRA3", needed=False)
        )
        found.append(Stream(known.DISTANCE_SENSOR, "DISTANCE_SENSOR", 10.0, "EXTRA3", needed=False))
        found.append(Stream(known.SYS_STATUS, "SYS_STATUS", 2.0, "EXT_STAT", needed=False))
    return tuple(found)


class Streams:
    """What comes of the messages that are needed, by our clock."""

    def __init__(self, wanted: tuple[Stream, ...], *, asks: bool) -> None:
        self._wanted, self._asks = wanted, asks
        self._heard_s: dict[int, float] = {}
        self._asked_s: dict[int, float] = {}
        self._refused: dict[int, str] = {}
        self._open: tuple[int, float] | None = None  # What was asked last, and when.
        self._said_s = -math.inf
        self._before: tuple[str, ...] = ()

    def hear(self, number: int, wall_s: float) -> None:
        self._heard_s[number] = wall_s

    def hear_answer(self, message: Message) -> None:
        """COMMAND_ACK of what was asked last; which message it is about it does not tell.

        Of other commands, and to others than us, it is none of ours.
        """
        ours = message.target_component in (0, known.OBSTACLE_AVOIDANCE)
        if self._open is None or message.command != SET_MESSAGE_INTERVAL or not ours:
            return
        number, self._open = self._open[0], None
        self._refused.pop(number, None)
        if message.result in REFUSED:
            self._refused[number] = REFUSED[message.result]

    def missing(self, wall_s: float) -> list[Stream]:
        """What does not come, or too seldom."""
        return [
            each
            for each in self._wanted
            if wall_s - self._heard_s.get(each.number, -math.inf) > SPARE / each.rate_hz + 1.0
        ]

    def to_ask(self, wall_s: float, system: int, component: int) -> list[Message]:
        """One SET_MESSAGE_INTERVAL at a time, for what is missing and was not asked for lately."""
        waits = self._open is not None and wall_s - self._open[1] < ANSWER_S
        if not self._asks or waits:
            return []
        for each in self.missing(wall_s):
            refused = each.number in self._refused and not each.needed
            again_s = REFUSED_AGAIN_S if refused else ASK_AGAIN_S
            if wall_s - self._asked_s.get(each.number, -math.inf) >= again_s:
                self._asked_s[each.number], self._open = wall_s, (each.number, wall_s)
                return [
                    dialect().MAVLink_command_long_message(
                        system,
                        component,
                        SET_MESSAGE_INTERVAL,
                        0,
                        float(each.number),
                        1e6 / each.rate_hz,
                        *[0.0] * 5,
                    )
                ]
        return []

    def find_needed(self, wall_s: float, *, sensor: bool) -> tuple[str, ...]:
        """Names of what is missing and without which nothing goes."""
        names = tuple(each.name for each in self.missing(wall_s) if each.needed)
        if sensor and not any(wall_s - self._heard_s.get(n, -math.inf) < 3.0 for n in CIRCLES):
            names += ("distances (OBSTACLE_DISTANCE, DISTANCE_SENSOR or OBSTACLE_DISTANCE_3D)",)
        return names

    def notes(self, wall_s: float, *, sensor: bool, waiting: bool) -> list[str]:
        """What is heard and what is missing, every few seconds while something needed is."""
        missing, names = self.missing(wall_s), self.find_needed(wall_s, sensor=sensor)
        due = wall_s - self._said_s >= SAY_AGAIN_S
        if not names or not (due and (waiting or names != self._before)):
            return []
        self._said_s, self._before = wall_s, names
        gone = {each.number for each in missing}
        heard = [each.name for each in self._wanted if each.number not in gone]
        return [f"hears {', '.join(heard) or 'none of what it needs'}; missing: {self.how(names)}"]

    def how(self, names: tuple[str, ...]) -> str:
        """Names with what was done about them, and what sends them."""
        said = []
        for name in names:
            stream = next((each for each in self._wanted if each.name == name), None)
            if stream is None:
                said.append(name)
                continue
            way = ALONE if stream.parameters == "none" else (
                f"SRn_{stream.parameters}, or MAVn_{stream.parameters} from ArduPilot 4.7"
            )  # fmt: skip
            asked = self._refused.get(stream.number) or ("asked for" if self._asks else "")
            why = "; ".join(part for part in (asked, way) if part)
            said.append(f"{name} ({why})" if why else name)
        return ", ".join(said)
