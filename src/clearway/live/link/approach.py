"""Aircraft that come close, or that a decision avoids: what is told of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from clearway.avoidance.clear.hazards import Cause
from clearway.live.link.own_motion import OwnMotion
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.traffic import Intruder

WORRY = 3.0
"""Margins at the closest approach within which an aircraft is told of."""


@dataclass(frozen=True, slots=True)
class PredictedApproach:
    """The closest approach of an aircraft if both fly straight on."""

    address: int
    time_s: float
    """From now."""
    vertical_m: float
    horizontal_m: float
    threat: str
    """high, low"""
    action: str
    """report, ascend or descend, move horizontally"""

    def row(self) -> dict[str, object]:
        """For the log."""
        return {
            "aircraft": f"{self.address:06x}",
            "in_s": round(self.time_s, 2),
            "vertical_m": round(self.vertical_m, 2),
            "horizontal_m": round(self.horizontal_m, 2),
            "threat": self.threat,
            "action": self.action,
        }


def predict_approaches(
    flight: FlightDecision, own: OwnMotion, intruders: Iterable[Intruder]
) -> list[PredictedApproach]:
    """Aircraft that come within WORRY margins, or that the decision avoids; nearest first."""
    avoided = _find_avoided(flight)
    margin = flight.decision.margin_m
    told = []
    for intruder in intruders:
        time_s, vertical, horizontal = _closest(own, intruder.at(flight.time_s))
        apart = math.hypot(vertical, horizontal)
        kept = margin + intruder.radius_m
        is_avoided = intruder.name in avoided
        if is_avoided or apart < WORRY * kept:
            threat = "high" if is_avoided or apart < kept else "low"
            action = _action(flight) if is_avoided else "report"
            address = int(intruder.address, 16)
            told.append(PredictedApproach(address, time_s, vertical, horizontal, threat, action))
    return sorted(told, key=lambda approach: approach.time_s)


def _find_avoided(flight: FlightDecision) -> set[str]:
    """Intruders that ruled out cheaper candidates, or limit the chosen one."""
    decision = flight.decision
    choice = decision.choice
    indices = {out.index for out in choice.ruled_out if out.cause is Cause.INTRUDER}
    if choice.limited_by is Cause.INTRUDER and choice.ruled_out_by:
        indices.add(choice.limiting_index)
    return {decision.intruders[index] for index in indices}


def _action(flight: FlightDecision) -> str:
    turns = [name for name in flight.movements if name != "Straight"]
    return "ascend or descend" if turns and turns[0] in ("Up", "Down") else "move horizontally"


def _closest(own: OwnMotion, intruder: Intruder) -> tuple[float, float, float]:
    """Time from now, and vertical and horizontal distance at the closest approach."""
    apart = intruder.position_m - own.position_m
    closing = intruder.velocity_mps - own.velocity_mps
    squared = float(closing @ closing)
    time_s = max(0.0, -float(apart @ closing) / squared) if squared > 1e-9 else 0.0
    there = apart + time_s * closing
    return time_s, abs(float(there[2])), float(np.hypot(there[0], there[1]))
