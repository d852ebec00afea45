"""What decisions say of themselves."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from clearway.avoidance.clear.hazards import Cause
from clearway.live.outputs.explain import _clearance, name_with_kind


@pytest.mark.parametrize(
    ("kind", "name", "said"),
    [
        ("intruder", "N1", "intruder N1"),
        ("intruder", "number 2", "intruder number 2"),
        ("intruder", "intruder", "intruder"),
        ("intruder", "Intruder 3", "Intruder 3"),
        ("intruder", "intruders of old", "intruder intruders of old"),
        ("map obstacle", "obstacle 4", "map obstacle 4"),
        ("map obstacle", "mast", "map obstacle mast"),
    ],
)
def test_a_name_that_says_what_it_names_is_not_said_twice(kind: str, name: str, said: str) -> None:
    assert name_with_kind(kind, name) == said


@pytest.mark.parametrize(
    ("clearance_m", "said"),
    [
        (2.0, "clearance 2.00 m of 0.60 m asked"),
        (-0.02, "clearance -0.02 m of 0.60 m asked"),
        (-7401.9, "no clearance, 0.60 m asked"),
    ],
)
def test_no_distance_is_told_that_cannot_be_one(clearance_m: float, said: str) -> None:
    choice = SimpleNamespace(limited_by=Cause.INTRUDER, clearance_m=clearance_m)
    decision: Any = SimpleNamespace(choice=choice, margin_m=0.6)
    assert _clearance(decision) == said
