"""What is known at one decision time, and the margin and goal that follow from it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import EvidenceSettings
from clearway.avoidance.rate.goal import Goal
from clearway.avoidance.rate.route_field import PlacedRoute, RouteField
from clearway.base.brief import brief
from clearway.base.checks import (
    LARGEST,
    LATEST_S,
    above_zero_problem,
    array_problem,
    collect_problems,
    number_problem,
    vector_problem,
)
from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.state import State, freeze_array
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Detection
from clearway.sensors.memory.uncertain import slope_of
from clearway.sensors.observed.seen_space import SeenSpace
from clearway.traffic import Intruder

CALM = freeze_array([0.0, 0.0, 0.0], (3,))
"""No wind."""
PLANNED_REACH = 0.9
"""Share of the reach radius that plans aim for, so that flying them does not just miss it."""


class Here(NamedTuple):
    """Where we are and want to go, and how sure that is, as a `Situation` tells it; the margin
    follows from it before anything of what is around is known."""

    state: State
    target_m: FloatArray
    next_m: FloatArray | None
    from_m: FloatArray | None
    reach_radius_m: float
    state_age_s: float
    unsure_m: float
    wind_mps: FloatArray
    wind_sigma_mps: float
    floor_m: float


@dataclass(frozen=True, eq=False)
class Situation:
    """All that is known at the decision time, in the world frame unless said otherwise.

    Raises
    ------
    InputError
        Naming all that cannot be used: what is not finite or out of range would end in a margin or
        a cost that every trajectory keeps.

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> here = cw.State(np.zeros(3))
    >>> cw.Situation(here, target_m=np.array([20.0, 0.0, 0.0]))
    Situation(state=State, target_m=[20, 0, 0])
    """

    state: State
    """Expected own state estimate at the decision time."""
    target_m: FloatArray
    """[3] waypoint to go to."""
    _: KW_ONLY
    next_m: FloatArray | None = None
    """[3] the waypoint after it; None for the final one."""
    from_m: FloatArray | None = None
    """[3] where the leg to the waypoint began; None for the own position."""
    reach_radius_m: float = 1.5
    detections: Sequence[Detection] = ()
    """One per sensor, in the grid frame; none at all leaves everything visible (4.19)."""
    remembered: PointHazards | None = None
    """Points of all scans up to now, world frame; None takes those of the detections alone."""
    obstacle_map: ObstacleMap | None = None
    intruders: Sequence[Intruder] = ()
    """As reported, each with its own time."""
    state_age_s: float = 0.0
    """Age of the measurement behind `state`."""
    unsure_m: float = 0.0
    """How far off `state` may be since its time, or what was flown since, is not known."""
    range_sigma_m: float = 0.0
    """Standard deviation of the range, by which all points grow: of the best sensor where the radii
    of the others' points hold the difference, else of the worst."""
    wind_mps: FloatArray = field(default_factory=lambda: CALM)
    """[3] how air carries the vehicle off where its movements lead, world frame."""
    wind_sigma_mps: float = 0.0
    """Standard deviation of each axis of it."""
    floor_m: float = -math.inf
    """Height of the world that no way leads below, in an emergency neither; one that is below it
    already goes no lower."""

    seen: SeenSpace | None = None
    """Space that range sensors have seen to be free; None without any of them."""
    route: RouteField | None = None
    """The time to go to the waypoint round what is known; None where that is not kept."""

    def __post_init__(self) -> None:
        if self._is_plain:
            return
        problems = collect_problems(self._problems())
        if problems:
            raise InputError("situation", problems)

    @classmethod
    def trust(cls, **values: object) -> Situation:
        """Make a situation of values that need no checks.

        Parameters
        ----------
        **values
            All fields, each by name; `frame` may be among them.

        Returns
        -------
        Situation
            Of these values as they are.
        """
        situation = object.__new__(cls)
        situation.__dict__.update(values)
        return situation

    @property
    def without_readings(self) -> Situation:
        """The same without what sensors and traffic told, which is most of it."""
        told = {"detections": (), "remembered": None, "intruders": (), "seen": None, "route": None}
        return self.trust(**(vars(self) | told))

    @property
    def _is_plain(self) -> bool:
        """Whether all is as nearly always, which is quick to find out; else problems are sought."""
        vectors = [self.target_m, self.wind_mps]
        vectors += [point for point in (self.next_m, self.from_m) if point is not None]
        for vector in vectors:
            if type(vector) is not np.ndarray or vector.dtype != float or vector.shape != (3,):
                return False
            x, y, z = vector.tolist()
            if not (abs(x) <= LARGEST and abs(y) <= LARGEST and abs(z) <= LARGEST):
                return False
        numbers = (self.state_age_s, self.range_sigma_m, self.wind_sigma_mps, self.unsure_m)
        for number in (*numbers, self.reach_radius_m):
            if not (isinstance(number, float | int) and 0.0 <= number <= LARGEST):
                return False
        if self.remembered is not None:
            if not _are_two(self.remembered):
                return False
            place, radius = self.remembered
            if array_problem("", place, (None, 3)) or array_problem(
                "", radius, (len(place),), 0.0, LARGEST
            ):
                return False
        return (
            self.reach_radius_m > 0.0
            and isinstance(self.floor_m, float)
            and self.floor_m <= LARGEST
            and isinstance(self.state, State)
            and isinstance(self.obstacle_map, ObstacleMap | None)
            and isinstance(self.detections, Sequence)
            and isinstance(self.intruders, Sequence)
            and all(isinstance(each, Detection) for each in self.detections)
            and all(isinstance(each, Intruder) for each in self.intruders)
        )

    def _problems(self) -> Iterator[str | None]:
        yield from (
            _kind_problem("state", [self.state], State),
            vector_problem("target_m", self.target_m, 3),
            None if self.next_m is None else vector_problem("next_m", self.next_m, 3),
            None if self.from_m is None else vector_problem("from_m", self.from_m, 3),
            above_zero_problem("reach_radius_m", self.reach_radius_m),
            number_problem("state_age_s", self.state_age_s, 0.0, LATEST_S),
            number_problem("unsure_m", self.unsure_m, 0.0, LARGEST * LARGEST),
            number_problem("range_sigma_m", self.range_sigma_m),
            vector_problem("wind_mps", self.wind_mps, 3),
            number_problem("wind_sigma_mps", self.wind_sigma_mps),
            number_problem("floor_m", self.floor_m, -math.inf),
            _kind_problem("detections", self.detections, Detection),
            _kind_problem("intruders", self.intruders, Intruder),
        )
        if self.obstacle_map is not None:
            yield _kind_problem("obstacle_map", [self.obstacle_map], ObstacleMap)
        if self.remembered is not None:
            yield _kind_problem("remembered", [self.remembered], tuple)
        if self.remembered is not None and _are_two(self.remembered):
            place, radius = self.remembered
            yield array_problem("remembered.position_m", place, (None, 3))
            yield array_problem("remembered.radius_m", radius, (len(place),), 0.0, LARGEST)

    __repr__ = brief

    @property
    def placed_route(self) -> PlacedRoute | None:
        """The route, seen from the vehicle."""
        if self.route is None:
            return None
        yaw_rad = float(self.state.attitude_rad[2])
        return PlacedRoute(self.route, self.state.position_m, yaw_rad)

    @cached_property
    def frame(self) -> GridFrame:
        """Where the avoidance grid sits."""
        return GridFrame.of(self.state)


def margin_m(settings: EvidenceSettings, situation: Situation | Here) -> float:
    """Safety margin grown by the uncertainty and the age of the own state estimate; ClearwayError
    where that is no finite number."""
    margin = (
        settings.safety_margin_m
        + settings.sigmas * situation.state.position_std_m
        + settings.own_drift_mps * situation.state_age_s
        + situation.unsure_m
    )
    if not 0.0 <= margin < math.inf:
        raise ClearwayError(f"safety margin: must be a finite number, got {margin}")
    return float(margin)  # Whatever kinds of numbers it is the sum of.


def margin_slope(settings: EvidenceSettings, situation: Situation | Here) -> float:
    """Metres that the margin grows by per metre of distance from the vehicle.

    What is known in the world frame, be it map, traffic or an earlier return, is turned into the
    vehicle's frame by an attitude that may be wrong: it then lies off by that angle times its
    distance, whatever it is.
    """
    return slope_of(settings.sigmas * situation.state.attitude_std_rad)


def widest_margin_m(planner: Planner, situation: Situation | Here) -> float:
    """The margin at the range of the grid."""
    settings = planner.settings
    slope = margin_slope(settings, situation)
    return margin_m(settings, situation) + slope * planner.grid.range_m


def _are_two(values: object) -> bool:
    return isinstance(values, tuple) and len(values) == 2


def _kind_problem(name: str, values: Any, kind: type) -> str | None:
    """What keeps values from being all of a kind."""
    if not np.iterable(values):
        return f"{name}: a sequence of {kind.__name__} is needed, got {type(values).__name__}"
    wrong = [type(value).__name__ for value in values if not isinstance(value, kind)]
    return f"{name}: must be of {kind.__name__}, got {', '.join(wrong)}" if wrong else None


def goal_of(situation: Situation, *, stays_level: bool = False) -> Goal:
    """The waypoints in the level frame of the vehicle; at its height, if it is to stay there."""
    heading = float(situation.state.attitude_rad[2])
    at = (math.cos(heading), math.sin(heading), situation.state.position_m.tolist(), stays_level)
    target = _ahead(situation.target_m, *at)
    final = situation.next_m is None
    following = target if situation.next_m is None else _ahead(situation.next_m, *at)
    return Goal(target, following, float(PLANNED_REACH * situation.reach_radius_m), final)


def _ahead(
    place_m: FloatArray, cosine: float, sine: float, origin_m: list[float], level: bool
) -> FloatArray:
    """A place [3] of the world in the level frame at an origin, of a heading's cosine and sine."""
    (x, y, z), (from_x, from_y, from_z) = place_m.tolist(), origin_m
    dx, dy, dz = x - from_x, y - from_y, 0.0 if level else z - from_z
    return np.array([cosine * dx + sine * dy, cosine * dy - sine * dx, dz])
