"""What the movements of an automaton amount to: whether they stop, turn, climb, and how steeply.

Each is worked out once, of what is predicted of the movements from level flight, or as measured.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from clearway.base.frames import FloatArray
from clearway.vehicle.movement import Movement
from clearway.vehicle.predicted import PITCH_TOLERANCE_RAD, PredictedMovements

MOST_START_PITCHES = 25
_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])


class Abilities(PredictedMovements):
    """What a vehicle can do by its movements."""

    @cached_property
    def mirror(self) -> tuple[int, ...] | None:
        """Per movement the index of its mirror image left to right; None if one has none."""
        if self.classes is not None:
            return None
        level, movements = np.zeros(6), self.movements
        ends = np.array([self.predict(level, movement) for movement in movements])
        durations = np.array([movement.duration_s for movement in movements])
        farthest = float(np.abs(ends[:, :3]).max()) or 1.0
        near = 1e-9 * np.array([farthest] * 3 + [1.0] * 3)
        images = []
        for end, duration in zip(ends, durations, strict=True):
            same = np.all(np.abs(ends - end * _MIRROR) < near, axis=1) & (durations == duration)
            if not np.any(same):
                return None
            images.append(int(np.argmax(same)))
        return tuple(images)

    @property
    def fastest_mps(self) -> float:
        """Fastest speed along the path of any movement."""
        return max(movement.pace_mps for movement in self.movements)

    @property
    def start_mps(self) -> float:
        """Speed that a flight begins with: none for what can stop, else that of the first movement
        that goes straight on."""
        if self.can_stop:
            return 0.0
        straight = (m.speed_mps for m in self.movements if not m.turn_rate_rps and not m.climb_mps)
        return next(straight, self.fastest_mps)

    @cached_property
    def stands(self) -> tuple[bool, ...]:
        """Per movement whether it stays where it is, and may be repeated for ever.

        Holding, and turning on the spot: neither place nor roll and pitch change.
        """
        forbidden = self.forbidden
        if self.classes is not None:
            return tuple(np.any(self.classes.stands, axis=0).tolist())
        level = np.zeros(6)
        return tuple(
            not np.any(self.predict(level, movement)[:5])
            and self.is_allowed(level, movement)
            and (movement.name, movement.name) not in forbidden
            for movement in self.movements
        )

    @cached_property
    def can_stop(self) -> bool:
        """Whether some movement stands: the vehicle may stay where it is for as long as it likes.

        It then needs no room to circle.
        """
        return any(self.stands)

    @cached_property
    def hold(self) -> Movement | None:
        """The movement to stay with: the one that stands and turns least; None where none does."""
        standing = [m for m, stands in zip(self.movements, self.stands, strict=True) if stands]
        return min(standing, key=lambda movement: abs(movement.yaw_rate_rps), default=None)

    @cached_property
    def keeps_attitude(self) -> bool:
        """Whether roll and pitch neither change nor matter: tilting is no part of the way."""
        if self.classes is not None:
            return False
        level, tilted = np.zeros(6), np.array([0.0, 0.0, 0.0, 0.3, -0.2, 0.0])
        return all(
            bool(
                np.array_equal(
                    self.predict(tilted, movement) - tilted, self.predict(level, movement)
                )
            )
            for movement in self.movements
        )

    @cached_property
    def spot_turn_m_per_rad(self) -> float:
        """What it costs to turn on the spot, as way that could have been flown; inf if it can't."""
        rates = [
            abs(movement.yaw_rate_rps)
            for movement, stands in zip(self.movements, self.stands, strict=True)
            if stands and movement.yaw_rate_rps
        ]
        return self.fastest_mps / max(rates) if rates else float("inf")

    @property
    def room_to_turn_m(self) -> float:
        """Room that it takes to turn away from what is ahead; none for what can stop."""
        return 0.0 if self.can_stop else self.turning_radius_m

    @cached_property
    def stopping_m(self) -> float:
        """Way to a stop from the greatest speed, with the movement before it is decided; of what
        changes its speed at once, or never stops, 0."""
        classes = self.classes
        if classes is None or not classes.has_speeds:
            return 0.0
        then = classes.speed_mps[np.maximum(classes.following, 0)]
        lost = np.where(classes.following >= 0, classes.speed_mps[:, None] - then, 0.0)
        lasts_s, fastest = self.movements[0].duration_s, self.fastest_mps
        brakes_mps2 = float(lost.max()) / lasts_s
        return fastest * lasts_s + 0.5 * fastest**2 / brakes_mps2

    @cached_property
    def turning_radius_m(self) -> float:
        """Smallest v / omega of the level turns; inf when nothing turns in flight."""
        if self.classes is not None:
            return self.classes.turning_radius_m
        radii = [
            movement.speed_mps / movement.turn_rate_rps
            for movement in self.movements
            if movement.speed_mps > 0.0 and movement.pitch_rate_rps == 0.0 and movement.yaw_rate_rps
        ]
        return min(radii, default=float("inf"))

    @cached_property
    def level_ends(self) -> FloatArray:
        """[n, 6] where the movements end that may be flown from level flight; as measured, those
        that are flown on and on."""
        level, classes, movements = np.zeros(6), self.classes, self.movements
        if classes is not None:
            steady = [(classes.label_of(at), movements[m]) for at, m in classes.steady.tolist()]
            measured = [self.predict([0.0, 0.0, 0.0, roll, 0.0, 0.0], m) for roll, m in steady]
            return np.array(measured) * [1.0, 1.0, 1.0, 0.0, 1.0, 1.0]
        ends = [self.predict(level, m) for m in movements if self.is_allowed(level, m)]
        return np.array(ends).reshape(-1, 6)

    @cached_property
    def stays_level(self) -> bool:
        """Whether no movement leads out of level flight: its height is not the vehicle's choice."""
        return bool(np.all(np.abs(self.level_ends[:, 2:5]) <= PITCH_TOLERANCE_RAD))

    @cached_property
    def climbs_ahead(self) -> bool:
        """Whether climbing is a movement, and always one that leads ahead: none goes straight up or
        down, and no pitch is held."""
        if not self.keeps_attitude and self.classes is None:
            return False
        ends = self.level_ends
        climbing = np.abs(ends[:, 2]) > 0.02 * self.step_m
        ahead_m = np.hypot(ends[climbing, 0], ends[climbing, 1])
        return bool(climbing.any() and np.all(ahead_m > 0.1 * self.step_m))

    @cached_property
    def steepest_rad(self) -> float | None:
        """Steepest way up or down: the pitch limit, or a movement that climbs steeper by itself.

        None without a pitch limit.
        """
        if self.pitch_limit_rad is None:
            return None
        ends = self.level_ends
        level_m = np.hypot(ends[:, 0], ends[:, 1])
        # Straight up takes the time of a way so steep that it climbs as fast at full speed.
        beside = np.sqrt(np.maximum(self.step_m**2 - ends[:, 2] ** 2, 0.0))
        level_m = np.where(level_m > 0.0, level_m, beside)
        climbs = np.arctan2(np.abs(ends[:, 2]), level_m)
        return max(self.pitch_limit_rad, float(climbs.max(initial=0.0)))

    @cached_property
    def step_m(self) -> float:
        """Longest way from start to end of a movement in level flight, whatever came before it."""
        level, classes = np.zeros(6), self.classes
        if classes is not None:
            ways = np.linalg.norm(classes.paths[..., -1, :3], axis=-1)
            return float(np.where(classes.following >= 0, ways, 0.0).max())
        return max(
            float(np.linalg.norm(self.predict(level, movement)[:3])) for movement in self.movements
        )

    @cached_property
    def start_pitches_rad(self) -> tuple[float, ...]:
        """Pitches that chains of movements reach from level flight, ascending.

        Reach sets are built for these; without a pitch limit only for level flight. Where turn
        steps make more than 25 of them, that many spread over the limits.
        """
        if self.pitch_limit_rad is None:
            return (0.0,)
        level = np.zeros(6)
        steps = [float(self.predict(level, movement)[4]) for movement in self.movements]
        limit = self.pitch_limit_rad + PITCH_TOLERANCE_RAD
        found, fresh = {0: 0.0}, [0.0]
        while fresh and len(found) <= MOST_START_PITCHES:
            reached = {_key(pitch + step): pitch + step for pitch in fresh for step in steps}
            reached = {key: at for key, at in reached.items() if abs(at) <= limit}
            fresh = [at for key, at in reached.items() if key not in found]
            found = reached | found
        if len(found) > MOST_START_PITCHES:
            spread = np.linspace(-self.pitch_limit_rad, self.pitch_limit_rad, MOST_START_PITCHES)
            return tuple(float(pitch) for pitch in spread)
        return tuple(sorted(found.values()))


def _key(angle_rad: float) -> int:
    """Equal for angles that differ by rounding only."""
    return round(angle_rad * 1e9)
