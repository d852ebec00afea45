"""A decision that is past: all that is reported of it, in a fraction of the memory.

Most of what a decision was derived from is the returns that it kept clear of: hundreds of
kilobytes. Of a past one they are merged in voxels. Evidence is packed without loss. What follows
from it, from the own state estimate and from the map is worked out again when somebody asks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NoReturn

from clearway.avoidance.choose.chosen import NOTHING_TRIED, Choice
from clearway.avoidance.clear.hazards import Hazards, MovingHazards, PointBins, PointHazards
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.rate.fusion import CellAssessment, Evidence, assess_cells
from clearway.avoidance.rate.reach_rating import ReachAssessment, rate_reach_set
from clearway.base.brief import brief
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.lazily import Lazily
from clearway.base.packed import PackedArrays, PackedVoxels
from clearway.obstacles.obstacle import Shapes

VOXELS_IN_RANGE = 50
"""Voxels along the range of the grid that seen points are merged in."""
SMALL_BYTES = 40_000
"""Cells, ratings, bins and whatever else a whole decision holds however little was seen."""
OF_RETURNS = 2.3
"""Returns are held as they are, and sorted by place with their numbers."""
OF_PATHS = 2.0
"""Paths that no reach set shares, since wind or tilt have changed them, come with ends and costs of
their own."""


class PastHazards(Hazards):
    """What a past decision kept clear of, but for the returns."""

    def __init__(
        self, time_s: float, shapes: Callable[[], Shapes], moving: MovingHazards, left_out_m: float
    ) -> None:
        self.__dict__.update(time_s=time_s, again=shapes, moving=moving, left_out_m=left_out_m)

    @property
    def shapes(self) -> Shapes:
        """Worked out again from the map."""
        found: Shapes = self.__dict__["again"]()
        return found

    @property
    def points(self) -> PointHazards:
        """Not kept: raises ClearwayError."""
        self._refuse()

    @property
    def bins(self) -> PointBins:
        """Not kept: raises ClearwayError."""
        self._refuse()

    def __repr__(self) -> str:
        return "PastHazards"

    def _refuse(self) -> NoReturn:
        raise ClearwayError(
            f"decision at {self.__dict__['time_s']:g} s: its single returns are not kept, since a "
            "long flight would fill the memory; `decision.seen_m` has them merged in voxels. For "
            "all of them look at each decision when it is taken: fly(..., on_decision=...)"
        )


@dataclass(frozen=True, eq=False)
class PastGrounds:
    """What a past choice was made from; each is made anew at every call."""

    planner: Planner
    evidence: PackedArrays
    found_again: Callable[[], PreparedReachSet]
    hazards: PastHazards
    seen: PackedVoxels

    __repr__ = brief

    @property
    def prepared(self) -> PreparedReachSet:
        """What could be flown."""
        return self.found_again()

    @property
    def cells(self) -> CellAssessment:
        """What was known of the cells."""
        planner, settings = self.planner, self.planner.settings
        evidence = Evidence(planner.grid, *self.evidence.unpack())
        return assess_cells(
            evidence, planner.cell_rating, settings.unknown, settings.unknown_unseen
        )

    @property
    def reach(self) -> ReachAssessment:
        """How trajectories were rated."""
        threshold = self.planner.threshold
        return rate_reach_set(self.prepared.reach_set, self.cells.rating, threshold)

    @property
    def seen_m(self) -> FloatArray:
        """[n, 3] middles of the voxels of the world that hold returns."""
        return self.seen.centers_m()


def past(decision: Decision) -> Decision:
    """The same decision with little memory: equal in all that is reported of it but single
    returns."""
    if not isinstance(decision.hazards, PastHazards):
        found, evidence, hazards = decision.found_again, decision.cells.evidence, decision.hazards
        planner = found.planner
        grounds = PastGrounds(
            planner,
            PackedArrays.of(
                evidence.detected,
                evidence.visibility,
                evidence.map_base,
                evidence.intruder,
                evidence.coated,
                evidence.seen,
            ),
            found.prepare_reach_set,
            PastHazards(decision.state.time_s, found.shapes, hazards.moving, hazards.left_out_m),
            PackedVoxels.of(decision.seen_m, planner.grid.range_m / VOXELS_IN_RANGE),
        )
        speed = decision.speed
        decision = replace(
            decision,
            choice=_past_choice(decision.choice, grounds),
            way_out=_past_way(decision.way_out),
            ways=None,
        )
        decision.__dict__["speed"] = speed
    return decision


def _past_choice(choice: Choice, grounds: PastGrounds) -> Choice:
    """The same choice; what is reported of it is worked out while what it was made from is at
    hand."""
    told = replace(choice, grounds=grounds, tried=NOTHING_TRIED)
    told.__dict__.update({name: getattr(choice, name) for name in Choice.TOLD})
    return told


def _past_way(way: WayOut | None) -> WayOut | None:
    """The same escape, with its places instead of what they were worked out from."""
    if way is None:
        return None
    return replace(way, leads=partial(_only, PackedArrays.of(way.path_m)))


def _only(packed: PackedArrays) -> FloatArray:
    (array,) = packed.unpack()
    return array


def bytes_of(decision: Decision) -> int:
    """About how many bytes a decision holds as long as it is kept whole."""
    points, paths = decision.hazards.points, decision.prepared.paths
    returns = points.position_m.nbytes + points.radius_m.nbytes
    sets = decision.found_again.planner.prepared_sets
    made = sets.iterate_made() if isinstance(sets, Lazily) else sets
    shared = any(paths is one.paths for _, one in made)
    own = 0 if shared else paths.samples_m.nbytes + paths.sagitta_m.nbytes
    return SMALL_BYTES + int(OF_RETURNS * returns + OF_PATHS * own)
