"""Modified voltage potential (Hoekstra, van Gent and Ruigrok 2002; Eby 1994), with balls to keep.

For every ball that the wished velocity would come too near to within the horizon, the velocity is
changed so that the closest approach is moved out of the protected zone, by the shortest way and in
the time that is left. Changes for several intruders add up; of what stands still only the largest
counts, since a wall is thousands of returns. The vehicle flies in the direction that comes out.

BlueSky keeps horizontal and vertical resolutions apart, since its zones are flat cylinders; here
the zone is a ball, so there is one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray
from clearway.live.mission import Mode
from clearway.sim.baselines.headings import carrot, movement_towards
from clearway.sim.baselines.known import MovingBalls, moving_balls_around
from clearway.sim.baselines.manoeuvre import Craft, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.routes import routes

HEAD_ON = 1e-3
"""Of the zone: nearer than this to a central hit there is no shortest way out; it passes left."""
SOONEST_S = 0.05
"""No resolution is asked for in less time."""


@dataclass(frozen=True, slots=True)
class VoltageTuning:
    """Found by `tools/tune_traffic.py` in encounters that no comparison flies."""

    zone: float = 2.0
    """Protected zone in margins, BlueSky's `resofach`: 1.05 there, where courses may be of any
    degree and are renewed all the time; a vehicle that turns in steps of 15 needs more."""
    horizon: float = 1.0
    """Look-ahead in times that straight flight takes to the end of the grid."""


def make_mvp(craft: Craft, tuning: VoltageTuning | None = None) -> ManoeuvreRule:
    """Modified voltage potential: the wished velocity, changed by the sum of all resolutions."""
    planner, tuning = craft.planner, tuning or VoltageTuning()
    spare_m = tuning.zone * planner.settings.safety_margin_m
    horizon_s = tuning.horizon * planner.grid.range_m / planner.speed_mps

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        del before
        ways = routes(planner, situation)
        wished = planner.speed_mps * carrot(ways)
        balls = moving_balls_around(planner, situation)
        changes = resolutions(wished, balls, spare_m, horizon_s)
        change = _together(changes, balls)
        resolved = wished + change
        movement = movement_towards(ways, resolved / max(float(np.linalg.norm(resolved)), 1e-9))
        asked = float(np.linalg.norm(change))
        if asked == 0.0:
            return Manoeuvre((movement,), "no conflict")
        conflicts = int(np.count_nonzero(np.any(changes != 0.0, axis=1)))
        reason = f"{conflicts} conflicts: {asked:.2f} m/s off the wished velocity"
        return Manoeuvre((movement,), reason, Mode.AVOIDANCE)

    return rule


def resolutions(
    velocity_mps: FloatArray, balls: MovingBalls, spare_m: float, horizon_s: float
) -> FloatArray:
    """[n, 3] change of velocity for each ball; zero without a conflict within the horizon.

    The change times the time to the closest approach is the intrusion there, away from the ball;
    from outside of the zone it is divided by the cosine between the displacement and the tangent,
    or the new course would graze the zone. velocity_mps: [3] in the frame of the balls.
    """
    apart = -balls.position_m
    rush = velocity_mps - balls.velocity_mps
    closing = -np.einsum("ij,ij->i", apart, rush)
    speed2 = np.maximum(np.einsum("ij,ij->i", rush, rush), 1e-12)
    nearest_s = closing / speed2
    zone = balls.radius_m + spare_m + balls.growth_mps * np.clip(nearest_s, 0.0, horizon_s)
    miss = apart + nearest_s[:, None] * rush
    missed = np.linalg.norm(miss, axis=1)
    entry_s = nearest_s - np.sqrt(np.maximum(zone**2 - missed**2, 0.0) / speed2)
    conflict = (missed < zone) & (closing > 0.0) & (entry_s <= horizon_s)
    found = np.flatnonzero(conflict)
    changes = np.zeros_like(apart)
    if len(found):
        away, missed = _outwards(miss[found], rush[found], zone[found])
        distance = np.linalg.norm(apart[found], axis=1)
        outside = distance > zone[found]
        safe = np.where(outside, distance, 1.0)
        tangent = np.arcsin(np.clip(zone[found] / safe, 0.0, 1.0))
        past = np.arcsin(np.clip(missed / safe, 0.0, 1.0))
        graze = np.where(outside, np.cos(tangent - past), 1.0)
        asked = (zone[found] / graze - missed) / np.maximum(nearest_s[found], SOONEST_S)
        changes[found] = asked[:, None] * away
    return changes


def _outwards(
    miss: FloatArray, rush: FloatArray, zone: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """[k, 3] unit vectors from the balls to where they are missed, and how far that is [k]."""
    missed = np.linalg.norm(miss, axis=1)
    central = missed < HEAD_ON * zone
    left = np.stack([-rush[:, 1], rush[:, 0], np.zeros(len(rush))], axis=1)
    left /= np.maximum(np.linalg.norm(left, axis=1), 1e-9)[:, None]
    away = miss / np.maximum(missed, 1e-12)[:, None]
    return np.where(central[:, None], left, away), np.where(central, 0.0, missed)


def _together(changes: FloatArray, balls: MovingBalls) -> FloatArray:
    """[3] all of moving balls, and the largest of those at rest."""
    moving = np.any(balls.velocity_mps != 0.0, axis=1)
    total: FloatArray = changes[moving].sum(axis=0)
    at_rest = changes[~moving]
    if len(at_rest):
        total = total + at_rest[int(np.argmax(np.einsum("ij,ij->i", at_rest, at_rest)))]
    return total
