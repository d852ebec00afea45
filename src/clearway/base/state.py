"""Frozen values that the rooms hand to each other; shapes, units and frames at each field."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import BoolArray as BoolArray
from clearway.base.arrays import FloatArray
from clearway.base.arrays import IndexArray as IndexArray
from clearway.base.arrays import IntArray as IntArray
from clearway.base.brief import brief
from clearway.base.checks import (
    LARGEST,
    collect_problems,
    number_problem,
    take_floats,
    time_problem,
    vector_problem,
)
from clearway.base.errors import InputError
from clearway.base.frames import compute_rotation

MOST_RAD = 1e6
"""No attitude is turned farther, be it counted on from turn to turn."""


def freeze_array(values: npt.ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """A read-only float64 copy of `values`; raises ValueError if it has not that shape."""
    array = np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"expected shape {shape}, got {array.shape}")
    array.setflags(write=False)
    return array


def freeze_three(values: npt.ArrayLike, largest: float = LARGEST) -> FloatArray | None:
    """A read-only copy of what `vector_problem` finds nothing wrong with; else None."""
    try:
        array = np.array(values, dtype=np.float64)
        x, y, z = array.tolist()
        if not (abs(x) <= largest and abs(y) <= largest and abs(z) <= largest):
            return None
    except (TypeError, ValueError, OverflowError):
        return None
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Own state estimate of the vehicle (4.1), world frame, with what is known of its accuracy.

    Raises
    ------
    InputError
        Naming every value that cannot be used: not finite, out of range, or a deviation below 0,
        by which some say "unknown".

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> cw.State(np.array([1.0, 2.0, 30.0]), [0.0, 0.0, np.pi / 2]).world_from_body.shape
    (3, 3)
    """

    position_m: FloatArray
    """[3] world frame."""
    attitude_rad: FloatArray = field(default_factory=lambda: np.zeros(3))
    """[3] roll, pitch (nose down positive), yaw (left positive)."""
    _: KW_ONLY
    time_s: float = 0.0
    position_std_m: float = 0.0
    attitude_std_rad: float = 0.0
    velocity_mps: FloatArray | None = None
    """[3] world frame, where it is reported; of a vehicle with inertia it picks the class."""

    __repr__ = brief

    def __post_init__(self) -> None:
        # Every reading and every decision makes some: what is in order is gone through once.
        position = freeze_three(self.position_m)
        attitude = freeze_three(self.attitude_rad, MOST_RAD)
        numbers = collect_problems(
            (
                time_problem("time_s", self.time_s),
                number_problem("position_std_m", self.position_std_m),
                number_problem("attitude_std_rad", self.attitude_std_rad),
            )
        )
        velocity = None if self.velocity_mps is None else freeze_three(self.velocity_mps)
        is_unusable = self.velocity_mps is not None and velocity is None
        if position is None or attitude is None or is_unusable or numbers:
            places = collect_problems(
                (
                    vector_problem("position_m", self.position_m, 3),
                    vector_problem("attitude_rad", self.attitude_rad, 3, MOST_RAD),
                    vector_problem("velocity_mps", self.velocity_mps, 3) if is_unusable else None,
                )
            )
            raise InputError("state estimate", places + numbers)
        object.__setattr__(self, "position_m", position)
        object.__setattr__(self, "attitude_rad", attitude)
        object.__setattr__(self, "velocity_mps", velocity)
        take_floats(self, State)

    @property
    def vector(self) -> FloatArray:
        """[6] x, y, z, roll, pitch, yaw."""
        return np.concatenate([self.position_m, self.attitude_rad])

    @property
    def world_from_body(self) -> FloatArray:
        """[3, 3] rotation (3.37)."""
        return compute_rotation(*self.attitude_rad.tolist())


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """A flown or planned path (3.12): states at times, and the movements that make it."""

    time_s: FloatArray
    """[n] ascending."""
    states: FloatArray
    """[n, 6] world frame: x, y, z, roll, pitch, yaw (4.13)."""
    movements: tuple[str, ...] = ()
    """Names of the movements in the buffer, in order."""

    __repr__ = brief
