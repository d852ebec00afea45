"""Before take-off: what a vehicle that cannot stop may expect of its turns and its sight.

Behind a gap that is narrower than the circle of a turn no loop can be seen from before it, and
`strict` goes round, or on and on. It is measured, not proved: docs/sight.md has the flights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.avoidance.plan.held_escape import BY_SIGHT
from clearway.avoidance.plan.planner import Planner
from clearway.sensors import AnySensor, Lidar

NARROW_M = 6.0
"""Circle of a turn that the gaps of most ordinary places hold."""
FAR = 1.9
"""Circles of range from which on sight holds few flights up, where gaps hold them."""
NEAR = 1.25
"""Circles of range below which it holds most up."""
WIDE_DEG = 180.0
"""Field of view that helps."""
LEAST_SHARE = 0.25
"""Of the turning radius: a smaller part of it is no advice."""


def expect_of_sight(planner: Planner, sensors: Sequence[AnySensor]) -> str | None:
    """Return what to expect of turning radius, range and field of view, and what would do.

    None where these hold up few flights, for what can stop, and where no escape has to be seen.
    """
    lidars = [one for one in sensors if isinstance(one, Lidar)]
    radius_m, settings = planner.automaton.room_to_turn_m, planner.settings
    turns = 0.0 < radius_m < np.inf and not planner.automaton.can_stop
    if not (turns and lidars and settings.escape in BY_SIGHT):
        return None
    best = max(lidars, key=lambda one: one.clears_to_m)
    range_m, width_deg = min(best.clears_to_m, planner.grid.range_m), field_deg(best)
    circle_m = 2.0 * (radius_m + settings.safety_margin_m)
    if range_m >= FAR * circle_m and circle_m <= NARROW_M:
        return None
    held_up = "most" if range_m < NEAR * circle_m else "about half of the"
    return (
        f"note: a turn needs a circle of {circle_m:.3g} m with its margins, and sensors see "
        f"{range_m:.3g} m, {width_deg:.0f} degrees wide. Through gaps narrower than that circle, "
        f"{held_up} paths take over 1.5 times the straight way. "
        f"{_cures(planner, range_m, circle_m, width_deg)} (docs/sight.md)"
    )


def field_deg(lidar: Lidar) -> float:
    """Return how wide a sensor sees (degrees): all but the widest gap between its beams."""
    azimuth = np.unique(np.mod(lidar.pattern.azimuth_rad, 2.0 * np.pi))
    steps = np.diff(azimuth, append=azimuth[0] + 2.0 * np.pi)
    return 360.0 - float(np.degrees(steps.max() - np.median(steps)))


def _cures(planner: Planner, range_m: float, circle_m: float, width_deg: float) -> str:
    """Return the values that would do, and those that would help, as a sentence."""
    settings, automaton, sentences = planner.settings, planner.automaton, []
    fits_m = 0.5 * min(range_m / FAR, NARROW_M) - settings.safety_margin_m
    if fits_m >= LEAST_SHARE * automaton.room_to_turn_m:
        slower_mps = fits_m / automaton.room_to_turn_m * automaton.fastest_mps
        sentences.append(
            f"a turning radius of {_short(fits_m)} m ({_short(slower_mps)} m/s) would do"
        )
    helps = [f"{_short(FAR * circle_m)} m of range"] if range_m < FAR * circle_m else []
    helps += [f"a field {WIDE_DEG:.0f} degrees wide"] if width_deg < WIDE_DEG - 1.0 else []
    if settings.unobserved_m == 0.0:
        helps.append(f"safety.unobserved_m = {_short(automaton.room_to_turn_m)}")
    if helps:
        *before, last = helps
        listed = f"{', '.join(before)} and {last}" if before else last
        sentences.append(f"{listed} would help")
    told = ", and ".join(sentences) or "slower flight would help"
    return told[0].upper() + told[1:]


def _short(value: float) -> str:
    """Two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):g}"
