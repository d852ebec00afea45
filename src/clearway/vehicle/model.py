"""Vehicles: how a state moves under constant inputs. `PlaneModel` is (4.4), integrated exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled, read_only
from clearway.base.frames import FloatArray

StateTuple = tuple[float, float, float, float, float, float]


@runtime_checkable
class Vehicle(Protocol):
    """What a movement automaton needs of a vehicle: a controlled system, (3.1) and (3.2).

    Reach sets are built once and turned about the vertical, so the motion must not depend on
    position or yaw; it may depend on roll and pitch.
    """

    def advance(self, state: npt.ArrayLike, inputs: npt.ArrayLike, duration_s: float) -> FloatArray:
        """State [6] (4.1) after holding inputs (4.2) for a duration; world frame, radians.

        inputs: [4], or [5] of movements with a rate of climb.
        """
        ...


@dataclass(frozen=True)
class PlaneModel:
    """The simple plane model (4.4): speed along the nose, and constant turn rates."""

    def advance(self, state: npt.ArrayLike, inputs: npt.ArrayLike, duration_s: float) -> FloatArray:
        """State [6] x, y, z, roll, pitch, yaw after `duration_s` of constant inputs [4].

        Inputs are speed (m/s) and roll, pitch and yaw rates (rad/s). Exact for any duration.
        """
        x, y, z, roll, pitch, yaw = np.asarray(state, dtype=np.float64).tolist()
        speed, roll_rate, pitch_rate, yaw_rate = np.asarray(inputs, dtype=np.float64).tolist()
        return np.array(
            plane_advance(
                (x, y, z, roll, pitch, yaw),
                (speed, roll_rate, pitch_rate, yaw_rate),
                float(duration_s),
            )
        )

    def advance_each(
        self, state: npt.ArrayLike, inputs: npt.ArrayLike, durations_s: npt.ArrayLike
    ) -> FloatArray:
        """States [n, 6], one for each of some durations [n]: as `advance`, to the last bit."""
        x, y, z, roll, pitch, yaw = np.asarray(state, dtype=np.float64).tolist()
        speed, roll_rate, pitch_rate, yaw_rate = np.asarray(inputs, dtype=np.float64).tolist()
        return plane_advance_each(
            (x, y, z, roll, pitch, yaw),
            (speed, roll_rate, pitch_rate, yaw_rate),
            read_only(durations_s),
        )


@compiled
def plane_advance_each(
    state: StateTuple, inputs: tuple[float, float, float, float], durations_s: Floats
) -> Floats2:
    """States [n, 6] after each of some durations [n]: `plane_advance` of each."""
    way = np.empty((len(durations_s), 6))
    for n in range(len(durations_s)):
        at = plane_advance(state, inputs, durations_s[n])
        way[n, 0], way[n, 1], way[n, 2] = at[0], at[1], at[2]
        way[n, 3], way[n, 4], way[n, 5] = at[3], at[4], at[5]
    return way


@compiled
def _sinc(angle: float) -> float:
    """sin(a)/a, by its series where the quotient loses digits."""
    if abs(angle) < 1e-4:
        return 1.0 - angle * angle / 6.0
    return float(np.sin(angle) / angle)


@compiled
def plane_advance(
    state: StateTuple, inputs: tuple[float, float, float, float], duration_s: float
) -> StateTuple:
    """Closed form of (4.4) for constant inputs: the velocity (4.3), integrated.

    Products of cosines become sums, and the integral of cos(a + w t) over T is
    T sinc(w T / 2) cos(a + w T / 2), which holds for w = 0 too.
    """
    x, y, z, roll, pitch, yaw = state
    speed, roll_rate, pitch_rate, yaw_rate = inputs
    half = 0.5 * duration_s
    mean_pitch = pitch + pitch_rate * half
    mean_yaw = yaw + yaw_rate * half
    along = _sinc((yaw_rate - pitch_rate) * half)
    against = _sinc((yaw_rate + pitch_rate) * half)
    difference = mean_yaw - mean_pitch
    total = mean_yaw + mean_pitch
    reach = speed * half
    return (
        x + reach * (along * np.cos(difference) + against * np.cos(total)),
        y + reach * (along * np.sin(difference) + against * np.sin(total)),
        z - 2.0 * reach * _sinc(pitch_rate * half) * np.sin(mean_pitch),
        roll + roll_rate * duration_s,
        pitch + pitch_rate * duration_s,
        yaw + yaw_rate * duration_s,
    )
