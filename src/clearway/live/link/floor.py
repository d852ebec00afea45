"""How low a link may lead the vehicle: what the mission says, else the ground plus the margin."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray


@dataclass(frozen=True, slots=True)
class FloorRule:
    """What is known of the floor before the link is."""

    margin_m: float
    """Kept from the ground where the mission says nothing else."""
    told_m: float | None = None
    """By the mission; world frame."""
    terrain: bool = False
    """Whether the ground is on the map, with the margin kept from it as from all else."""
    stays_level: bool = False
    """Whether the vehicle never changes its height."""

    def height_m(self, ground_m: float | None) -> float:
        """The floor, world frame; -inf where there is none. ground_m: of the home, once known."""
        if self.told_m is not None:
            return self.told_m
        if ground_m is None or self.stays_level or self.terrain:
            return -math.inf
        return ground_m + self.margin_m

    def refusal(
        self, ground_m: float | None, goals_m: FloatArray, reach_radius_m: float
    ) -> str | None:
        """Why the vehicle may not be led, in words and numbers; None if it may."""
        if self.stays_level:
            return None
        floor = self.height_m(ground_m)
        if not math.isfinite(floor):
            if self.terrain:
                return None
            return (
                f"no floor: it may pitch, and neither the home's height (HOME_POSITION, relative "
                f"altitude) nor [rules] floor_m nor terrain says where the ground is, from which "
                f"{self.margin_m:g} m are to be kept"
            )
        low = np.flatnonzero(goals_m[:, 2] < floor - 0.5 * reach_radius_m)
        if not len(low):
            return None
        number, height = int(low[0]) + 1, float(goals_m[low[0], 2])
        why = "[rules] floor_m" if self.told_m is not None else (
            f"home at {ground_m:.1f} m and a margin of {self.margin_m:g} m"
        )  # fmt: skip
        return f"goal {number} at {height:.1f} m is below the floor of {floor:.1f} m ({why})"
