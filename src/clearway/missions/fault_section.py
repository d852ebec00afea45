"""`[faults]` of a mission file: what goes wrong with sensors and reports."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.io.toml import Section
from clearway.missions.sections import Share, values_for
from clearway.sim.faults import Faults


class FaultsSection(Section):
    """`[faults]`: faults that the vehicle does not know of."""

    range_bias_m: float = 0.0
    """Added to every range of every LiDAR: above 0, things seem farther than they are."""
    blind_deg: Annotated[tuple[float, float], Field(strict=False)] = (0.0, 0.0)
    """Azimuths [right, left], left positive, between which no beam returns."""
    dead_from_s: Annotated[float, Field(ge=0.0)] | None = None
    """Time from which no scan comes; default: never."""
    late_from_s: Annotated[float, Field(ge=0.0)] | None = None
    """Time from which on, for late_s, no decision comes; default: never."""
    late_s: Annotated[float, Field(ge=0.0)] = 0.0
    """For how long: the escape of the last decision is flown meanwhile."""
    report_loss: Share = 0.0
    """Share of reports of traffic that get lost."""
    spoofed: Share = 0.0
    """Share of reports that jump."""
    spoof_m: Annotated[float, Field(ge=0.0)] = 0.0
    """How far they jump, in a random direction."""
    own_position_sigma_m: Annotated[float, Field(ge=0.0)] = 0.0
    """Standard deviation of the own position, per axis, that its estimates do not state."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        right, left = self.blind_deg
        if not -180.0 <= right <= left <= 180.0:
            raise ValueError(
                f"blind_deg must be [right, left] within -180 to 180, got {[right, left]}"
            )
        return self

    def to_faults(self) -> Faults:
        right, left = np.radians(self.blind_deg)
        keys = values_for(Faults, self) | {
            "blind_from_rad": float(right),
            "blind_to_rad": float(left),
            "late_from_s": np.inf if self.late_from_s is None else self.late_from_s,
            "dead_from_s": np.inf if self.dead_from_s is None else self.dead_from_s,
        }
        return Faults(**keys)
