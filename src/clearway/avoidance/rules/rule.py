"""What a rule sees and says, and what several of them add up to.

A rule forbids trajectories, or puts a cost on them. Safety comes first: a forbidden trajectory is
flown only where none that obeys keeps the margin, and then the one that breaks the least important
rules; the emergency rule knows no others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from clearway.avoidance.clear.hazards import MovingHazards, nothing_moving
from clearway.avoidance.rate.goal import Goal
from clearway.base.arrays import Floats, Int32s
from clearway.base.compiled import compiled, make_plain_array
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.state import BoolArray, IntArray, State
from clearway.obstacles.obstacle import Obstacle
from clearway.reach.tree import ReachSet

MOST_RULES = 32
"""Rules in one decision: which of them a trajectory breaks is one number."""


@dataclass(frozen=True, eq=False)
class RuleView:
    """What a decision lets its rules see; positions in the world frame unless said otherwise."""

    reach_set: ReachSet
    state: State
    """Expected own state estimate at the decision time."""
    goal: Goal
    """In the level frame."""
    route_m: FloatArray
    """[points, 3] the legs about now: where the last one began, the waypoint, the next one."""
    margin_m: float
    speed_mps: float
    moving: MovingHazards = field(default_factory=nothing_moving)
    """Intruders, in the grid frame."""
    dynamic_object_names: tuple[str, ...] = ()

    @cached_property
    def frame(self) -> GridFrame:
        """Where the avoidance grid sits."""
        return GridFrame.of(self.state)

    @property
    def world_from_grid(self) -> FloatArray:
        """[3, 3]"""
        return self.frame.world_from_grid

    @cached_property
    def samples_m(self) -> FloatArray:
        """[nodes, samples, 3] positions along all trajectories."""
        return self.frame.world_points(self.reach_set.samples_m)

    @cached_property
    def bearing_rad(self) -> float:
        """Azimuth of the waypoint from the own heading; 0 where it is too near to have one."""
        x, y, _ = self.goal.target_m
        return 0.0 if np.hypot(x, y) < self.goal.reach_radius_m else float(np.arctan2(y, x))

    @cached_property
    def course(self) -> FloatArray:
        """[3] level unit vector to the waypoint, in the grid frame."""
        pitch = self.reach_set.start_pitch_rad
        x, y = np.cos(self.bearing_rad), np.sin(self.bearing_rad)
        return np.array([np.cos(pitch) * x, y, np.sin(pitch) * x])

    def worst_on_way(self, values: FloatArray) -> FloatArray:
        """[nodes] largest of `values` [nodes] on the way to each node."""
        return worst_on_way(self.reach_set.parent, make_plain_array(np.asarray(values)))


@dataclass(frozen=True, eq=False)
class Verdict:
    """What an active rule says of the trajectories of a reach set."""

    reason: str
    """Why it is active, for the log."""
    forbidden: BoolArray | None = None
    """[nodes] the way to the node breaks the rule."""
    price_m: FloatArray | float = 0.0
    """[nodes] cost in metres of flight, 0 or more."""


RuleFunction = Callable[[RuleView], Verdict | None]
Depth = Callable[[FloatArray, FloatArray], FloatArray]
"""(places [n, 3], route [points, 3]) -> metres [n] on the wrong side; 0 or less: all is well."""


@dataclass(frozen=True)
class Rule:
    """A named rule; `verdict` returns None where it is not concerned."""

    name: str
    verdict: RuleFunction
    volumes: tuple[Obstacle, ...] = ()
    """Places that it is about, for pictures."""
    depth: Depth | None = None
    """Of places where it always forbids to fly: ways round keep out of them. None for no such."""


@dataclass(frozen=True)
class RuleNote:
    """What a rule did in a decision."""

    name: str
    reason: str
    forbidden: int
    """Candidates that it forbids."""
    broken: bool
    """Whether the chosen trajectory breaks it, for want of one that keeps the margin."""
    decided: bool
    """Whether, without the rules, what this one speaks against would have been flown."""


@dataclass(frozen=True, eq=False)
class Ruling:
    """The verdicts of all active rules, the most important first."""

    verdicts: tuple[tuple[str, Verdict], ...]
    broken: IntArray
    """[nodes] which rules the way to the node breaks, one bit each: the higher, the worse."""
    price_m: FloatArray
    """[nodes] sum of cost weights."""

    @property
    def speaks(self) -> bool:
        """Whether any rule forbids anything or adds a cost."""
        return bool(np.any(self.broken) or np.any(self.price_m))

    def deciding(self, without: int, chosen: int) -> str:
        """The rule that turned a decision from one node to another; none for the same one."""
        if without == chosen:
            return ""
        for name, verdict in self.verdicts:
            if verdict.forbidden is not None and verdict.forbidden[without]:
                return name
        saved = [
            (float(price[without] - price[chosen]), name)
            for name, verdict in self.verdicts
            if isinstance(price := verdict.price_m, np.ndarray)
        ]
        return max(saved, default=(0.0, ""))[1]

    def notes(self, candidates: IntArray, without: int, chosen: int) -> tuple[RuleNote, ...]:
        """What each active rule did, by nodes: candidates, the choice without rules, the choice."""
        decided = self.deciding(without, chosen)
        return tuple(
            RuleNote(
                name,
                verdict.reason,
                0 if verdict.forbidden is None else int(verdict.forbidden[candidates].sum()),
                verdict.forbidden is not None and bool(verdict.forbidden[chosen]),
                name == decided,
            )
            for name, verdict in self.verdicts
        )


def rule_on(rules: Sequence[Rule], view: RuleView) -> Ruling | None:
    """What the active ones of `rules`, most important first, say; None if none is active."""
    verdicts = [(rule.name, rule.verdict(view)) for rule in rules]
    active = tuple((name, verdict) for name, verdict in verdicts if verdict is not None)
    if not active:
        return None
    broken = np.zeros(view.reach_set.nodes, dtype=np.int64)
    price = np.zeros(view.reach_set.nodes)
    for place, (_, verdict) in enumerate(active):
        if verdict.forbidden is not None:
            broken += verdict.forbidden.astype(np.int64) << (len(active) - 1 - place)
        price += verdict.price_m
    return Ruling(active, broken, price)


@compiled
def worst_on_way(parent: Int32s, values: Floats) -> Floats:
    """[nodes] largest of `values` on the way to each node."""
    result = values.copy()
    for n in range(len(parent)):
        if parent[n] >= 0:
            result[n] = max(result[n], result[parent[n]])
    return result
