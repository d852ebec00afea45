"""Multirotors: level flight ahead, climb and yaw, each by itself; standing still is a movement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray


@dataclass(frozen=True)
class InertialessModel:
    """Speed ahead along the heading, rate of climb, and rates of turn: what an autopilot holds.

    x' = v cos(yaw), y' = v sin(yaw), z' = c, and constant rates of roll, pitch and yaw. The path
    depends on neither roll nor pitch: tilting is how the vehicle flies, not where to. Speeds change
    at once where one movement follows another; a real vehicle overshoots a stop by up to
    v^2 / (2 a) at a deceleration a, which is for the margin to cover.
    """

    def advance(self, state: npt.ArrayLike, inputs: npt.ArrayLike, duration_s: float) -> FloatArray:
        """State [6] x, y, z, roll, pitch, yaw after `duration_s` of constant inputs.

        inputs: speed (m/s), roll, pitch and yaw rates (rad/s) [4], and rate of climb (m/s) [5];
        none is 0. Exact for any duration: an arc, or a helix. Raises ClearwayError for other
        numbers of inputs.
        """
        x, y, z, roll, pitch, yaw = np.asarray(state, dtype=np.float64).tolist()
        held = np.asarray(inputs, dtype=np.float64).tolist()
        if len(held) not in (4, 5):
            raise ClearwayError(f"inertialess: 4 or 5 inputs are needed, got {len(held)}")
        speed, roll_rate, pitch_rate, yaw_rate = held[:4]
        climb = held[4] if len(held) > 4 else 0.0
        half_turn = 0.5 * yaw_rate * duration_s
        # A chord of the arc: numpy's sinc has a factor of pi.
        chord = speed * duration_s * float(np.sinc(half_turn / np.pi))
        return np.array(
            [
                x + chord * np.cos(yaw + half_turn),
                y + chord * np.sin(yaw + half_turn),
                z + climb * duration_s,
                roll + roll_rate * duration_s,
                pitch + pitch_rate * duration_s,
                yaw + yaw_rate * duration_s,
            ]
        )
