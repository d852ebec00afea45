"""By what escapes are verified at one decision: what was seen and what is in the way, how far the
vehicle may stray, where wind carries it and for how long that is looked at."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from clearway.avoidance.escape.legs import EscapeTerms
from clearway.avoidance.plan.evidence import NOTHING_MOVING, InReach
from clearway.avoidance.plan.floor import with_ground
from clearway.avoidance.plan.held_escape import SEES, Escape
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Here, Situation, margin_slope
from clearway.base.frames import FloatArray, compute_rotation, measure_length
from clearway.reach.escapes.legs import SAME_RAD
from clearway.reach.escapes.library import EscapeLibrary
from clearway.reach.expand.lattice import grid_from_level
from clearway.sensors.observed.seen_space import NOTHING_SEEN
from clearway.vehicle.automaton import MovementAutomaton

IN_WIND_TURNS = 2.0
"""Full circles' worth of time for which an escape is verified where wind carries it."""
STANDING_TURN = 12.0
"""Movements that count as a full circle for a vehicle that can turn on the spot."""


def make_escape_terms(
    planner: Planner, library: EscapeLibrary, situation: Situation, near: InReach
) -> EscapeTerms:
    """With the whole margin, and through what was seen to be free where that is asked for."""
    state, settings, seen = situation.state, planner.settings, situation.seen
    _, pitch, yaw = state.attitude_rad.tolist()
    strict = settings.escape in SEES and seen is not None
    budget_m = settings.unobserved_m if settings.escape == Escape.BUDGETED else 0.0
    grown = near.margin_m - settings.safety_margin_m
    return EscapeTerms(
        NOTHING_SEEN if seen is None else seen,
        strict,
        settings.body_radius_m + grown,
        budget_m,
        count_unobserved_places(budget_m, library.automaton),
        near.margin_m,
        margin_slope(settings, situation),
        state.position_m,
        yaw,
        grid_from_level(pitch),
        near.hazards.bins,
        with_ground(near.hazards.shapes, near.frame, situation.floor_m, near.margin_m),
        near.hazards.moving,
        NOTHING_MOVING,
        _level_wind(situation.wind_mps, yaw),
        settings.sigmas * situation.wind_sigma_mps,
        *_tube_of(library),
        0.0,
    )


def count_unobserved_places(budget_m: float, automaton: MovementAutomaton) -> int:
    """Return how many ends of movements an escape may have in unobserved space.

    Between two of them the way between counts as not seen: a first look, which passes over some
    escapes that lead in and out of it, and none where there is no budget.
    """
    return 1 + int(budget_m / automaton.step_m) if budget_m > 0.0 else 0


@lru_cache(maxsize=64)
def in_wind_s(library: EscapeLibrary) -> float:
    """For how long escapes are verified where wind carries them."""
    automaton = library.automaton
    radius = automaton.turning_radius_m
    if np.isfinite(radius) and automaton.fastest_mps > 0.0:
        return IN_WIND_TURNS * 2.0 * np.pi * radius / automaton.fastest_mps
    return IN_WIND_TURNS * STANDING_TURN * max(each.duration_s for each in automaton.movements)


def limit_carried_m(planner: Planner, situation: Situation | Here) -> float:
    """How far wind, or a tilt that no loop closes with, may carry an escape."""
    library = planner.escapes
    if library is None:
        return 0.0
    roll, pitch, _ = situation.state.attitude_rad.tolist()
    tilt_rad = measure_length(library.attitudes[library.nearest(roll, pitch)] - [roll, pitch])
    drift_mps = planner.speed_mps * min(1.0, tilt_rad) if tilt_rad > SAME_RAD else 0.0
    drift_mps += measure_length(situation.wind_mps)
    return drift_mps * in_wind_s(library) if drift_mps else 0.0


def _level_wind(wind_mps: FloatArray, yaw_rad: float) -> FloatArray:
    """[3] in the level frame."""
    if not any(wind_mps.tolist()):
        return np.zeros(3)
    return np.ascontiguousarray(compute_rotation(0.0, 0.0, yaw_rad).T @ wind_mps)


@lru_cache(maxsize=64)
def _tube_of(library: EscapeLibrary) -> tuple[FloatArray, float]:
    """Radii after 0, 1, ... movements, and how long one takes at least."""
    automaton = library.automaton
    shortest_s = min(movement.duration_s for movement in automaton.movements)
    if automaton.classes is None:
        return np.zeros(0), shortest_s
    return automaton.tube_m(np.arange(len(automaton.classes.tube_m) + 1)), shortest_s
