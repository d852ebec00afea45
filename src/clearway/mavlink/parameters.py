"""Parameters of the autopilot that matter to its leader, checked against the mission."""

from __future__ import annotations

import math

from clearway.mavlink.dialect import Message, dialect

TIMEOUTS = ("GUID_TIMEOUT", "COM_OF_LOSS_T")
"""How long set-points are flown after the last, in seconds: ArduCopter's, PX4's."""
SPEEDS = {"WPNAV_SPEED": 0.01, "WP_SPD": 1.0, "MPC_XY_VEL_MAX": 1.0}
"""Largest level speed, and its unit in m/s: ArduCopter's to 4.6 and from 4.7, PX4's."""
ACCELERATIONS = {"WPNAV_ACCEL": 0.01, "WP_ACC": 1.0}
"""Largest level acceleration in GUIDED, and its unit in m/s2: ArduCopter's to 4.6 and from 4.7."""
JERKS = ("PSC_JERK_XY", "PSC_JERK_NE", "PSC_NE_JERK")
"""By how much acceleration may change, in m/s3: ArduCopter's to 4.6, of 4.7, and later."""
SLOWEST_S = 0.4
"""The longest that the mission's acceleration may take to come about: 2 m/s2 of a copter as it
comes."""
QUICK_MPS3 = 20.0
"""The greatest jerk that ArduCopter allows."""
OTHERS = {
    "AVOID_ENABLE": "ArduPilot's own avoidance may stop the vehicle on its way (AVOID_*)",
    "AVD_ENABLE": "ArduPilot's own ADS-B avoidance may take the vehicle over (AVD_*)",
    "CP_DIST": "PX4's collision prevention holds the vehicle off in manual flight (CP_*)",
}
"""That act beside us, where they are above 0."""
HARMLESS = {"AVOID_ENABLE": 1}
"""Bits of them that do not count: fences alone are kept."""
ROUNDED_MPS2 = 1e-3
"""Accelerations that differ by less are the same."""
LONGEST_TAKEN_S = 60.0
"""What takes longer was never reported."""
LONGEST_TIMEOUT_S = 1.0
ASKED = (*TIMEOUTS, *SPEEDS, *ACCELERATIONS, *JERKS, *OTHERS)
ASK_AGAIN_S = 2.0
"""Between two requests for a parameter."""
MOST_ASKED = 3
"""An autopilot that does not know a parameter says nothing: each is asked for a few times."""


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

    def news(self, speed_mps: float, acceleration_mps2: float | None = None) -> list[str]:
        """What has not been said of them."""
        found = self.findings(speed_mps, acceleration_mps2)
        said = [words for words in found if words not in self._told]
        self._told.update(said)
        return said

    def findings(self, speed_mps: float, acceleration_mps2: float | None = None) -> list[str]:
        """What does not go with a mission at a speed.

        acceleration_mps2: that the plan asks of a vehicle with inertia; None of others.
        """
        found = [*self._ends_late(speed_mps), *self._too_slow(speed_mps)]
        if acceleration_mps2 is not None:
            found += self._too_lame(acceleration_mps2)
        found += [
            f"{name} is {self.values[name]:g}: {words}"
            for name, words in OTHERS.items()
            if _acts(name, self.values.get(name, 0.0))
        ]
        return found

    def _ends_late(self, speed_mps: float) -> list[str]:
        """Set-points that are flown on for too long."""
        return [
            f"{name} is {self.values[name]:g} s: if this program dies, the vehicle flies on for "
            f"{self.values[name] * speed_mps:.1f} m at {speed_mps:g} m/s; set it to 1 s or less"
            for name in TIMEOUTS
            if self.values.get(name, 0.0) > LONGEST_TIMEOUT_S
        ]

    def _too_slow(self, speed_mps: float) -> list[str]:
        """Speeds below that of the mission."""
        return [
            f"{name} allows {self.values[name] * unit:g} m/s, the mission asks for {speed_mps:g} "
            "m/s: the vehicle cannot follow"
            for name, unit in SPEEDS.items()
            if 0.0 < self.values.get(name, 0.0) * unit < speed_mps
        ]

    def _too_lame(self, acceleration_mps2: float) -> list[str]:
        """Accelerations that are too small, or come about too late, for the plan to be kept to."""
        found = [
            f"{name} allows {self.values[name] * unit:g} m/s2, the mission asks for "
            f"{acceleration_mps2:.3g}: the vehicle leaves its plan, and the margin grows; raise "
            "it, or lower vehicle.acceleration_mps2"
            for name, unit in ACCELERATIONS.items()
            if 0.0 < self.values.get(name, 0.0) * unit < acceleration_mps2 - ROUNDED_MPS2
        ]
        for name in JERKS:
            takes_s = acceleration_mps2 / max(self.values.get(name, 0.0), 1e-9)
            if SLOWEST_S + 1e-9 < takes_s < LONGEST_TAKEN_S:
                found.append(
                    f"{name} is {self.values[name]:g} m/s3: {acceleration_mps2:.3g} m/s2 take "
                    f"{takes_s:.1f} s to come about, and the vehicle leaves its plan; set it to "
                    f"{QUICK_MPS3:g} together with an acceleration twice as large, or lower "
                    "vehicle.acceleration_mps2"
                )
        return found


def _acts(name: str, value: float) -> bool:
    """Whether a setting of `OTHERS` makes the autopilot act beside us."""
    bits = HARMLESS.get(name, 0)
    return value > 0.0 and not (bits and int(value) & ~bits == 0)
