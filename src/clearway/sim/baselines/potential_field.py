"""Potential field: the waypoint attracts, what is near repels, the nose follows the sum.

Repulsion is (d0/d - 1)^n of the nearest ball in every sector of a coarse sphere, so that dense
scans push no harder than sparse ones; a share of it acts across, towards the goal's side, which
helps out of the local minima in front of obstacles. What lies behind counts less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray
from clearway.live.mission import Mode
from clearway.sim.baselines.headings import carrot, movement_towards
from clearway.sim.baselines.known import balls_around
from clearway.sim.baselines.manoeuvre import Craft, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.routes import routes

SECTOR_RAD = np.radians(20.0)


@dataclass(frozen=True, slots=True)
class FieldTuning:
    """Found by `tools/tune_baselines.py` in balls and forests that no comparison flies."""

    influence: float = 2.1
    """d0 in turning radii."""
    strength: float = 0.76
    """Repulsion at half of d0, against an attraction of 1."""
    power: float = 2.7
    across: float = 0.06
    """Share of the repulsion that acts across."""
    behind: float = 0.34
    """How much counts what lies behind, of what the same would count ahead."""


def potential_field(craft: Craft, tuning: FieldTuning | None = None) -> ManoeuvreRule:
    """Repelled by what is near; tuned by `tools/tune_baselines.py` on worlds of no campaign."""
    planner, tuning = craft.planner, tuning or FieldTuning()
    radius = planner.automaton.turning_radius_m
    influence = tuning.influence * min(radius, planner.grid.range_m)

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        del before
        ways = routes(planner, situation)
        goal = carrot(ways)
        balls = balls_around(planner, situation)
        push = _repulsion(balls, goal, influence, planner.settings.safety_margin_m, tuning)
        pushed = float(np.linalg.norm(push))
        movement = movement_towards(ways, goal + push)
        if pushed == 0.0:
            return Manoeuvre((movement,), "nothing repels")
        reason = f"repelled {pushed:.2f} times as strongly as attracted"
        return Manoeuvre((movement,), reason, Mode.AVOIDANCE)

    return rule


def _repulsion(
    balls: PointHazards, goal: FloatArray, influence: float, margin: float, tuning: FieldTuning
) -> FloatArray:
    """[3] sum of the repulsions, level frame."""
    centre = np.linalg.norm(balls.position_m, axis=1)
    distance = np.maximum(centre - balls.radius_m - margin, 0.02 * influence)
    near = np.flatnonzero((distance < influence) & (centre > 1e-9))
    if not len(near):
        return np.zeros(3)
    towards = balls.position_m[near] / centre[near, None]
    keep, weight = _nearest_per_sector(towards, distance[near])
    towards, distance = towards[keep], distance[near][keep]
    ahead = 0.5 * (1.0 + towards[:, 0])
    strength = tuning.strength * (influence / distance - 1.0) ** tuning.power
    strength *= weight * (tuning.behind + (1.0 - tuning.behind) * ahead)
    aside = goal - (towards @ goal)[:, None] * towards
    aside /= np.maximum(np.linalg.norm(aside, axis=1), 1e-9)[:, None]
    away = (1.0 - tuning.across) * -towards + tuning.across * aside
    return np.asarray(strength @ away)


def _nearest_per_sector(
    towards: FloatArray, distance: FloatArray
) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], FloatArray]:
    """Index of the nearest ball in every sector that holds any, and the sector's solid angle."""
    azimuth = np.floor(np.arctan2(towards[:, 1], towards[:, 0]) / SECTOR_RAD).astype(np.int64)
    elevation = np.arcsin(np.clip(towards[:, 2], -1.0, 1.0))
    row = np.floor(elevation / SECTOR_RAD).astype(np.int64)
    order = np.lexsort((distance, row, azimuth))
    key = azimuth[order] * 1000 + row[order]
    first = np.concatenate([[True], np.diff(key) != 0])
    keep = order[first]
    return keep, np.cos((row[keep] + 0.5) * SECTOR_RAD)
