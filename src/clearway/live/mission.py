"""Mission control (6.1): waypoints in order, modes, and what to do when there is no progress."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field, replace
from enum import StrEnum
from functools import cached_property

import numpy as np

from clearway.base.brief import brief, in_brief, one_line
from clearway.base.checks import (
    above_zero_problem,
    array_problem,
    check_points,
    collect_problems,
    kind_of,
    take_floats,
)
from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import IN_SPACE, LEVEL, FloatArray
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.state import State

NEARER = 0.1
"""Share of the reach radius by which a goal has come nearer, where that is progress."""
Detour = Callable[[FloatArray, FloatArray], tuple[FloatArray, ...]]
"""(position [3], target [3]) -> intermediate goals [3] each, in order; none if there is no way."""


class Mode(StrEnum):
    """What the vehicle is doing; `live.outputs.modes` says when."""

    NAVIGATION = "navigation"
    AVOIDANCE = "avoidance"
    ESCAPE = "escape"
    HOLD = "hold"
    NARROW = "narrow"
    EMERGENCY = "emergency"
    LANDING = "landing"


@dataclass(frozen=True, eq=False)
class Mission:
    """Ordered waypoints (6.1), flown from a start state, then the landing points.

    Raises
    ------
    InputError
        Naming every problem: a start that is no State, points that are no [n, 3], too few
        waypoints, numbers that are not finite, and neighbours closer than the reach radius.

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> cw.Mission("out", cw.State(np.zeros(3)), waypoints_m=np.array([[30.0, 0.0, 0.0]]))
    Mission('out', waypoints: 1, straight: 30 m, reached within: 1.5 m)
    """

    name: str
    start: State
    _: KW_ONLY
    waypoints_m: FloatArray
    """[n, 3] world frame; the first may be the start itself."""
    reach_radius_m: float = 1.5
    landing_m: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    """[n, 3] points of the landing sequence, flown after the last waypoint."""
    pass_within_m: float | None = None
    """A goal before the last also counts once it is abeam within this distance, so that nobody
    turns back for a waypoint that had to be passed at a distance."""

    def __post_init__(self) -> None:
        problems: list[str] = []
        taken = []
        try:
            kind_of("start", self.start, State)
        except ClearwayError as refused:
            problems.append(str(refused))
        for name in ("waypoints_m", "landing_m"):
            try:
                problems += self._take_points(name)
                taken.append(name)
            except ClearwayError as refused:
                problems.append(str(refused))
        reach = above_zero_problem("reach_radius_m", self.reach_radius_m)
        passing = None
        if self.pass_within_m is not None:
            passing = above_zero_problem("pass_within_m", self.pass_within_m)
        problems += collect_problems((reach, passing))
        if "waypoints_m" in taken and reach is None:
            problems += self._too_near()
        if problems:
            raise InputError(f"mission {self.name!r}", problems)
        take_floats(self, Mission)

    def _take_points(self, name: str) -> list[str]:
        """Lay a field out as points [n, 3], and what is wrong with these; raises ClearwayError for
        what is none."""
        points, problems = check_points(name, getattr(self, name)), []
        points.setflags(write=False)
        object.__setattr__(self, name, points)
        if name == "waypoints_m" and not len(points):
            problems.append(f"{name}: at least one waypoint is needed")
        if array_problem(name, points, (None, 3)):
            problems.append(f"{name}: coordinates must be finite numbers, at most 1e9")
        return problems

    def _too_near(self) -> list[str]:
        """Waypoints that count as reached with the one before."""
        problems = []
        with np.errstate(invalid="ignore", over="ignore"):  # What is not finite is named above.
            gaps = np.linalg.norm(np.diff(self.waypoints_m, axis=0), axis=1)
        for index in np.flatnonzero(gaps < self.reach_radius_m):
            problems.append(
                f"waypoints_m[{index + 1}]: {gaps[index]:.3g} m from the one before, "
                f"within the reach radius of {self.reach_radius_m:.3g} m"
            )
        return problems

    def __repr__(self) -> str:
        facts = (f"{name}: {value}" for name, value in self._facts.items())
        return one_line("Mission", (in_brief(self.name), *facts))

    def _repr_html_(self) -> str:
        """For notebooks: what it is, and the way from above."""
        corners = np.concatenate([self.start.position_m[None], self.goals_m])
        marks = [Marks(corners, "#9a9a9a"), Marks(self.goals_m, "#2e9e4f", joined=False, size=3.0)]
        return html_table(f"Mission {self.name}", self._facts, sketch_from_above(marks))

    @property
    def _facts(self) -> dict[str, str]:
        facts = {
            "waypoints": f"{len(self.waypoints_m)}",
            "straight": f"{self.straight_length_m:.4g} m",
            "reached within": f"{self.reach_radius_m:g} m",
        }
        return facts | ({"landing points": f"{len(self.landing_m)}"} if len(self.landing_m) else {})

    @cached_property
    def goals_m(self) -> FloatArray:
        """[n, 3] waypoints and then landing points."""
        return np.concatenate([self.waypoints_m, self.landing_m])

    @property
    def straight_length_m(self) -> float:
        """Length of the straight lines from the start through all waypoints."""
        points = np.concatenate([self.start.position_m[None], self.waypoints_m])
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a mission is; `advance_progress` makes the next one."""

    goal: int = 0
    """Index of the goal flown to; the number of goals when all are reached."""
    reached_s: tuple[float, ...] = ()
    """Times at which goals were reached."""
    nearest_m: float = np.inf
    """Smallest distance to the goal so far, since it became the goal or the last detour."""
    nearest_s: float = 0.0
    detour: tuple[FloatArray, ...] = ()
    """Intermediate goals before the goal."""
    detours: int = 0
    """Detours begun so far."""
    stuck_m: float | None = None
    """Distance to the goal at which going straight for it came to nothing; None before."""
    in_vain_s: float = 0.0
    """For how long what was flown led neither nearer to the goal nor along a way to it, since it
    last came nearer."""
    runs_up: bool = False
    """Whether the detour leads to where the goal, flown past before, is come to from."""
    planned_s: float = -np.inf
    """When the present detour was found, or what was seen was taken in last."""
    closed: bool = False
    """Whether no way leads to the goal as far as is seen: the vehicle stays where it is."""
    closed_s: float = -np.inf
    """When that began or ended; -inf where the route planner knows a way."""
    tried: int = 0
    """How often ways that came to nothing were tried once more, after staying."""

    __repr__ = brief

    def is_done(self, mission: Mission) -> bool:
        """Whether waypoints and landing points are all reached."""
        return self.goal >= len(mission.goals_m)

    def waypoints_reached(self, mission: Mission) -> int:
        return min(self.goal, len(mission.waypoints_m))

    def landing(self, mission: Mission) -> bool:
        """Whether the last waypoint is behind, so that the landing sequence runs."""
        return self.goal >= len(mission.waypoints_m)

    def target(self, mission: Mission) -> FloatArray:
        """[3] the point to fly to now."""
        if self.detour:
            return self.detour[0]
        goals = mission.goals_m
        return np.asarray(goals[min(self.goal, len(goals) - 1)])

    def find_left(self, mission: Mission) -> FloatArray:
        """[3] where the leg to the present goal began."""
        return mission.goals_m[self.goal - 1] if self.goal > 0 else mission.start.position_m

    def following(self, mission: Mission) -> FloatArray | None:
        """[3] the point after that; None at the end."""
        goals = mission.goals_m
        if len(self.detour) > 1:
            return self.detour[1]
        index = self.goal if self.detour else self.goal + 1
        return goals[index] if index < len(goals) else None


def advance_progress(
    mission: Mission,
    progress: Progress,
    position_m: FloatArray,
    time_s: float,
    *,
    stays_level: bool = False,
) -> Progress:
    """Progress after the vehicle has come to a position [3].

    stays_level: of a vehicle that cannot climb, whose goals count as reached by level distance.
    """
    counts = LEVEL if stays_level else IN_SPACE
    near_m = 2.0 * mission.reach_radius_m
    while progress.detour and _away_m(position_m, progress.detour[0], stays_level) <= near_m:
        progress = replace(progress, detour=progress.detour[1:])
    while not progress.is_done(mission):
        distance = _away_m(position_m, mission.goals_m[progress.goal], stays_level)
        passed = _is_passed(mission, progress.goal, position_m, counts)
        entered = progress.nearest_m <= mission.reach_radius_m  # Of a last landing point alone.
        if distance > mission.reach_radius_m and not passed and not entered:
            if distance < progress.nearest_m - NEARER * mission.reach_radius_m:
                return _nearer(progress, distance, time_s)
            return progress
        if _lands_last(mission, progress) and distance < progress.nearest_m:
            return _nearer(progress, distance, time_s)  # Until it comes no nearer.
        progress = replace(
            progress,
            goal=progress.goal + 1,
            reached_s=(*progress.reached_s, time_s),
            nearest_m=np.inf,
            nearest_s=time_s,
            in_vain_s=0.0,
            detour=(),
            stuck_m=None,
            closed=False,
            closed_s=-np.inf,
            tried=0,
        )
    return progress


def _lands_last(mission: Mission, progress: Progress) -> bool:
    """Whether the goal is the last landing point, at which the flight ends."""
    return len(mission.landing_m) > 0 and progress.goal == len(mission.goals_m) - 1


def news_in_m(
    mission: Mission, progress: Progress, position_m: FloatArray, *, stays_level: bool = False
) -> float:
    """Return how far a vehicle may fly from a position [3] before `advance_progress` has news.

    At most 0 where it may have now.
    """
    if progress.detour or progress.is_done(mission):
        return 0.0
    reach_m = mission.reach_radius_m
    next_m = max(reach_m, mission.pass_within_m or 0.0, progress.nearest_m - NEARER * reach_m)
    return _away_m(position_m, mission.goals_m[progress.goal], stays_level) - next_m


def _away_m(position_m: FloatArray, goal_m: FloatArray, level: bool) -> float:
    """Distance of a position [3] to a goal [3], in space or level."""
    (x, y, z), (goal_x, goal_y, goal_z) = position_m.tolist(), goal_m.tolist()
    dx, dy, dz = x - goal_x, y - goal_y, 0.0 if level else z - goal_z
    return math.sqrt(dx * dx + dy * dy + dz * dz)


def _nearer(progress: Progress, distance_m: float, time_s: float) -> Progress:
    """The progress of a vehicle that is nearer to its goal than before.

    Not by `replace`, which goes through all fields: it is made every few steps of a flight.
    """
    made = object.__new__(type(progress))
    news = {"nearest_m": distance_m, "nearest_s": time_s, "in_vain_s": 0.0}
    vars(made).update(vars(progress) | news)
    return made


def _is_passed(mission: Mission, goal: int, position_m: FloatArray, counts: FloatArray) -> bool:
    """Whether a goal lies abeam or behind, seen along the middle of the courses to and from it.

    counts: [3] 1 along the axes that count, else 0.
    """
    goals = mission.goals_m
    if mission.pass_within_m is None or goal + 1 >= len(goals):
        return False
    before = goals[goal - 1] if goal else mission.start.position_m
    beyond = (position_m - goals[goal]) * counts
    if float(np.linalg.norm(beyond)) > mission.pass_within_m:
        return False
    inbound, outbound = (goals[goal] - before) * counts, (goals[goal + 1] - goals[goal]) * counts
    course = inbound * float(np.linalg.norm(outbound)) + outbound * float(np.linalg.norm(inbound))
    return bool(beyond @ course > 0.0)


def is_without_progress(progress: Progress, time_s: float, no_progress_s: float) -> bool:
    """Whether the goal has not come nearer for too long.

    Every detour doubles the time until the next.
    """
    return time_s - progress.nearest_s > no_progress_s * 2.0 ** min(progress.detours, 6)


def begin_detour(
    mission: Mission,
    progress: Progress,
    state: State,
    time_s: float,
    turning_radius_m: float,
    detour: Detour,
) -> Progress:
    """Progress with a way round what stands between: known obstacles decide, else fly away.

    Without a known way the vehicle flies three turning radii off to one side and comes back.
    """
    target = mission.goals_m[progress.goal]
    points = detour(state.position_m, target)
    if not points:
        yaw = state.attitude_rad[2] + (0.5 * np.pi if progress.detours % 2 == 0 else -0.5 * np.pi)
        away = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        points = (state.position_m + 3.0 * turning_radius_m * away,)
    return replace(
        progress,
        detour=tuple(points),
        detours=progress.detours + 1,
        nearest_m=np.inf,
        nearest_s=time_s,
    )
