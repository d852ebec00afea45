"""Why: COLLISION for aircraft that come close, STATUSTEXT for changes of what is being done."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from clearway.avoidance.hazards import Cause
from clearway.live import FlightDecision
from clearway.live.mission import Mode
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.own_state import OwnMotion
from clearway.traffic import Intruder

FROM_ADSB = 0
"""MAV_COLLISION_SRC_ADSB."""
REPORT, ASCEND_OR_DESCEND, MOVE_HORIZONTALLY = 1, 2, 3
"""MAV_COLLISION_ACTION."""
LOW, HIGH = 1, 2
"""MAV_COLLISION_THREAT_LEVEL."""
SEVERITY = {
    Mode.EMERGENCY: 2,
    Mode.ESCAPE: 4,
    Mode.AVOIDANCE: 5,
    Mode.NAVIGATION: 6,
    Mode.LANDING: 6,
}
"""MAV_SEVERITY: critical, notice, info."""
WARNING = 4
REPEAT_S = 1.0
"""The same is not said again within this time."""
WORRY = 3.0
"""Margins at the closest approach within which an aircraft is told of."""
PIECE, MOST_PIECES = 50, 4
"""Bytes of text in a message, and messages that a text may take."""


@dataclass(frozen=True, slots=True)
class PredictedApproach:
    """The closest approach of an aircraft if both fly straight on."""

    address: int
    time_s: float
    """From now."""
    vertical_m: float
    horizontal_m: float
    threat: int
    action: int

    def message(self) -> Message:
        return dialect().MAVLink_collision_message(
            FROM_ADSB,
            self.address,
            self.action,
            self.threat,
            self.time_s,
            self.vertical_m,
            self.horizontal_m,
        )

    def row(self) -> dict[str, object]:
        """For the log."""
        return {
            "aircraft": f"{self.address:06x}",
            "in_s": round(self.time_s, 2),
            "vertical_m": round(self.vertical_m, 2),
            "horizontal_m": round(self.horizontal_m, 2),
            "threat": {LOW: "low", HIGH: "high"}[self.threat],
            "action": {REPORT: "report", ASCEND_OR_DESCEND: "ascend or descend",
                       MOVE_HORIZONTALLY: "move horizontally"}[self.action],
        }  # fmt: skip


def approaches(
    flight: FlightDecision, own: OwnMotion, intruders: Iterable[Intruder]
) -> list[PredictedApproach]:
    """Aircraft that come within WORRY margins, or that the decision avoids; nearest first."""
    avoided = _avoided(flight)
    margin = flight.decision.margin_m
    told = []
    for intruder in intruders:
        time_s, vertical, horizontal = _closest(own, intruder.at(flight.time_s))
        apart = math.hypot(vertical, horizontal)
        kept = margin + intruder.radius_m
        is_avoided = intruder.name in avoided
        if is_avoided or apart < WORRY * kept:
            threat = HIGH if is_avoided or apart < kept else LOW
            action = _action(flight) if is_avoided else REPORT
            address = int(intruder.address, 16)
            told.append(PredictedApproach(address, time_s, vertical, horizontal, threat, action))
    return sorted(told, key=lambda approach: approach.time_s)


def _avoided(flight: FlightDecision) -> set[str]:
    """Intruders that ruled out cheaper candidates, or limit the chosen one."""
    decision = flight.decision
    choice = decision.choice
    indices = {out.index for out in choice.ruled_out if out.cause is Cause.INTRUDER}
    if choice.limited_by is Cause.INTRUDER and choice.ruled_out_by:
        indices.add(choice.limiting_index)
    return {decision.intruders[index] for index in indices}


def _action(flight: FlightDecision) -> int:
    turns = [name for name in flight.movements if name != "Straight"]
    if turns and turns[0] in ("Up", "Down"):
        return ASCEND_OR_DESCEND
    return MOVE_HORIZONTALLY


def _closest(own: OwnMotion, intruder: Intruder) -> tuple[float, float, float]:
    """Time from now, and vertical and horizontal distance at the closest approach."""
    apart = intruder.position_m - own.position_m
    closing = intruder.velocity_mps - own.velocity_mps
    squared = float(closing @ closing)
    time_s = max(0.0, -float(apart @ closing) / squared) if squared > 1e-9 else 0.0
    there = apart + time_s * closing
    return time_s, abs(float(there[2])), float(np.hypot(there[0], there[1]))


@dataclass(slots=True)
class Sayings:
    """What has been said, so that nothing is said over and over."""

    _mode: Mode | None = None
    _said_s: dict[object, float] = field(default_factory=dict)
    _texts: int = 0

    def of_decision(
        self, flight: FlightDecision, close: Iterable[PredictedApproach]
    ) -> list[Message]:
        """COLLISION of every aircraft once a second, STATUSTEXT of a change of mode."""
        messages = [
            approach.message()
            for approach in close
            if self._is_new(approach.address, flight.time_s)
        ]
        worth = flight.mode is not self._mode or flight.mode is Mode.EMERGENCY
        if worth and self._is_new("mode", flight.time_s):
            self._mode = flight.mode
            messages += self.text(flight.explanation, SEVERITY[flight.mode])
        return messages

    def text(self, words: str, severity: int = WARNING) -> list[Message]:
        """A sentence as STATUSTEXT, in pieces where it is long."""
        data = f"clearway: {words}".encode("ascii", "replace")[: PIECE * MOST_PIECES]
        pieces = [data[at : at + PIECE] for at in range(0, len(data), PIECE)]
        self._texts = self._texts % 65_535 + 1
        number = self._texts if len(pieces) > 1 else 0
        make = dialect().MAVLink_statustext_message
        return [make(severity, piece, number, at) for at, piece in enumerate(pieces)]

    def _is_new(self, key: object, time_s: float) -> bool:
        if time_s - self._said_s.get(key, -math.inf) < REPEAT_S:
            return False
        self._said_s = {k: t for k, t in self._said_s.items() if time_s - t < REPEAT_S}
        self._said_s[key] = time_s
        return True
