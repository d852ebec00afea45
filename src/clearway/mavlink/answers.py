"""What others ask of our component: who it is, what time it is, and to fly elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.version import __version__
from clearway.mavlink import dialect as known
from clearway.mavlink.dialect import OBSTACLE_AVOIDANCE, Message, dialect
from clearway.mavlink.own_state import DEGREES_E7
from clearway.mavlink.set_points import IGNORE_POSITION

# MAV_CMD.
REQUEST_MESSAGE = 512
REQUEST_CAPABILITIES = 520
DO_REPOSITION = 192
AUTOPILOT_VERSION = 148
HEARTBEAT = 0
# MAV_RESULT.
ACCEPTED = 0
DENIED = 2
UNSUPPORTED = 3
# MAV_FRAME.
ABOVE_HOME = (3, 6)
ABOVE_SEA = (0, 5)
FARTHEST_DEG = np.array([90.0, 180.0])
# MAV_PROTOCOL_CAPABILITY: MAVLink 2, COMMAND_INT.
MAVLINK_2 = 8192
COMMAND_INTS = 8

NewGoal = Callable[[FloatArray, bool], str | None]
"""(latitude, longitude, height; whether that is above home) -> why it is refused, or None."""
Pause = Callable[[], str | None]
"""To hold the present place -> why that is refused, or None."""


class Answers:
    """Answers what is addressed to us; `notes` tells what was asked of the observer."""

    def __init__(self, system: int, autopilot: int, new_goal: NewGoal, pause: Pause) -> None:
        self.notes: list[str] = []
        self._system, self._autopilot = system, autopilot
        self._new_goal, self._pause = new_goal, pause

    def to(self, message: Message, number: int, asker: tuple[int, int]) -> list[Message]:
        """What is sent back."""
        if number == known.TIMESYNC:
            return self._time(message)
        if self._is_for_autopilot(message, number):
            self._reposition(*_goal_of(message, number))
            return []  # The autopilot answers.
        if not self._is_ours(message):
            return []
        if number in (known.COMMAND_LONG, known.COMMAND_INT):
            return self._command(message, number, asker)
        place = np.array([message.lat_int * DEGREES_E7, message.lon_int * DEGREES_E7, message.alt])
        if message.type_mask & IGNORE_POSITION:
            self.notes.append("SET_POSITION_TARGET_GLOBAL_INT without a position: ignored")
        else:
            self._goal("SET_POSITION_TARGET_GLOBAL_INT", place, message.coordinate_frame)
        return []

    def _is_ours(self, message: Message) -> bool:
        system, component = message.target_system, message.target_component
        return system in (0, self._system) and component in (0, OBSTACLE_AVOIDANCE)

    def _is_for_autopilot(self, message: Message, number: int) -> bool:
        """Whether it sends the autopilot elsewhere, whom our next set-point would call back."""
        return (
            number in (known.COMMAND_LONG, known.COMMAND_INT)
            and int(message.command) == DO_REPOSITION
            and message.target_system == self._system
            and message.target_component == self._autopilot
        )

    def _reposition(self, place: FloatArray, frame: int) -> None:
        """A new goal; where it cannot be one, or is no place at all, the vehicle holds its own."""
        if self._goal("DO_REPOSITION to the autopilot", place, frame) == ACCEPTED:
            return
        why = self._pause()
        held = "pauses, and holds its place" if why is None else f"goes on, no pause: {why}"
        self.notes.append(f"DO_REPOSITION to the autopilot: {held}")

    def _command(self, message: Message, kind: int, asker: tuple[int, int]) -> list[Message]:
        number, wanted = int(message.command), message.param1
        said: list[Message] = []
        if number == DO_REPOSITION:
            result = self._goal("DO_REPOSITION", *_goal_of(message, kind))
        elif number == REQUEST_CAPABILITIES or (
            number == REQUEST_MESSAGE and wanted == AUTOPILOT_VERSION
        ):
            result, said = ACCEPTED, [version()]
        elif message.target_component == 0:
            return []  # The autopilot is asked too, and knows better.
        else:
            result = UNSUPPORTED
        ack = dialect().MAVLink_command_ack_message(number, result, 0, 0, *asker)
        return [ack, *said]

    def _goal(self, what: str, place: FloatArray, frame: int) -> int:
        on_earth = bool(np.all(np.abs(place[:2]) <= FARTHEST_DEG))  # False for NaN too
        if frame not in (*ABOVE_HOME, *ABOVE_SEA) or not (on_earth and np.isfinite(place[2])):
            why: str | None = "needs a place on Earth, its height above the home or the sea"
        else:
            why = self._new_goal(place, frame in ABOVE_HOME)
        self.notes.append(f"{what}: {'a new goal' if why is None else 'refused, ' + why}")
        return ACCEPTED if why is None else DENIED

    def _time(self, message: Message) -> list[Message]:
        """TIMESYNC: our clock beside theirs."""
        if message.tc1 != 0:
            return []
        return [dialect().MAVLink_timesync_message(time.monotonic_ns(), message.ts1)]


def _goal_of(message: Message, kind: int) -> tuple[FloatArray, int]:
    """Latitude, longitude and height of a DO_REPOSITION, and the frame of the height."""
    if kind == known.COMMAND_INT:
        place = np.array([message.x * DEGREES_E7, message.y * DEGREES_E7, message.z])
        return place, message.frame
    return np.array([message.param5, message.param6, message.param7]), ABOVE_SEA[0]


def version() -> Message:
    """AUTOPILOT_VERSION of our component."""
    parts = [int(part) if part.isdigit() else 0 for part in __version__.split(".")[:3]]
    number = sum(min(part, 255) << (24 - 8 * at) for at, part in enumerate(parts))
    return dialect().MAVLink_autopilot_version_message(
        MAVLINK_2 | COMMAND_INTS, number, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0
    )
