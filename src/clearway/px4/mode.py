"""A flight mode of PX4's external modes: how it is registered, configured, questioned and left.

Messages come by the `hear_` methods and go by `send`; times are of our monotonic clock.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.px4.releases import Release, format_hash
from clearway.ros2.messages import make_message

AGAIN_S: Final = 0.5
"""After so long without an answer PX4 is asked again."""
SILENT_S: Final = 4.0
"""PX4 asks every registered mode each 0.3 s; without a question for so long it has gone."""
SET_POINTS_LATE_MS: Final = 500
"""After so long without a set-point PX4 leaves the mode by its own failsafe, from 1.18 on."""
FIRST_MODE = 23
LAST_MODE = 30
"""NAVIGATION_STATE_EXTERNAL1 to 8."""
OFFBOARD = 14
HOLD_MODE = 4
"""NAVIGATION_STATE_OFFBOARD and AUTO_LOITER."""
ARMED = 2
"""VehicleStatus.ARMING_STATE_ARMED."""
SET_NAV_STATE = 100_001
TRAJECTORY = 4
FORMAT_PROTOCOL = 1
"""SetpointConfig.TYPE_TRAJECTORY; version of questions for formats."""
OPTIONAL = ("HomePosition",)
"""PX4 may be built without it."""
NEEDED = (
    "mode_req_angular_velocity", "mode_req_attitude", "mode_req_local_alt",
    "mode_req_local_position", "mode_req_prevent_arming",
)  # fmt: skip
"""What PX4 must have for the mode; and it is not armed in a mode that does not take off."""
CONTROLLED = ("position", "velocity", "altitude", "climb_rate", "acceleration", "attitude",
              "rates", "allocation")  # fmt: skip
OTHER_RELEASE = "state the release of PX4 as px4.release (1.16, 1.17 or 1.18), or update clearway"

Send = Callable[[str, Any], None]
"""(name of the message, message)"""


def chars_of(text: str, length: int) -> FloatArray:
    """[length] a text as PX4 has it in a message: ended by zeros."""
    return np.frombuffer(text.encode("ascii")[: length - 1].ljust(length, b"\0"), dtype=np.uint8)


def text_of(chars: Any) -> str:
    """The text of PX4's characters."""
    return bytes(np.asarray(chars, dtype=np.uint8)).split(b"\0")[0].decode("ascii", "replace")


class Px4Mode:
    """Ask `ask` often; `flaw` says why PX4 does not have the mode, "" once it has."""

    def __init__(
        self, release: Release, name: str, send: Send, *, replaces_offboard: bool = False
    ) -> None:
        self.release, self.name = release, name
        self.mode_id: int | None = None
        """Its NAVIGATION_STATE; None while PX4 has not given it one."""
        self.refusal: InputError | None = None
        """Why this PX4 cannot be flown at all."""
        self._send, self._replaces_offboard = send, replaces_offboard
        self._formats = dict(release.checked)
        self._request_id = secrets.randbits(63)
        self._arming_check_id = -1
        self._asked_s = self._questioned_s = -math.inf
        self._is_configured = False
        self._why = f"PX4 has not answered yet: is it of release {release.name}?"

    @property
    def flaw(self) -> str:
        """Why PX4 does not have the mode, or not any more."""
        if self.refusal is not None:
            return str(self.refusal)
        return "" if self._is_configured else self._why

    def is_forgotten(self, wall_s: float) -> bool:
        """Whether PX4 no longer asks for the mode that it has: it was restarted, or is gone."""
        return self._is_configured and wall_s - self._questioned_s > SILENT_S

    # --- out ------------------------------------------------------------------------------

    def ask(self, wall_s: float) -> None:
        """Send what PX4 has not answered yet."""
        if self.refusal is not None or self._is_configured or wall_s < self._asked_s + AGAIN_S:
            return
        self._asked_s = wall_s
        if self._formats:
            self._tell(
                "MessageFormatRequest", protocol_version=FORMAT_PROTOCOL,
                topic_name=chars_of(next(iter(self._formats)), 50),
            )  # fmt: skip
        elif self.mode_id is None:
            self._register()
        else:
            self.configure(applies=False)
            self._is_configured = not self.release.configures
            self._questioned_s = wall_s

    def configure(self, *, applies: bool) -> None:
        """State that the mode flies trajectories; applies: from now on, as it is active."""
        if self.mode_id is None:
            return
        if self.release.configures:
            self._tell(
                "SetpointConfig", type=TRAJECTORY, source_id=self.mode_id, should_apply=applies,
                timeout_ms=SET_POINTS_LATE_MS,
            )  # fmt: skip
            return
        flags = {f"flag_control_{what}_enabled": True for what in CONTROLLED}
        self._tell("VehicleControlMode", source_id=self.mode_id, **flags)

    def hold(self) -> None:
        """Tell PX4 to go to its Hold mode."""
        self._send("VehicleCommand", self.hold_message())

    def hold_message(self) -> Any:
        """VehicleCommand to go to Hold."""
        return self._make("VehicleCommand", command=SET_NAV_STATE, param1=float(HOLD_MODE))

    def complete(self) -> None:
        """Tell PX4 that the mode has done what it is for."""
        if self.mode_id is not None:
            self._tell("ModeCompleted", nav_state=self.mode_id)

    def unregister(self) -> None:
        """Leave PX4, which then holds if the mode was active."""
        if self.mode_id is not None:
            self._send("UnregisterExtComponent", self.unregister_message(self.mode_id))
        self.mode_id, self._is_configured = None, False
        self._why = "the mode has left PX4"

    def unregister_message(self, mode_id: int) -> Any:
        """UnregisterExtComponent of the mode that PX4 has by a number."""
        return self._make(
            "UnregisterExtComponent", name=chars_of(self.name, 25), mode_id=mode_id,
            arming_check_id=self._arming_check_id, mode_executor_id=-1,
        )  # fmt: skip

    def _register(self) -> None:
        offboard = {"enable_replace_internal_mode": True, "replace_internal_mode": OFFBOARD}
        self._tell(
            "RegisterExtComponentRequest", name=chars_of(self.name, 25),
            request_id=self._request_id, px4_ros2_api_version=self.release.api,
            register_arming_check=True, register_mode=True,
            **(offboard if self._replaces_offboard else {}),
        )  # fmt: skip

    def _tell(self, message: str, **fields: Any) -> None:
        self._send(message, self._make(message, **fields))

    def _make(self, message: str, **fields: Any) -> Any:
        # A time of 0: PX4 sets its own.
        return make_message(self.release.kind(message), **fields)

    # --- in -------------------------------------------------------------------------------

    def hear_format(self, reply: Any) -> None:
        """MessageFormatResponse."""
        topic = text_of(reply.topic_name)
        if next(iter(self._formats), None) != topic:
            return
        message = self._formats.pop(topic)
        self._asked_s = -math.inf
        if not reply.success and message not in OPTIONAL:
            self._refuse(f"has no {topic} of PX4 {self.release.name}: {OTHER_RELEASE}")
        elif reply.success and reply.message_hash != format_hash(self.release.kind(message)):
            self._refuse(f"{message} has other fields than in {self.release.name}: {OTHER_RELEASE}")

    def hear_registered(self, reply: Any) -> None:
        """RegisterExtComponentReply."""
        if reply.request_id != self._request_id or text_of(reply.name) != self.name:
            return
        if self.mode_id is not None:
            return
        if reply.px4_ros2_api_version != self.release.api:
            told = f"speaks version {reply.px4_ros2_api_version} of external modes"
            self.mode_id, self._arming_check_id = reply.mode_id, reply.arming_check_id
            if reply.success:
                self.unregister()
            self._refuse(f"{told}, not {self.release.api}: {OTHER_RELEASE}")
        elif not reply.success:
            self._why = (
                "PX4 refuses the mode: it takes none while armed (COM_MODE_ARM_CHK), and eight at "
                "most; disarm, or end another mode"
            )
        elif not FIRST_MODE <= reply.mode_id <= LAST_MODE:
            self._refuse(f"gave the mode the number {reply.mode_id}, which is none")
        else:
            self.mode_id, self._arming_check_id = reply.mode_id, reply.arming_check_id
            self._asked_s = -math.inf
            self._why = "PX4 has not taken the mode's set-points yet"

    def hear_configured(self, reply: Any) -> None:
        """SetpointConfigReply."""
        if reply.source_id != self.mode_id or reply.type != TRAJECTORY:
            return
        if reply.result:
            self._refuse(
                f"takes no trajectories with this vehicle (result {reply.result}): a multicopter, "
                "or a VTOL that hovers, does"
            )
        self._is_configured = True

    def hear_question(self, request: Any, wall_s: float, *, can_run: bool) -> None:
        """ArmingCheckRequest: whether the mode may be chosen, or flown on."""
        if self.mode_id is None:
            return
        self._questioned_s = wall_s
        answer = self.answer_message(request.request_id, can_run=can_run)
        self._send("ArmingCheckReply", answer)

    def answer_message(self, request_id: int, *, can_run: bool) -> Any:
        """ArmingCheckReply to the request of a number."""
        return self._make(
            "ArmingCheckReply", request_id=request_id, can_arm_and_run=can_run,
            registration_id=self._arming_check_id, **dict.fromkeys(NEEDED, True),
        )  # fmt: skip

    def _refuse(self, why: str) -> None:
        self.refusal = InputError("PX4", why)
