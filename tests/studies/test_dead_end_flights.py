"""A flight of each family of the campaign `dead-ends`: no collision, by geometry of the tests'
own. All 2,600 are flown by `clearway campaign dead-ends`."""

from __future__ import annotations

import pytest

from dead_end_flights import BODY_M, flown, labels

EASIER = ("-wide", "-few", "-fine")
TIME_S = 45.0
"""Enough to be in, and out or dashed."""
FLIGHTS = [
    pytest.param(label, seed, marks=[pytest.mark.nightly] if seed or label.endswith(EASIER) else [])
    for label in labels()
    for seed in (0, 1)
]


@pytest.mark.parametrize(("label", "seed"), FLIGHTS)
def test_clearway_does_not_collide(label: str, seed: int) -> None:
    flight = flown(label, seed, time_limit_s=TIME_S)
    assert flight.nearest_m > BODY_M, flight.why
