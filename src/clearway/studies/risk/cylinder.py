"""An upright cylinder about the ownship, and how evenly spread traffic enters it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder about the origin."""

    radius_m: float
    half_height_m: float

    def flux(self, velocity: FloatArray) -> float:
        """Volume swept a second by what enters with a velocity [3], in cubic metres.

        A rectangle as seen from the side, times the level speed, and a disc as seen from above,
        times the vertical one: traffic enters in proportion to it.
        """
        level, steep = float(np.hypot(velocity[0], velocity[1])), abs(float(velocity[2]))
        side = 4.0 * self.radius_m * self.half_height_m
        return side * level + np.pi * self.radius_m**2 * steep

    def entry(self, velocity: FloatArray, rng: np.random.Generator) -> FloatArray:
        """[3] where something of that velocity enters, drawn evenly over what it sees."""
        level, steep = float(np.hypot(velocity[0], velocity[1])), abs(float(velocity[2]))
        side = 4.0 * self.radius_m * self.half_height_m * level
        if rng.random() * (side + np.pi * self.radius_m**2 * steep) < side:
            off = self.radius_m * rng.uniform(-1.0, 1.0)
            back = -np.sqrt(self.radius_m**2 - off**2)
            ahead = velocity[:2] / level
            x, y = back * ahead + off * np.array([-ahead[1], ahead[0]])
            return np.array([x, y, self.half_height_m * rng.uniform(-1.0, 1.0)])
        radius, angle = self.radius_m * np.sqrt(rng.random()), 2.0 * np.pi * rng.random()
        end = -np.sign(velocity[2]) * self.half_height_m
        return np.array([radius * np.cos(angle), radius * np.sin(angle), end])
