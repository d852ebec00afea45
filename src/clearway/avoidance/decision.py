"""What a decision comes to: what to fly and why, with everything that it was derived from."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from clearway.avoidance.choose.chosen import Basis, Choice
from clearway.avoidance.choose.from_here import FromHere
from clearway.avoidance.choose.passing import Passing
from clearway.avoidance.clear.hazards import Hazards
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.long_range.resolve import LongRangeChoice
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.situation import CALM
from clearway.avoidance.rate.fusion import CellAssessment
from clearway.avoidance.rate.goal import Goal
from clearway.avoidance.rate.reach_rating import ReachAssessment
from clearway.avoidance.speed_choice import SpeedChoice, SpeedTerms, explain_speed
from clearway.base.brief import one_line, runs
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.state import State


@dataclass(frozen=True, eq=False)
class Decision:
    """What to fly and why, with everything that it was derived from.

    >>> import numpy as np
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> ahead = cw.Situation(cw.State(np.zeros(3)), target_m=np.array([20.0, 0.0, 0.0]))
    >>> decision = cw.decide(cw.Planner.of(library), ahead)
    >>> decision.movements[0], decision.path_m.shape[1], decision.margin_m
    ('Straight', 3, 0.6)
    """

    state: State
    choice: Choice
    movements: tuple[str, ...]
    """The movement buffer to execute."""
    goal: Goal
    margin_m: float
    found_again: FromHere
    """Where it was taken, and by whom."""
    decide_within_s: float
    """Latest moment for the next decision: later, the vehicle could no longer turn away."""
    intruders: tuple[str, ...] = ()
    """Names of the moving in `hazards`."""
    passings: tuple[Passing, ...] = ()
    """Which of them are being passed, and on which side."""
    way_out: WayOut | None = None
    """What is flown from the end of the first movement on if no later decision finds better."""
    no_way_out: tuple[str, ...] = ()
    """First movements after which no escape was found."""
    wind_mps: FloatArray = field(default_factory=lambda: CALM)
    """[3] wind that was reckoned with, world frame."""
    long_range: LongRangeChoice | None = None
    """What it comes to in the next minute: side, sense, speed and reason; None where no volumes are
    kept, or nothing is reported."""
    under_way_s: float | None = None
    """What is left of the first movement, where a decision in the middle of one finds nothing
    better than to finish it and fly the escape; else None."""
    ways: WaysOut | None = field(default=None, repr=False)
    """What looked for escapes, of a vehicle with inertia: tells later why it was no faster. Past
    decisions do not keep it."""

    @property
    def cells(self) -> CellAssessment:
        """What was known of every cell."""
        return self.choice.grounds.cells

    @property
    def reach(self) -> ReachAssessment:
        """How trajectories were rated."""
        return self.choice.grounds.reach

    @property
    def prepared(self) -> PreparedReachSet:
        """What could be flown."""
        return self.choice.grounds.prepared

    @property
    def hazards(self) -> Hazards:
        """What it keeps clear of, in the grid frame. Of past decisions of a long flight the single
        returns are not kept: to ask for these raises ClearwayError."""
        return self.choice.grounds.hazards

    @property
    def seen_m(self) -> FloatArray:
        """[n, 3] places of the returns that it keeps clear of, world frame; of past decisions of a
        long flight the middles of the voxels that hold them."""
        return self.choice.grounds.seen_m

    @property
    def escapes(self) -> bool:
        """Whether the escape is what is flown now."""
        return self.choice.basis is Basis.WAY_OUT

    @property
    def goes_narrow(self) -> bool:
        """Whether it leads, as the mission allows, where there is no escape."""
        return self.choice.basis is Basis.NARROW

    @cached_property
    def path_m(self) -> FloatArray:
        """[points, 3] planned path, world frame, from the vehicle's position."""
        reach_set = self.prepared.reach_set
        along = reach_set.samples_m[reach_set.path(self.choice.node)].reshape(-1, 3)
        path = np.zeros((len(along) + 1, 3))
        path[1:] = along
        return self.frame.world_points(path)

    @property
    def tube_m(self) -> FloatArray:
        """[points] within how far of `path_m` the vehicle is to be expected: def. 13.

        0 where nothing was measured of how far flights stray from predictions.
        """
        tube = self.prepared.tube_m
        if tube is None:
            return np.zeros(len(self.path_m))
        ends = np.concatenate([[0.0], tube[self.prepared.reach_set.path(self.choice.node)]])
        samples = self.prepared.reach_set.samples_m.shape[1]
        at = np.arange(len(self.path_m)) / samples
        radii: FloatArray = np.interp(at, np.arange(len(ends)), ends)
        return radii

    @property
    def way_out_path_m(self) -> FloatArray:
        """[points, 3] the escape from where it begins, up to the end of its first round, world
        frame; none where there is no escape."""
        way = self.way_out
        if way is None or not len(way.path_m):
            return np.zeros((0, 3))
        if self.under_way_s is not None:
            return np.concatenate([self.state.position_m[None], way.path_m])
        reach_set = self.prepared.reach_set
        first = reach_set.path(self.choice.node)[0]
        begins = self.frame.world_points(reach_set.samples_m[first, -1:])
        return np.concatenate([begins, way.path_m])

    @cached_property
    def speed(self) -> SpeedChoice | None:
        """Speeds of the plan and what limits them; None of a vehicle without inertia."""
        if self.ways is None:
            return None
        return explain_speed(
            SpeedTerms(
                self.found_again.planner.automaton,
                self.state,
                self.movements,
                self.choice,
                self.escapes or self.under_way_s is not None,
                self.ways,
                self.no_way_out,
                self.goal,
            )
        )

    @cached_property
    def frame(self) -> GridFrame:
        """Where the avoidance grid sits."""
        return GridFrame.of(self.state)

    def __repr__(self) -> str:
        return one_line("Decision", (runs(self.movements), *self._facts.values()))

    def _repr_html_(self) -> str:
        """For notebooks: what is flown and why; plan, escape and returns from above."""
        marks = [
            Marks(self.seen_m, "#c0392b", joined=False),
            Marks(self.way_out_path_m, "#088c82", dashed=True),
            Marks(self.path_m, "#d62728"),
        ]
        facts = self._facts | self._ways
        return html_table(runs(self.movements), facts, sketch_from_above(marks))

    @property
    def _facts(self) -> dict[str, str]:
        choice = self.choice
        return {
            "clearance": f"{choice.clearance_m:.2f} m clear of {self.margin_m:.2f} m asked",
            "rating": f"rating {choice.rating:.3f}",
            "basis": str(choice.basis),
        }

    @property
    def _ways(self) -> dict[str, str]:
        """What notebooks tell of escapes; nothing where none is asked for."""
        told = {}
        if self.way_out is not None:
            way, round_ = self.way_out, f"then {runs(self.way_out.loop)} again and again"
            kept = f"{way.margin_m:.2f} m clear"
            unsure = "" if way.certain else ", through unobserved space"
            if way.unobserved_m > 0.0:
                unsure = f", {way.unobserved_m:.1f} m of it through unobserved space"
            begins = f"{runs(way.begins)}, " if way.begins else ""
            told["escape (dashed)"] = f"{begins}{round_}; {kept}{unsure}"
        if self.no_way_out:
            told["no escape after"] = ", ".join(self.no_way_out)
        return told
