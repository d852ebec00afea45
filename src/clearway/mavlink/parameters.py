"""Parameters of the autopilot that matter to whoever leads it, held against the mission."""

from __future__ import annotations

import math

from clearway.mavlink.dialect import Message, dialect

TIMEOUTS = ("GUID_TIMEOUT", "COM_OF_LOSS_T")
"""How long set-points are flown after the last, in seconds: ArduCopter's, PX4's."""
SPEEDS = {"WPNAV_SPEED": 0.01, "WP_SPD": 1.0, "MPC_XY_VEL_MAX": 1.0}
"""Largest level speed, and its unit in m/s: ArduCopter's to 4.6 and from 4.7, PX4's."""
OTHERS = {
    "AVOID_ENABLE": "ArduPilot's own avoidance may stop the vehicle on its way (AVOID_*)",
    "AVD_ENABLE": "ArduPilot's own ADS-B avoidance may take the vehicle over (AVD_*)",
    "CP_DIST": "PX4's collision prevention holds the vehicle off in manual flight (CP_*)",
}
"""That act beside us, where they are above 0."""
HARMLESS = {"AVOID_ENABLE": 1}
"""Bits of them that do not count: fences alone are kept."""
LONGEST_TIMEOUT_S = 1.0
ASKED = (*TIMEOUTS, *SPEEDS, *OTHERS)
ASK_AGAIN_S, MOST_ASKED = 2.0, 3
"""Who does not know a parameter says nothing: each is asked for a few times."""


class Parameters:
    """What is asked, and what came back."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self._asked: dict[str, int] = {}
        self._next_s = -math.inf
        self._told: set[str] = set()

    def to_ask(self, wall_s: float, system: int, component: int) -> list[Message]:
        """PARAM_REQUEST_READ of what has not come."""
        if wall_s < self._next_s:
            return []
        self._next_s = wall_s + ASK_AGAIN_S
        open_ones = [
            name
            for name in ASKED
            if name not in self.values and self._asked.get(name, 0) < MOST_ASKED
        ]
        for name in open_ones:
            self._asked[name] = self._asked.get(name, 0) + 1
        make = dialect().MAVLink_param_request_read_message
        return [make(system, component, name.encode(), -1) for name in open_ones]

    def hear(self, message: Message) -> None:
        """PARAM_VALUE."""
        name = str(message.param_id).rstrip("\x00")
        if name in ASKED and math.isfinite(message.param_value):
            self.values[name] = float(message.param_value)

    def news(self, speed_mps: float) -> list[str]:
        """What has not been said of them."""
        said = [words for words in self.findings(speed_mps) if words not in self._told]
        self._told.update(said)
        return said

    def findings(self, speed_mps: float) -> list[str]:
        """What does not go with a mission at a speed."""
        found = []
        for name in TIMEOUTS:
            timeout = self.values.get(name)
            if timeout is not None and timeout > LONGEST_TIMEOUT_S:
                found.append(
                    f"{name} is {timeout:g} s: if this program dies, the vehicle flies on for "
                    f"{timeout * speed_mps:.1f} m at {speed_mps:g} m/s; set it to 1 s or less"
                )
        for name, unit in SPEEDS.items():
            value = self.values.get(name)
            if value is not None and 0.0 < value * unit < speed_mps:
                found.append(
                    f"{name} allows {value * unit:g} m/s, the mission asks for {speed_mps:g} m/s: "
                    "the vehicle cannot follow"
                )
        found += [
            f"{name} is {self.values[name]:g}: {words}"
            for name, words in OTHERS.items()
            if _acts(name, self.values.get(name, 0.0))
        ]
        return found


def _acts(name: str, value: float) -> bool:
    """Whether a setting of `OTHERS` makes the autopilot act beside us."""
    bits = HARMLESS.get(name, 0)
    return value > 0.0 and not (bits and int(value) & ~bits == 0)
