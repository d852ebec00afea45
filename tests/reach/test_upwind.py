"""Loops against the wind: over ground they come back to where they began, as nearly as can be."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.reach.escapes.library import EscapeLibrary, names_of
from clearway.reach.escapes.upwind import ways_in_wind
from clearway.vehicle.automaton import MovementAutomaton

AUTOMATON = MovementAutomaton.plane()
LIBRARY = EscapeLibrary.of(AUTOMATON)
LEVEL = 0


def drift_m(begins: tuple[str, ...], loop: tuple[str, ...], wind_mps) -> float:
    """How far one round leads over ground, flown by the automaton's own predictor."""
    state = np.zeros(6)
    for name in begins:
        state = AUTOMATON.predict(state, AUTOMATON[name])
    begun, time_s = state[:3].copy(), 0.0
    for name in loop:
        state = AUTOMATON.predict(state, AUTOMATON[name])
        time_s += AUTOMATON[name].duration_s
    return float(np.linalg.norm(state[:3] - begun + np.array(wind_mps) * time_s))


@pytest.mark.parametrize("share", [0.05, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("from_deg", [0.0, 37.0, 110.0, 200.0, 295.0])
def test_a_round_drifts_by_less_than_a_movement(share: float, from_deg: float) -> None:
    angle = np.radians(from_deg)
    wind = share * np.array([np.cos(angle), np.sin(angle), 0.0])
    ways = ways_in_wind(LIBRARY, LEVEL, wind, 1.0)
    upwind = int(np.count_nonzero(ways.attitude == LEVEL)) * 2
    assert upwind <= len(ways.begins)
    circle_m = share * 24.0
    for escape in range(0, upwind, 7):
        found = drift_m(*names_of(LIBRARY, ways, escape), wind)
        assert found < 0.75 + 0.14 * circle_m / (1.0 - share), "half a movement, half a turn"
        assert found < circle_m + 1e-6


def test_the_others_follow_as_they_are_in_the_library() -> None:
    ways = ways_in_wind(LIBRARY, LEVEL, np.array([0.1, 0.1, 0.0]), 1.0)
    plain = LIBRARY.ways[LEVEL]
    first = len(ways.begins) - min(200, len(plain.begins))
    for n in range(len(ways.begins) - first):
        assert names_of(LIBRARY, ways, first + n) == names_of(LIBRARY, plain, n)


def test_a_vehicle_that_can_stop_keeps_its_ways_to_hold() -> None:
    library = EscapeLibrary.of(MovementAutomaton.inertialess())
    ways = ways_in_wind(library, LEVEL, np.array([0.2, 0.0, 0.0]), 1.0)
    loops = {names_of(library, ways, n)[1] for n in range(len(ways.begins))}
    assert {("Hold",)} & loops
