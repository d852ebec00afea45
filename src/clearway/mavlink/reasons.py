"""Why: COLLISION for aircraft that come close, STATUSTEXT for changes of what is being done."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from clearway.base.brief import runs
from clearway.live import FlightDecision
from clearway.live.link.approach import PredictedApproach
from clearway.live.mission import Mode
from clearway.mavlink.dialect import Message, dialect

FROM_ADSB = 0
"""MAV_COLLISION_SRC_ADSB."""
ACTIONS = {"report": 1, "ascend or descend": 2, "move horizontally": 3}
"""MAV_COLLISION_ACTION."""
THREATS = {"low": 1, "high": 2}
"""MAV_COLLISION_THREAT_LEVEL."""
SEVERITY = {
    Mode.EMERGENCY: 2,
    Mode.ESCAPE: 4,
    Mode.HOLD: 4,
    Mode.NARROW: 4,
    Mode.AVOIDANCE: 5,
    Mode.NAVIGATION: 6,
    Mode.LANDING: 6,
}
"""MAV_SEVERITY: critical, warning, notice, info."""
WARNING = 4
REPEAT_S = 1.0
"""An aircraft is not told of again within this time."""
MODE_S = 5.0
"""Nor is the mode, but that an emergency begins."""
PIECE = 50
"""Bytes of text in a message."""
MOST_PIECES = 2
"""Messages that a text may take."""


def collision_message(approach: PredictedApproach) -> Message:
    return dialect().MAVLink_collision_message(
        FROM_ADSB,
        approach.address,
        ACTIONS[approach.action],
        THREATS[approach.threat],
        approach.time_s,
        approach.vertical_m,
        approach.horizontal_m,
    )


@dataclass(slots=True)
class Sayings:
    """What has been said, so that nothing is said over and over."""

    _mode: Mode | None = None
    _mode_s: float = -math.inf
    _said_s: dict[int, float] = field(default_factory=dict)
    _texts: int = 0
    _alarms: frozenset[str] = frozenset()

    def of_decision(
        self, flight: FlightDecision, close: Iterable[PredictedApproach]
    ) -> list[Message]:
        """COLLISION of every aircraft once a second, STATUSTEXT of a change of mode and of what is
        wrong with the flight, once for as long as it lasts."""
        now = flight.time_s
        messages = [collision_message(a) for a in close if self._is_new(a.address, now)]
        lately = now - self._mode_s < MODE_S
        emergency = flight.mode is Mode.EMERGENCY
        changed = flight.mode is not self._mode
        if (changed or not lately) if emergency else (changed and not lately):
            self._mode, self._mode_s = flight.mode, now
            words = f"{flight.mode}: {runs(flight.movements)}"
            choice = flight.decision.choice
            if math.isfinite(choice.clearance_m):
                words += f"; {choice.clearance_m:.1f} of {flight.decision.margin_m:.1f} m clear"
            messages += self.text(words, SEVERITY[flight.mode])
        for alarm in flight.alarms:
            if alarm.kind not in self._alarms:
                messages += self.text(f"ALARM: {alarm.why}")
        self._alarms = frozenset(alarm.kind for alarm in flight.alarms)
        return messages

    def text(self, words: str, severity: int = WARNING) -> list[Message]:
        """A sentence as STATUSTEXT, in pieces where it is long."""
        data = f"clearway: {words}".encode("ascii", "replace")[: PIECE * MOST_PIECES]
        pieces = [data[at : at + PIECE] for at in range(0, len(data), PIECE)]
        self._texts = self._texts % 65_535 + 1
        number = self._texts if len(pieces) > 1 else 0
        make = dialect().MAVLink_statustext_message
        return [make(severity, piece, number, at) for at, piece in enumerate(pieces)]

    def _is_new(self, key: int, time_s: float) -> bool:
        if time_s - self._said_s.get(key, -math.inf) < REPEAT_S:
            return False
        self._said_s = {k: t for k, t in self._said_s.items() if time_s - t < REPEAT_S}
        self._said_s[key] = time_s
        return True
