"""What is known of one intruder (5.1): its motion, its size, and how far to trust both."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

import numpy as np

from clearway.base.brief import brief
from clearway.base.checks import collect_problems, number_problem, time_problem, vector_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import State, freeze_three

_VECTORS = (("position_m", 3), ("velocity_mps", 3), ("spread_rad", 2))
"""What is kept as a frozen array, and of how many numbers."""
_LARGEST_SPREAD = 0.5 * math.pi


def _freeze_spread(values: Any) -> FloatArray | None:
    """A read-only copy of two angles within [0, 90) degrees; else None."""
    try:
        spread = np.array(values, dtype=np.float64)
        horizontal, vertical = spread.tolist()
        if not (0.0 <= horizontal < _LARGEST_SPREAD and 0.0 <= vertical < _LARGEST_SPREAD):
            return None
    except (TypeError, ValueError, OverflowError):
        return None
    spread.setflags(write=False)
    return spread


@dataclass(frozen=True, slots=True, eq=False)
class Intruder:
    """One intruder at a time, flying straight on as far as is known (5.1).

    Position and velocity are in the world frame where reports, missions and tracks keep them, and
    in the grid's frame after `see_from`, which is what the intersection models take.

    Raises
    ------
    InputError
        Naming every value that cannot be used.

    Examples
    --------
    >>> import clearway as cw
    >>> other = cw.Intruder([100.0, 0.0, 0.0], [-20.0, 0.0, 0.0], name="other")
    >>> other.speed_mps, other.at(2.0).position_m.tolist()
    (20.0, [60.0, 0.0, 0.0])
    """

    position_m: FloatArray
    """[3] at `time_s`."""
    velocity_mps: FloatArray
    """[3] zero for an intruder that hovers."""
    _: KW_ONLY
    spread_rad: FloatArray = field(default_factory=lambda: np.zeros(2))
    """[2] horizontal and vertical half-angle of its uncertainty, each in [0, pi/2)."""
    radius_m: float = 0.0
    """Body radius."""
    name: str = ""
    time_s: float = 0.0
    """Time that position and velocity hold for."""
    position_std_m: float = 0.0
    """Standard deviation of the position, per axis."""
    velocity_std_mps: float = 0.0
    """Standard deviation of the velocity, per axis."""
    acceleration_bound_mps2: float | None = None
    """Largest acceleration it may show; None where no bound is known."""
    address: str = ""
    """Transponder address, empty where unknown."""
    manoeuvre_mps2: float = 0.0
    """Acceleration that it has shown, and may show again any way at no more than its speed."""

    __repr__ = brief

    def __post_init__(self) -> None:
        # Every report makes one: what is in order is gone through once.
        position, velocity = freeze_three(self.position_m), freeze_three(self.velocity_mps)
        spread, numbers = _freeze_spread(self.spread_rad), self._number_problems()
        if position is None or velocity is None or spread is None or numbers:
            named = f"intruder {self.name or self.address or '?'}"
            raise InputError(named, self._vector_problems() + numbers)
        object.__setattr__(self, "position_m", position)
        object.__setattr__(self, "velocity_mps", velocity)
        object.__setattr__(self, "spread_rad", spread)

    def _number_problems(self) -> list[str]:
        bound = self.acceleration_bound_mps2
        return collect_problems(
            (
                time_problem("time_s", self.time_s),
                number_problem("radius_m", self.radius_m),
                number_problem("position_std_m", self.position_std_m),
                number_problem("velocity_std_mps", self.velocity_std_mps),
                number_problem("manoeuvre_mps2", self.manoeuvre_mps2),
                None if bound is None else number_problem("acceleration_bound_mps2", bound),
            )
        )

    def _vector_problems(self) -> list[str]:
        problems = collect_problems(
            vector_problem(key, getattr(self, key), n) for key, n in _VECTORS
        )
        if not any(problem.startswith("spread_rad") for problem in problems):
            horizontal, vertical = np.asarray(self.spread_rad, dtype=np.float64).tolist()
            if not (0.0 <= horizontal < _LARGEST_SPREAD and 0.0 <= vertical < _LARGEST_SPREAD):
                degrees = np.degrees([horizontal, vertical]).tolist()
                problems.append(f"spread: must be within [0, 90) degrees, got {degrees} degrees")
        return problems

    @property
    def speed_mps(self) -> float:
        return math.sqrt(self.velocity_mps.dot(self.velocity_mps))

    def at(self, time_s: float) -> Intruder:
        """Predict the intruder to a time, straight on (5.1), its deviations grown.

        A time before `time_s` is predicted backwards: the motion is linear, and the uncertainty
        grows either way.

        Parameters
        ----------
        time_s
            On the clock of the report.

        Returns
        -------
        Intruder
            In the same frame.
        """
        elapsed = time_s - self.time_s
        return self._with(
            position_m=self.position_m + self.velocity_mps * elapsed,
            position_std_m=math.hypot(self.position_std_m, self.velocity_std_mps * elapsed),
            time_s=time_s,
        )

    def see_from(self, state: State) -> Intruder:
        """Return the intruder in the body frame of a state: the frame of the avoidance grid.

        Parameters
        ----------
        state
            Of the own vehicle, world frame.

        Returns
        -------
        Intruder
            At the same time.
        """
        world_from_body = state.world_from_body
        return self._with(
            position_m=(self.position_m - state.position_m) @ world_from_body,
            velocity_mps=self.velocity_mps @ world_from_body,
        )

    def move(
        self,
        position_m: FloatArray,
        velocity_mps: FloatArray,
        position_std_m: float,
        time_s: float,
    ) -> Intruder:
        """Return the intruder at another time or in another frame, of numbers that follow from it.

        Parameters
        ----------
        position_m
            [3] in the new frame.
        velocity_mps
            [3] in the new frame.
        position_std_m
            Standard deviation of the position, per axis.
        time_s
            Time that these hold for.

        Returns
        -------
        Intruder
            Of these values, which are not checked again.
        """
        return self._with(
            position_m=position_m,
            velocity_mps=velocity_mps,
            position_std_m=position_std_m,
            time_s=time_s,
        )

    def _with(self, **changed: FloatArray | float) -> Intruder:
        """What follows from a checked intruder, without another check: decisions make many."""
        follows = object.__new__(Intruder)
        for key, slot in _SLOTS:
            slot.__set__(follows, changed[key] if key in changed else slot.__get__(self))
        for value in changed.values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        return follows


_SLOTS: tuple[tuple[str, Any], ...] = tuple(
    (key, getattr(Intruder, key)) for key in Intruder.__slots__
)
"""Each field's name and where it is kept."""


def up_seen_from(state: State) -> FloatArray:
    """World up [3] in the body frame of a world state, for the spread's level axis."""
    up: FloatArray = state.world_from_body[2]
    return up
