"""Vector field histogram with look-ahead, in three dimensions (after VFH* and 3DVFH*).

From the vehicle's place, a polar histogram says how far each direction is free of all balls
widened by the margin. The cheapest free directions are tried some steps ahead, each with a
histogram of its own from where a vehicle that turns no tighter than this one would be then; the
first direction of the cheapest branch is flown. Costs weigh the angle to the goal, to the nose and
to the direction chosen before, as VFH+ does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray, world_from_body
from clearway.live.mission import Mode
from clearway.sim.baselines.headings import carrot, movement_towards
from clearway.sim.baselines.histogram import Histogram, bin_directions, histogram_at
from clearway.sim.baselines.known import balls_around
from clearway.sim.baselines.manoeuvre import Craft, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.routes import routes

FREE_SHARE = 0.95
"""Of the horizon that a direction must be free for to count as free."""
LATER = 0.8
"""Weight of what comes a step later."""
APART = np.cos(np.radians(15.0))
"""Cosine between directions that are tried."""


@dataclass(frozen=True, slots=True)
class HistogramTuning:
    """Set by hand, and checked against others by `tools/tune_baselines.py`."""

    spare: float = 0.3
    """Widening beyond the margin, in margins: what turning late costs."""
    horizon: float = 0.6
    """How far a direction must be free, in ranges of the grid."""
    step: float = 0.2
    """Of the look-ahead, in ranges of the grid."""
    ahead: int = 3
    """Steps of the look-ahead."""
    tried: int = 3
    """Directions tried at each step."""
    nose: float = 0.4
    """Weight of the angle to the nose, where that to the goal weighs 1."""
    before: float = 0.2
    """Weight of the angle to the direction before."""


def vector_field_histogram(craft: Craft, tuning: HistogramTuning | None = None) -> ManoeuvreRule:
    """Three-dimensional vector field histogram with look-ahead."""
    planner, tuning = craft.planner, tuning or HistogramTuning()
    limit, range_m = planner.automaton.pitch_limit_rad, planner.grid.range_m
    search = _LookAhead(
        bin_directions(0.25 * np.pi if limit is None else limit),
        tuning,
        spare_m=(1.0 + tuning.spare) * planner.settings.safety_margin_m,
        horizon_m=tuning.horizon * range_m,
        step_m=tuning.step * range_m,
        turn_rad=tuning.step * range_m / planner.automaton.turning_radius_m,
    )

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        ways = routes(planner, situation)
        yaw = float(situation.state.attitude_rad[2])
        world_from_level = world_from_body([0.0, 0.0, yaw])
        nose = world_from_level.T @ situation.state.world_from_body[:, 0]
        wished = nose if before is None else world_from_level.T @ np.array(before.wish)
        balls = balls_around(planner, situation)
        goal = carrot(ways)
        direction, free_m = search.direction(balls, nose, wished, goal, ways.goal.target_m)
        x, y, z = (float(value) for value in world_from_level @ direction)
        wish = (x, y, z)
        movement = movement_towards(ways, direction)
        reason = f"direction free for {free_m:.1f} of {search.horizon_m:.1f} m"
        if free_m < FREE_SHARE * search.horizon_m:
            return Manoeuvre((movement,), f"no free direction; {reason}", Mode.EMERGENCY, wish)
        mode = Mode.NAVIGATION if float(direction @ goal) > APART else Mode.AVOIDANCE
        return Manoeuvre((movement,), reason, mode, wish)

    return rule


@dataclass(frozen=True, slots=True, eq=False)
class _LookAhead:
    """The look-ahead; everything in the level frame of the decision."""

    bins: FloatArray
    """[bins, 3] unit vectors."""
    tuning: HistogramTuning
    spare_m: float
    horizon_m: float
    step_m: float
    turn_rad: float
    """Sharpest turn within a step."""

    def direction(
        self,
        balls: PointHazards,
        nose: FloatArray,
        wished: FloatArray,
        goal: FloatArray,
        target_m: FloatArray,
    ) -> tuple[FloatArray, float]:
        """The direction [3] to fly in now, and how far it is free."""
        place = np.zeros(3)
        seen = self._histogram(place, balls, goal)
        cost = self._cost(seen.directions, goal, nose)
        cost += self.tuning.before * _angles(seen.directions, wished)
        tried = self._choose_tried(seen, cost)
        if len(tried) == 1 and seen.free_m[tried[0]] < FREE_SHARE * self.horizon_m:
            return seen.directions[tried[0]], float(seen.free_m[tried[0]])
        worth = [
            cost[at] + LATER * self._ahead(place, nose, seen.directions[at], balls, target_m, 1)
            for at in tried
        ]
        best = tried[int(np.argmin(worth))]
        return seen.directions[best], float(seen.free_m[best])

    def _ahead(
        self,
        place: FloatArray,
        nose: FloatArray,
        direction: FloatArray,
        balls: PointHazards,
        target_m: FloatArray,
        steps: int,
    ) -> float:
        """Cost of the cheapest branch after a step towards a direction."""
        turned = _turn(nose, direction, self.turn_rad)
        place = place + 0.5 * self.step_m * (nose + turned)
        way = target_m - place
        left = float(np.linalg.norm(way))
        if steps >= self.tuning.ahead or left < self.step_m:
            return 0.0
        goal = way / left
        seen = self._histogram(place, balls, goal)
        cost = self._cost(seen.directions, goal, turned)
        tried = self._choose_tried(seen, cost)
        if len(tried) == 1 and seen.free_m[tried[0]] < FREE_SHARE * self.horizon_m:
            return float(np.pi)
        return min(
            float(cost[at])
            + LATER * self._ahead(place, turned, seen.directions[at], balls, target_m, steps + 1)
            for at in tried
        )

    def _histogram(self, place: FloatArray, balls: PointHazards, goal: FloatArray) -> Histogram:
        directions = np.concatenate([self.bins, goal[None]])
        return histogram_at(place, balls, directions, self.spare_m, self.horizon_m)

    def _cost(self, directions: FloatArray, goal: FloatArray, nose: FloatArray) -> FloatArray:
        return _angles(directions, goal) + self.tuning.nose * _angles(directions, nose)

    def _choose_tried(self, seen: Histogram, cost: FloatArray) -> list[int]:
        """The cheapest free directions, well apart; the freest one where none is free."""
        free = np.flatnonzero(seen.free_m >= FREE_SHARE * self.horizon_m)
        if not len(free):
            return [int(np.lexsort((cost, -np.round(seen.free_m, 3)))[0])]
        tried: list[int] = []
        for at in free[np.argsort(cost[free], kind="stable")]:
            if all(float(seen.directions[at] @ seen.directions[t]) < APART for t in tried):
                tried.append(int(at))
            if len(tried) == self.tuning.tried:
                break
        return tried


def _angles(directions: FloatArray, other: FloatArray) -> FloatArray:
    """[n] angles in radians of unit vectors [n, 3] to one [3]."""
    return np.asarray(np.arccos(np.clip(directions @ other, -1.0, 1.0)))


def _turn(nose: FloatArray, direction: FloatArray, most_rad: float) -> FloatArray:
    """The nose [3] turned towards a direction [3], by no more than an angle."""
    angle = float(np.arccos(np.clip(nose @ direction, -1.0, 1.0)))
    if angle <= most_rad:
        return direction
    across = direction - (nose @ direction) * nose
    length = float(np.linalg.norm(across))
    if length < 1e-9:
        across, length = np.array([-nose[1], nose[0], 0.0]), float(np.hypot(nose[0], nose[1]))
    return np.asarray(np.cos(most_rad) * nose + np.sin(most_rad) * across / length)
