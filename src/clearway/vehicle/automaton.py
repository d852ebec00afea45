"""Movement automaton (def. 12): the few movements that a vehicle is flown with, and their limits.

A movement holds constant inputs for a duration. The automaton says which movement may follow in
which state, and predicts where it ends: exactly by the vehicle's model, or by a measured table.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import brief, one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.positional import keywords_beyond_two
from clearway.base.state import Trajectory
from clearway.vehicle.model import PlaneModel, Vehicle
from clearway.vehicle.table import MovementTable

PITCH_TOLERANCE_RAD = 1e-9
"""Four times Up lands on a limit of four steps in spite of rounding."""
MOST_START_PITCHES = 25
_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Movement:
    """Constant inputs (4.2) held for a duration: (3.14), def. 10, def. 11.

    Pitch rate is positive nose down, yaw rate left. `smooth` puts it into the smooth set of
    def. 25. Raises ClearwayError for a duration that is not positive (def. 12, rule 1) or inputs
    that are not finite.
    """

    name: str
    speed_mps: float
    roll_rate_rps: float = 0.0
    pitch_rate_rps: float = 0.0
    yaw_rate_rps: float = 0.0
    duration_s: float = 1.0
    smooth: bool = False

    __repr__ = brief

    def __post_init__(self) -> None:
        if not (self.duration_s > 0.0 and np.isfinite(self.duration_s)):
            raise ClearwayError(f"movement {self.name}: duration must be positive and finite")
        if not (np.all(np.isfinite(self.inputs)) and self.speed_mps >= 0.0):
            raise ClearwayError(f"movement {self.name}: inputs must be finite, speed >= 0")

    @property
    def inputs(self) -> FloatArray:
        """[4] speed, roll rate, pitch rate, yaw rate."""
        return np.array(
            [self.speed_mps, self.roll_rate_rps, self.pitch_rate_rps, self.yaw_rate_rps]
        )

    @property
    def turn_rate_rps(self) -> float:
        """Bound of the rate at which the direction of flight turns."""
        return float(np.hypot(self.pitch_rate_rps, self.yaw_rate_rps))


@keywords_beyond_two
@dataclass(frozen=True)
class MovementAutomaton:
    """Movements, their limits and their predictor: (3.15), def. 12.

    As a hybrid automaton (3.10), def. 7, its discrete states are the movements, its vector field is
    the vehicle's, `allowed` is its transition map, and nothing is reset.

    pitch_limit_rad: |pitch| that no movement may exceed; None for no limit. table: when given, it
    predicts in place of the vehicle's model ((4.14), (4.15)). forbidden: pairs of movement names
    (first, next) that may not follow each other, the transition map of (3.15). Raises
    ClearwayError for no movements, names used twice, a table without some movement, or unknown
    names in `forbidden`.

    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=5.0, turn_step_deg=15.0)
    >>> len(automaton.names), round(automaton.turning_radius_m, 1)
    (9, 19.1)
    """

    movements: tuple[Movement, ...]
    pitch_limit_rad: float | None = None
    vehicle: Vehicle = field(default_factory=PlaneModel)
    table: MovementTable | None = None
    forbidden: frozenset[tuple[str, str]] = frozenset()

    def __post_init__(self) -> None:
        names = self.names
        if not names:
            raise ClearwayError("movement automaton: at least one movement is needed")
        if len(set(names)) < len(names):
            raise ClearwayError(f"movement automaton: movement names must differ, got {names}")
        if self.pitch_limit_rad is not None and not 0.0 <= self.pitch_limit_rad < np.inf:
            raise ClearwayError("movement automaton: pitch limit must be a number >= 0, or None")
        lacking = set(names) - set(self.table.names if self.table else names)
        if lacking:
            raise ClearwayError(f"movement table lacks {', '.join(sorted(lacking))}")
        unknown = {name for pair in self.forbidden for name in pair} - set(names)
        if unknown:
            raise ClearwayError(f"forbidden transitions name unknown movements {sorted(unknown)}")

    @classmethod
    @keywords_beyond_two
    def plane(
        cls,
        speed_mps: float = 1.0,
        turn_step_deg: float = 15.0,
        duration_s: float = 1.0,
        pitch_limit_deg: float | None = 30.0,
        *,
        diagonals: bool = True,
    ) -> MovementAutomaton:
        """The nine movements of section 4.3, or the five without diagonals."""
        rate = np.radians(turn_step_deg) / duration_s
        turns = {
            "Straight": (0, 0),
            "Down": (1, 0),
            "Up": (-1, 0),
            "Left": (0, 1),
            "Right": (0, -1),
            "Down-Left": (1, 1),
            "Down-Right": (1, -1),
            "Up-Left": (-1, 1),
            "Up-Right": (-1, -1),
        }
        movements = tuple(
            Movement(
                name,
                float(speed_mps),
                pitch_rate_rps=float(pitch * rate),
                yaw_rate_rps=float(yaw * rate),
                duration_s=float(duration_s),
                smooth=name == "Straight",
            )
            for name, (pitch, yaw) in turns.items()
            if diagonals or 0 in (pitch, yaw)
        )
        limit = None if pitch_limit_deg is None else float(np.radians(pitch_limit_deg))
        return cls(movements, limit)

    def __repr__(self) -> str:
        speeds = [movement.speed_mps for movement in self.movements]
        limit = self.pitch_limit_rad
        return one_line(
            "MovementAutomaton",
            (
                f"{len(self.movements)} movements",
                f"up to {max(speeds):g} m/s",
                "no pitch limit" if limit is None else f"pitch within {np.degrees(limit):.3g} deg",
                *([] if self.table is None else ["measured table"]),
            ),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the movements, in order."""
        return tuple(movement.name for movement in self.movements)

    @cached_property
    def _by_name(self) -> dict[str, Movement]:
        return {movement.name: movement for movement in self.movements}

    def __getitem__(self, name: str) -> Movement:
        """The movement of that name; raises ClearwayError listing the valid ones."""
        try:
            return self._by_name[name]
        except KeyError:
            raise ClearwayError(
                f"no movement {name!r}; the automaton has {', '.join(self.names)}"
            ) from None

    def predict(
        self, state: npt.ArrayLike, movement: Movement, duration_s: float | None = None
    ) -> FloatArray:
        """State [6] after a movement, or after the first `duration_s` of it: (4.16), (3.21).

        Over its times that is the trajectory primitive (3.11), def. 8.
        """
        duration = movement.duration_s if duration_s is None else duration_s
        if self.table is not None:
            return self.table.predict(state, movement.name, duration / movement.duration_s)
        return self.vehicle.advance(state, movement.inputs, duration)

    def measured(self, steps: int = 1) -> MovementTable:
        """Each movement flown once from level flight, as tables 4.1 and 4.2 were made."""
        level = np.zeros(6)
        return MovementTable.from_rows(
            {
                movement.name: [
                    self.predict(level, movement, movement.duration_s * step / steps)
                    for step in range(1, steps + 1)
                ]
                for movement in self.movements
            }
        )

    def allowed(
        self, state: npt.ArrayLike, movement: Movement, previous: Movement | None = None
    ) -> bool:
        """Whether the movement may follow `previous` in that state.

        It must end within the pitch limit; beyond the limit, whatever leads back towards it may
        be flown.
        """
        if previous is not None and (previous.name, movement.name) in self.forbidden:
            return False
        if self.pitch_limit_rad is None:
            return True
        start = abs(float(np.asarray(state)[4]))
        end = abs(float(self.predict(state, movement)[4]))
        return end <= self.pitch_limit_rad + PITCH_TOLERANCE_RAD or end < start

    @cached_property
    def mirror(self) -> tuple[int, ...] | None:
        """Per movement the index of its mirror image left to right; None if one has none."""
        level = np.zeros(6)
        ends = np.array([self.predict(level, movement) for movement in self.movements])
        durations = np.array([movement.duration_s for movement in self.movements])
        farthest = float(np.abs(ends[:, :3]).max()) or 1.0
        near = 1e-9 * np.array([farthest] * 3 + [1.0] * 3)
        images = []
        for end, duration in zip(ends, durations, strict=True):
            same = np.all(np.abs(ends - end * _MIRROR) < near, axis=1) & (durations == duration)
            if not np.any(same):
                return None
            images.append(int(np.argmax(same)))
        return tuple(images)

    @cached_property
    def turning_radius_m(self) -> float:
        """Smallest v / omega of the level turns; inf when nothing turns in flight."""
        radii = [
            movement.speed_mps / movement.turn_rate_rps
            for movement in self.movements
            if movement.speed_mps > 0.0
            and (movement.pitch_rate_rps == 0.0)
            and movement.yaw_rate_rps
        ]
        return min(radii, default=float("inf"))

    @cached_property
    def _level_ends(self) -> FloatArray:
        """[n, 6] where the movements end that may be flown from level flight."""
        level = np.zeros(6)
        ends = [self.predict(level, m) for m in self.movements if self.allowed(level, m)]
        return np.array(ends).reshape(-1, 6)

    @cached_property
    def stays_level(self) -> bool:
        """Whether no movement leads out of level flight: its height is not the vehicle's choice."""
        return bool(np.all(np.abs(self._level_ends[:, 2:5]) <= PITCH_TOLERANCE_RAD))

    @cached_property
    def steepest_rad(self) -> float | None:
        """Steepest way up or down: the pitch limit, or a movement that climbs steeper by itself.

        None without a pitch limit.
        """
        if self.pitch_limit_rad is None:
            return None
        level_m = np.hypot(self._level_ends[:, 0], self._level_ends[:, 1])
        climbs = np.arctan2(np.abs(self._level_ends[:, 2]), level_m)
        return max(self.pitch_limit_rad, float(climbs.max(initial=0.0)))

    @cached_property
    def step_m(self) -> float:
        """Longest way from start to end of a movement in level flight."""
        level = np.zeros(6)
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

    def chain(self, names: Iterable[str]) -> tuple[Movement, ...]:
        """Movements by name, in order."""
        return tuple(self[name] for name in names)

    def fly(
        self,
        state: npt.ArrayLike,
        legs: Iterable[tuple[Movement, float]],
        step_s: float = 0.05,
        start_s: float = 0.0,
    ) -> Trajectory:
        """Predicted path of movements held for given durations, one after the other: (4.8), (4.16).

        States (3.3) lie at most `step_s` apart, with one at the end of each leg.
        """
        at = np.array(state, dtype=np.float64)
        time, times, states, names = start_s, [start_s], [at], []
        for movement, duration in legs:
            steps = max(1, int(np.ceil(duration / step_s - 1e-9)))
            for elapsed in duration * np.arange(1, steps + 1) / steps:
                times.append(time + float(elapsed))
                states.append(self.predict(at, movement, float(elapsed)))
            at, time = states[-1], times[-1]
            names.append(movement.name)
        return Trajectory(np.array(times), np.array(states), tuple(names))

    def rollout(
        self, state: npt.ArrayLike, names: Iterable[str], step_s: float = 0.05
    ) -> Trajectory:
        """Predicted path of whole movements by name, from time 0."""
        legs = [(movement, movement.duration_s) for movement in self.chain(names)]
        return self.fly(state, legs, step_s)


def _key(angle_rad: float) -> int:
    """Equal for angles that differ by rounding only."""
    return round(angle_rad * 1e9)
