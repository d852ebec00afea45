"""Velocity obstacles in three dimensions (Fiorini and Shiller 1998), for vehicles that must turn.

A velocity is admissible if, flown on, it keeps clear of every ball within the horizon, each ball
flying on with its own velocity. Of those that whole movements lead to, the admissible one nearest
to the wished one is flown. All have the vehicle's speed; turning into one takes its time, so its
obstacle starts where the turn will have ended (Wilkie, van den Berg and Manocha 2009).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.avoidance.plan.situation import Situation
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray, cartesian_from_spherical, world_from_body
from clearway.live.mission import Mode
from clearway.sim.baselines.headings import carrot, movement_towards
from clearway.sim.baselines.known import MovingBalls, moving_balls_around
from clearway.sim.baselines.manoeuvre import Craft, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.routes import routes
from clearway.vehicle.automaton import MovementAutomaton


@dataclass(frozen=True, slots=True)
class VelocityTuning:
    """Found by `tools/tune_traffic.py` in encounters that no comparison flies."""

    spare: float = 0.1
    """Widening beyond the margin, in margins: movements turn in steps."""
    horizon: float = 1.0
    """Look-ahead in times that straight flight takes to the end of the grid."""


def velocity_obstacle(craft: Craft, tuning: VelocityTuning | None = None) -> ManoeuvreRule:
    """Velocity obstacles in three dimensions: the admissible velocity nearest to the wished one."""
    planner, tuning = craft.planner, tuning or VelocityTuning()
    speed = planner.speed_mps
    reachable = reachable_directions(planner.automaton)
    spare_m = (1.0 + tuning.spare) * planner.settings.safety_margin_m
    horizon_s = tuning.horizon * planner.grid.range_m / speed
    turn_rps = speed / planner.automaton.turning_radius_m

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        del before
        ways = routes(planner, situation)
        goal = carrot(ways)
        yaw = float(situation.state.attitude_rad[2])
        nose = world_from_body([0.0, 0.0, yaw]).T @ situation.state.world_from_body[:, 0]
        balls = moving_balls_around(planner, situation)
        directions = np.concatenate([nose[None], reachable])
        free_s = free_times(directions, nose, speed, turn_rps, balls, spare_m, horizon_s)
        off = np.round(directions @ goal, 9)
        admissible = free_s >= horizon_s
        if admissible.any():
            best = int(np.argmax(np.where(admissible, off, -2.0)))
            nearest = bool(off[best] >= off.max() - 1e-9)
            mode = Mode.NAVIGATION if nearest else Mode.AVOIDANCE
            angle = np.degrees(np.arccos(np.clip(off[best], -1.0, 1.0)))
            reason = f"admissible velocity {angle:.0f} degrees off the wished one"
            return Manoeuvre((movement_towards(ways, directions[best]),), reason, mode)
        best = int(np.lexsort((-off, -np.round(free_s, 3)))[0])
        reason = f"no admissible velocity: the one that is clear longest, {free_s[best]:.1f} s"
        return Manoeuvre((movement_towards(ways, directions[best]),), reason, Mode.EMERGENCY)

    return rule


def reachable_directions(automaton: MovementAutomaton) -> FloatArray:
    """[n, 3] unit vectors that whole movements turn the nose to, in the level frame."""
    turns = [abs(movement.yaw_rate_rps) * movement.duration_s for movement in automaton.movements]
    step = min((turn for turn in turns if turn > 0.0), default=2.0 * np.pi)
    azimuth = step * np.arange(-int(np.pi / step + 1e-9), int(np.pi / step + 1e-9) + 1)
    elevation = -np.array(automaton.start_pitches_rad)
    mesh = np.meshgrid(azimuth, elevation, indexing="ij")
    angles = np.stack([np.ones_like(mesh[0]), *mesh], axis=-1).reshape(-1, 3)
    return np.ascontiguousarray(cartesian_from_spherical(angles))


def free_times(
    directions: FloatArray,
    nose: FloatArray,
    speed_mps: float,
    turn_rps: float,
    balls: MovingBalls,
    spare_m: float,
    horizon_s: float,
) -> FloatArray:
    """[n] how long each direction [n, 3] may be flown before a widened ball is entered.

    The horizon where none is. nose: [3] direction flown now; turn_rps: how fast it turns, inf for
    a vehicle that turns at once. What is inside a ball may go where that leads out. Level frame.
    """
    angle = np.arccos(np.clip(directions @ nose, -1.0, 1.0))
    turning_s = angle / turn_rps
    # Along an arc: its chord, in the direction half way between.
    between = directions + nose
    length = np.maximum(np.linalg.norm(between, axis=1), 1e-9)
    chord = speed_mps * turning_s * np.sinc(0.5 * angle / np.pi)
    turned_m = (chord / length)[:, None] * between
    return _free_times(directions, turning_s, turned_m, speed_mps, *balls, spare_m, horizon_s)


@compiled
def _free_times(
    directions: Floats2,
    turning_s: Floats,
    turned_m: Floats2,
    speed: float,
    position: Floats2,
    velocity: Floats2,
    radius: Floats,
    growth: Floats,
    spare: float,
    horizon: float,
) -> Floats:
    free = np.full(len(directions), horizon)
    for b in range(len(directions)):
        later = turning_s[b]
        for n in range(len(radius)):
            apart2 = 0.0
            closing = 0.0
            rush2 = 0.0
            for axis in range(3):
                apart = position[n, axis] + later * velocity[n, axis] - turned_m[b, axis]
                rush = velocity[n, axis] - speed * directions[b, axis]
                apart2 += apart * apart
                closing -= apart * rush
                rush2 += rush * rush
            if closing <= 0.0 or rush2 <= 0.0:
                continue
            nearest = closing / rush2
            wide = radius[n] + spare + growth[n] * (later + nearest)
            if apart2 <= wide * wide:
                free[b] = min(free[b], later)
                continue
            chord2 = wide * wide - (apart2 - closing * nearest)
            if chord2 > 0.0:
                free[b] = min(free[b], later + nearest - np.sqrt(chord2 / rush2))
    return free
