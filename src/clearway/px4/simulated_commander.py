"""What of PX4 decides on modes, simulated: registrations, arming checks, switching, failsafes.

Rates and limits are PX4's. A failsafe always ends in Hold here, where PX4 has more to choose from.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from clearway.px4.mode import FIRST_MODE, HOLD_MODE, OFFBOARD, SET_NAV_STATE, TRAJECTORY, text_of
from clearway.px4.releases import Release, format_hash
from clearway.ros2.messages import make_message

QUESTION_S: Final = 0.3
"""Between two arming checks."""
ANSWER_S: Final = 0.05
"""An answer that takes longer counts as none, until it comes."""
MOST_UNANSWERED = 3
MOST_UNANSWERED_FIRST = 10
MOST_MODES: Final = 8
DISARMED = 1
ARMED = 2
TAKE_OFF: Final = 17
STATUS_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class Px4Habits:
    """What a PX4 may do to a flight mode; nothing of it by default."""

    api: int | None = None
    """Version of external modes that it speaks, in place of its release's."""
    other_fields: tuple[str, ...] = ()
    """Messages whose fields differ from those of its release."""
    takes_while_armed: bool = False
    """Modes are registered while armed: COM_MODE_ARM_CHK."""
    starts_armed: bool = False
    takes_trajectories: bool = True
    """False as of a plane."""
    refuses_hold: bool = False
    """It does not go to Hold when it is commanded to."""
    odometry_ends_s: float = math.inf
    resets_s: float = math.inf
    """When its estimator moves its position by a metre."""
    dies_s: float = math.inf
    """From then on it says nothing at all."""
    restarts_s: float = math.inf
    """When it forgets all modes."""


@dataclass(slots=True)
class Registered:
    """A mode that somebody has registered, and how it answers."""

    name: str
    mode_id: int
    replaces: int = -1
    answer: Any = None
    unanswered: int = 0
    is_unresponsive: bool = False


@dataclass(slots=True)
class Commander:
    """Feed it with `hear`, step it with `update`; it sends by `send`."""

    release: Release
    send: Callable[[str, Any], None]
    habits: Px4Habits = field(default_factory=Px4Habits)
    modes: dict[int, Registered] = field(default_factory=dict)
    """By arming check id."""
    nav_state: int = HOLD_MODE
    is_armed: bool = False
    is_in_failsafe: bool = False
    position_is_valid: bool = True
    landed: bool = True
    completed: int = 0
    """How often a mode has told that it is done."""
    timeout_s: float = math.inf
    set_point_s: float = -math.inf
    _question: int = 0
    _questioned_s: float = -math.inf
    _answered: set[int] = field(default_factory=set)
    _is_counted: bool = True
    _told: tuple[object, ...] = ()
    _told_s: float = -math.inf

    # --- what a pilot does ----------------------------------------------------------------

    def can_fly(self, nav_state: int) -> bool:
        """Whether a mode may be chosen."""
        found = self._mode(nav_state)
        if found is None:
            return nav_state < FIRST_MODE
        good = found.answer is not None and not found.is_unresponsive
        return good and bool(found.answer.can_arm_and_run) and self.position_is_valid

    def choose(self, nav_state: int) -> bool:
        """Choose a mode; whether PX4 goes there."""
        if nav_state == OFFBOARD:
            nav_state = next((m.mode_id for m in self.modes.values() if m.replaces == OFFBOARD), 14)
        if not self.can_fly(nav_state):
            return False
        if nav_state != self.nav_state:
            self.nav_state, self.is_in_failsafe = nav_state, False
            self.timeout_s, self.set_point_s = math.inf, -math.inf
        return True

    def arm(self) -> bool:
        """Arm, where the chosen mode allows it."""
        found = self._mode(self.nav_state)
        prevented = found is not None and found.answer.mode_req_prevent_arming
        self.is_armed = self.can_fly(self.nav_state) and not prevented
        return self.is_armed

    def mode_named(self, name: str) -> int | None:
        """The number of a mode that somebody has registered."""
        return next((m.mode_id for m in self.modes.values() if m.name == name), None)

    # --- what goes on ---------------------------------------------------------------------

    def update(self, now_s: float) -> None:
        """Ask, count answers, fail over, and tell the status when it is due."""
        self._count_answers(now_s)
        if now_s >= self._questioned_s + QUESTION_S and self.modes:
            self._ask(now_s)
        found = self._mode(self.nav_state)
        if self.nav_state >= FIRST_MODE and self.is_armed:
            late = now_s > self.set_point_s + self.timeout_s
            if late or found is None or not self.can_fly(self.nav_state):
                self.nav_state, self.is_in_failsafe = HOLD_MODE, True
        told = (self.nav_state, self.is_armed, self.is_in_failsafe, len(self.modes))
        if told != self._told or now_s >= self._told_s + STATUS_S:
            self._told, self._told_s = told, now_s
            self._tell(
                "VehicleStatus", now_s, nav_state=self.nav_state, failsafe=self.is_in_failsafe,
                arming_state=ARMED if self.is_armed else DISARMED, vehicle_type=1,
                nav_state_user_intention=self.nav_state,
            )  # fmt: skip
            self._tell("VehicleLandDetected", now_s, landed=self.landed)

    def _ask(self, now_s: float) -> None:
        self._question = (self._question + 1) % 256
        self._questioned_s, self._is_counted = now_s, False
        self._answered.clear()
        mask = sum(1 << number for number, m in self.modes.items() if not m.is_unresponsive)
        masked = {"valid_registrations_mask": mask}
        is_newer = self.release.versions.get("ArmingCheckRequest", 0) > 0
        self._tell(
            "ArmingCheckRequest", now_s, request_id=self._question, **(masked if is_newer else {})
        )

    def _count_answers(self, now_s: float) -> None:
        if self._is_counted or now_s <= self._questioned_s + ANSWER_S:
            return
        self._is_counted = True
        for number, mode in list(self.modes.items()):
            if number in self._answered:
                continue
            mode.unanswered += 1
            most = MOST_UNANSWERED if mode.answer is not None else MOST_UNANSWERED_FIRST
            mode.is_unresponsive = mode.unanswered > most
            if mode.is_unresponsive and self.nav_state != mode.mode_id:
                del self.modes[number]

    def hear(self, message: str, told: Any, now_s: float) -> None:
        """A message that came to PX4, by its name."""
        takers: dict[str, Callable[[Any, float], None]] = {
            "MessageFormatRequest": self._take_format,
            "RegisterExtComponentRequest": self._take_registration,
            "UnregisterExtComponent": self._take_unregistration,
            "ArmingCheckReply": self._take_answer,
            "SetpointConfig": self._take_config,
            "VehicleCommand": self._take_command,
            "ModeCompleted": self._take_completed,
        }
        if message in takers:
            takers[message](told, now_s)

    def _take_format(self, request: Any, now_s: float) -> None:
        message = self.release.checked.get(text_of(request.topic_name))
        value = 0 if message is None else format_hash(self.release.kind(message))
        changed = message in self.habits.other_fields
        self._tell(
            "MessageFormatResponse", now_s, protocol_version=1, topic_name=request.topic_name,
            success=message is not None, message_hash=value ^ 1 if changed else value,
        )  # fmt: skip

    def _take_registration(self, request: Any, now_s: float) -> None:
        free = sorted(set(range(MOST_MODES)) - set(self.modes))
        good = bool(free) and (not self.is_armed or self.habits.takes_while_armed)
        number, mode_id = -1, -1
        if good:
            taken = {mode.mode_id for mode in self.modes.values()}
            number = free[0]
            mode_id = next(n for n in range(FIRST_MODE, 31) if n not in taken)
            replaces = request.replace_internal_mode if request.enable_replace_internal_mode else -1
            self.modes[number] = Registered(text_of(request.name), mode_id, int(replaces))
        self._tell(
            "RegisterExtComponentReply", now_s, request_id=request.request_id, name=request.name,
            px4_ros2_api_version=self.habits.api or self.release.api, success=good,
            arming_check_id=number, mode_id=mode_id, mode_executor_id=-1,
        )  # fmt: skip

    def _take_unregistration(self, request: Any, _now_s: float) -> None:
        mode = self.modes.get(int(request.arming_check_id))
        if mode is None or mode.name != text_of(request.name):
            return
        del self.modes[int(request.arming_check_id)]
        if self.nav_state == mode.mode_id:
            self.nav_state = HOLD_MODE

    def _take_answer(self, reply: Any, _now_s: float) -> None:
        mode = self.modes.get(int(reply.registration_id))
        if mode is not None and reply.request_id == self._question:
            mode.answer, mode.unanswered, mode.is_unresponsive = reply, 0, False
            self._answered.add(int(reply.registration_id))

    def _take_config(self, config: Any, now_s: float) -> None:
        good = config.type == TRAJECTORY and self.habits.takes_trajectories
        if good and config.should_apply and config.source_id == self.nav_state:
            self.timeout_s, self.set_point_s = 1e-3 * config.timeout_ms or math.inf, now_s
        self._tell(
            "SetpointConfigReply", now_s, type=config.type, source_id=config.source_id,
            result=0 if good else 2,
        )  # fmt: skip

    def _take_command(self, command: Any, _now_s: float) -> None:
        if command.command == SET_NAV_STATE and not self.habits.refuses_hold:
            self.choose(round(command.param1))

    def _take_completed(self, message: Any, _now_s: float) -> None:
        self.completed += message.nav_state == self.nav_state

    def _mode(self, nav_state: int) -> Registered | None:
        return next((m for m in self.modes.values() if m.mode_id == nav_state), None)

    def _tell(self, message: str, now_s: float, **fields: Any) -> None:
        kind = self.release.kind(message)
        self.send(message, make_message(kind, timestamp=round(1e6 * now_s), **fields))
