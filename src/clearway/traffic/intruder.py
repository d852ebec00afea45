"""What is known of one intruder (5.1): its motion, its size, and how far to trust both."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from clearway.base.brief import brief
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import State, frozen_array

LARGEST = 1e9
"""Nothing that is said in metres and seconds of an intruder is larger."""


@dataclass(frozen=True, slots=True, eq=False)
class Intruder:
    """One intruder at a time, flying straight on as far as is known (5.1).

    Position and velocity are in the world frame where reports, missions and tracks keep them, and
    in the grid's frame after `seen_from`, which is what the intersection models take. Raises
    InputError naming every value that cannot be used.
    """

    position_m: FloatArray
    """[3] at `time_s`."""
    velocity_mps: FloatArray
    """[3] zero for an intruder that hovers."""
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
        problems: list[str] = []
        for key, length in (("position_m", 3), ("velocity_mps", 3), ("spread_rad", 2)):
            try:
                array = frozen_array(getattr(self, key), (length,))
            except (TypeError, ValueError):
                problems.append(f"{key}: {length} numbers are needed, got {getattr(self, key)!r}")
                continue
            object.__setattr__(self, key, array)
            # Lists of three are checked faster without NumPy, and every decision checks many.
            numbers = array.tolist()
            if not all(abs(number) <= LARGEST for number in numbers):
                problems.append(f"{key}: must be finite numbers, at most 1e9, got {numbers}")
            elif key == "spread_rad" and not all(0.0 <= number < np.pi / 2 for number in numbers):
                degrees = np.degrees(array).tolist()
                problems.append(f"spread: must be within [0, 90) degrees, got {degrees} degrees")
        problems += self._scalar_problems()
        if problems:
            raise InputError(f"intruder {self.name or self.address or '?'}", problems)

    def _scalar_problems(self) -> list[str]:
        problems = []
        if not math.isfinite(self.time_s):
            problems.append(f"time_s: must be a finite number, got {self.time_s!r}")
        keys = ("radius_m", "position_std_m", "velocity_std_mps", "manoeuvre_mps2")
        for key in (*keys, "acceleration_bound_mps2"):
            value = getattr(self, key)
            if value is None and key == "acceleration_bound_mps2":
                continue
            if not 0.0 <= value <= LARGEST:
                problems.append(f"{key}: must be a number from 0 to 1e9, got {value!r}")
        return problems

    @property
    def speed_mps(self) -> float:
        return math.sqrt(self.velocity_mps.dot(self.velocity_mps))

    def at(self, time_s: float) -> Intruder:
        """The same intruder predicted to a time, straight on (5.1), its deviations grown.

        A time before `time_s` is predicted backwards: the motion is linear, and the uncertainty
        grows either way.
        """
        elapsed = time_s - self.time_s
        return self._with(
            position_m=self.position_m + self.velocity_mps * elapsed,
            position_std_m=math.hypot(self.position_std_m, self.velocity_std_mps * elapsed),
            time_s=time_s,
        )

    def seen_from(self, state: State) -> Intruder:
        """The intruder in the body frame of a world state: the frame of the avoidance grid."""
        world_from_body = state.world_from_body
        return self._with(
            position_m=(self.position_m - state.position_m) @ world_from_body,
            velocity_mps=self.velocity_mps @ world_from_body,
        )

    def moved(
        self,
        position_m: FloatArray,
        velocity_mps: FloatArray,
        position_std_m: float,
        time_s: float,
    ) -> Intruder:
        """The same intruder at another time or in another frame, of numbers that follow from it."""
        return self._with(
            position_m=position_m,
            velocity_mps=velocity_mps,
            position_std_m=position_std_m,
            time_s=time_s,
        )

    def _with(self, **changed: FloatArray | float) -> Intruder:
        """What follows from a checked intruder, without another check: decisions make many."""
        follows = object.__new__(Intruder)
        for key in self.__slots__:
            if key not in changed:
                object.__setattr__(follows, key, getattr(self, key))
        for key, value in changed.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(follows, key, value)
        return follows


def up_seen_from(state: State) -> FloatArray:
    """World up [3] in the body frame of a world state, for the spread's level axis."""
    up: FloatArray = state.world_from_body[2]
    return up
