"""What the labels of encounter model files stand for: names, units, and what may be absent.

Files of one format differ in their variables and do not state units. Balloons have a layer and a
climb alone. The model of air ambulances counts climbs in feet a second, and its labels of turn and
acceleration stand for each other: what it calls a turn is negative before landing and positive
after take-off, and what it calls an acceleration is even to both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS

LAYER = "L"
SPEED = "v"
ACCELERATION = r"\dot v"
CLIMB = r"\dot h"
TURN = r"\dot \psi"
ALWAYS = (LAYER, CLIMB)
"""Altitude layer (ft) and climb (ft/min unless a convention says otherwise)."""
ACROSS = (SPEED, ACCELERATION, TURN)
"""Speed (kt), its change (kt/s) and turn (deg/s, right positive): all of them or none."""
FROM_START = "d_s"
TO_FINISH = "d_f"


class Conventions(NamedTuple):
    """How one kind of file is read."""

    climb_mps: float
    """A climb of one unit of the file."""
    renamed: dict[str, str]
    """Labels of the file that stand for another variable."""


PLAIN = Conventions(FOOT_PER_MINUTE_MPS, {})
AMBULANCE = Conventions(FOOT_M, {ACCELERATION: TURN, TURN: ACCELERATION})


def choose_conventions(labels: Sequence[str]) -> Conventions:
    """Return how a file with these labels is read: distances to both ends mark air ambulances."""
    return AMBULANCE if {FROM_START, TO_FINISH} <= set(labels) else PLAIN


def missing_labels(labels: Sequence[str]) -> list[str]:
    """Return what tracks need beside these labels; nothing may fly without a layer and a climb."""
    across = ACROSS if set(ACROSS) & set(labels) else ()
    return [name for name in (*ALWAYS, *across) if name not in labels]
