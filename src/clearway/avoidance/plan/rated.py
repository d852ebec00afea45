"""What is around, and how safe all that can be flown is: what a choice is made from."""

from __future__ import annotations

from typing import NamedTuple

from clearway.avoidance.clear.hazards import Hazards
from clearway.avoidance.plan.evidence import InReach
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.rate.fusion import CellAssessment
from clearway.avoidance.rate.reach_rating import ReachAssessment
from clearway.base.brief import brief
from clearway.base.frames import FloatArray


class Rated(NamedTuple):
    """All that can be flown from here, rated, and all that it must keep clear of."""

    prepared: PreparedReachSet
    near: InReach
    cells: CellAssessment
    reach: ReachAssessment

    def __repr__(self) -> str:
        return brief(self)

    @property
    def hazards(self) -> Hazards:
        """What it must keep clear of, in the grid frame."""
        return self.near.hazards

    @property
    def seen_m(self) -> FloatArray:
        """[n, 3] places of the returns among the hazards, world frame."""
        return self.near.frame.world_points(self.hazards.points.position_m)

    def clear_of(self, hazards: Hazards) -> Rated:
        """The same, to be kept clear of other hazards."""
        return self._replace(near=self.near._replace(hazards=hazards))
