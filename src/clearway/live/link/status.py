"""What a vehicle says of itself, as far as it concerns the program that leads it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class VehicleStatus:
    """Armed, in a mode that follows, in the air."""

    armed: bool
    follows: bool
    """Whether the mode follows set-points."""
    airborne: bool | None = None
    """None where the vehicle does not say."""

    def __str__(self) -> str:
        where = {True: "", False: ", on the ground", None: ""}[self.airborne]
        state = "armed" if self.armed else "disarmed"
        does = "follows set-points" if self.follows else "does not follow set-points"
        return f"{state}{where}, {does}"
