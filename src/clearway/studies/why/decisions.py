"""What clearway decides at the recorded moments, and how far from everything that leads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.io.flights.recorded import SECTOR_STEP_M, RecordedFlight
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode
from clearway.live.playback import mission_along
from clearway.sensors import Scan
from clearway.studies.why.ending import Ending
from clearway.studies.why.speeds import velocity_at
from clearway.studies.why.vehicle import Judge
from clearway.studies.why.views import PlacedReading
from clearway.vehicle.scale import suit_reach_m

MOST_DECISIONS = 24
"""From shortly before the first sight on; readings between them are taken in without one."""
BEFORE_SIGHT_S = 2.0
"""For how long before it decisions are taken."""
STEP_S = 0.25
PARTS = 5
"""Between states of a plan that are computed, and into how many parts the way between is divided to
be checked against returns."""
FLOWN_S = 16.0
"""Of a plan and its escape, at most."""
ARC_SHARE = 1.0 / 3.0
"""Of the margin, between the points of sectors' arcs that the system is fed."""
SIDE_SHARE = 0.5
"""Of the margin that a plan must lead to the side, up, or back to be called so."""


@dataclass(frozen=True, slots=True, eq=False)
class FlownDecision:
    """One decision of clearway, as it would be flown without further sight."""

    time_s: float
    mode: Mode
    way_m: FloatArray
    """[n, 3] the plan and its escape."""
    kept_m: float
    """Least distance on it to all that the log shows."""
    manoeuvre: str
    """In a word: turned left, climbed, stopped."""
    explanation: str
    holds_escape: bool

    @property
    def acts(self) -> bool:
        """Whether it does something else than fly to its goal."""
        return self.mode not in (Mode.NAVIGATION, Mode.LANDING)


def decide_along(
    flight: RecordedFlight,
    judge: Judge,
    ending: Ending,
    seen: Sequence[PlacedReading],
    sight_s: float | None,
) -> tuple[FlownDecision, ...]:
    """Decisions at the readings around and after the first sight of the danger, on the way that was
    flown; none where no sensor showed it."""
    before = [one for one in seen if one.reading.time_s < ending.time_s]
    if not before or not judge.lidars or sight_s is None:
        return ()
    system = _system(flight, judge, [one.state for one in before])
    solid = Solid(ending, seen)
    since_s = sight_s - BEFORE_SIGHT_S
    every_s = (before[-1].reading.time_s - since_s) / MOST_DECISIONS
    decided_s, found = -np.inf, []
    for one in before:
        time_s = one.reading.time_s
        system.update(_moving(flight, one.state))
        system.update(Scan(_beams(one, judge.margin_m), time_s, sensor=one.sensor))
        if time_s < since_s or time_s - decided_s < every_s:
            system.catch_up(time_s)
            continue
        decided_s = time_s
        found.append(_make_decided(system, judge, solid, time_s))
    return tuple(found)


def _system(flight: RecordedFlight, judge: Judge, states: list[State]) -> AvoidanceSystem:
    planner = judge.setup.planner
    mission = mission_along(
        [_moving(flight, one) for one in states],
        planner.grid.range_m,
        suit_reach_m(planner.automaton),
    )
    system = AvoidanceSystem(
        planner, mission, lidars=judge.lidars, obstacle_map=judge.setup.obstacle_map
    )
    system.followed = False
    return system


def _moving(flight: RecordedFlight, state: State) -> State:
    """A state with the velocity that the track shows."""
    return replace(state, velocity_mps=velocity_at(flight.track, state.time_s))


def _beams(one: PlacedReading, margin_m: float) -> FloatArray:
    """What the system is fed: the returns of beams; of sectors all of their arcs."""
    if not one.reading.half_width_rad:
        return one.reading.points_m
    return one.reading.arcs(max(SECTOR_STEP_M, ARC_SHARE * margin_m))[0]


class Solid:
    """Everything that the log shows to stand there, and the danger."""

    def __init__(self, ending: Ending, seen: Sequence[PlacedReading]) -> None:
        danger = [] if ending.intruder is not None else [ending.danger_m[None]]
        beams = [one.points_m for one in seen if not one.reading.half_width_rad]
        arcs = [one.points_m[:, :2] for one in seen if one.reading.half_width_rad]
        self._points, self._arcs = _tree([*danger, *beams], 3), _tree(arcs, 2)

    def distance_m(self, way_m: FloatArray) -> float:
        """Least distance from places [n, 3]; to sectors, which tell no height, seen from above."""
        if not len(way_m):
            return np.inf
        point_m, arc_m = self._points.query(way_m)[0], self._arcs.query(way_m[:, :2])[0]
        return float(min(point_m.min(), arc_m.min()))


def _tree(points: list[FloatArray], axes: int) -> cKDTree:
    """Points of all arrays; without any, distances from it are inf."""
    return cKDTree(np.concatenate([np.zeros((0, axes)), *points]))


def _make_decided(
    system: AvoidanceSystem, judge: Judge, solid: Solid, time_s: float
) -> FlownDecision:
    flight = system.decide(time_s)
    way = _way(system, judge, time_s)
    charted = judge.setup.obstacle_map.distance_m(way)
    kept = min(solid.distance_m(way), float(charted.min(initial=np.inf)))
    escape = flight.decision.way_out
    return FlownDecision(
        time_s,
        flight.mode,
        way,
        kept,
        _manoeuvre(way, judge.margin_m),
        flight.explanation,
        escape is not None,
    )


def _way(system: AvoidanceSystem, judge: Judge, time_s: float) -> FloatArray:
    """[n, 3] the plan flown on, with what it ends with; of a plane without an escape on straight
    for a turning radius, since it cannot stop there."""
    places = []
    for after_s in np.arange(0.0, FLOWN_S, STEP_S):
        try:
            state = system.state_at(time_s + float(after_s))
        except ClearwayError:
            break
        if state is None:
            break
        places.append(state.position_m)
    way = _divide(np.array(places).reshape(-1, 3))
    automaton = judge.setup.planner.automaton
    if not automaton.can_stop and len(way) > 1 and len(places) * STEP_S < FLOWN_S:
        step = way[-1] - way[-2]
        length = float(np.linalg.norm(step))
        count = int(automaton.turning_radius_m / length) if length > 1e-9 else 0
        way = np.concatenate([way, way[-1] + np.arange(1, count + 1)[:, None] * step])
    return way


def _divide(places_m: FloatArray) -> FloatArray:
    """Places [n, 3] with others evenly between them."""
    if len(places_m) < 2:
        return places_m
    number = np.arange(len(places_m), dtype=np.float64)
    fine = np.linspace(0.0, number[-1], PARTS * (len(number) - 1) + 1)
    return np.column_stack([np.interp(fine, number, places_m[:, axis]) for axis in range(3)])


def _manoeuvre(way_m: FloatArray, margin_m: float) -> str:
    """What a way does in its first part, seen along its beginning."""
    moves = np.diff(way_m, axis=0)
    lengths = np.linalg.norm(moves, axis=1)
    flown = float(lengths.sum())
    if flown < SIDE_SHARE * margin_m:
        return "stopped"
    ahead = next(
        move / length for move, length in zip(moves, lengths, strict=True) if length > 1e-9
    )
    off = way_m - way_m[0]
    left = off @ np.array([-ahead[1], ahead[0], 0.0])
    up = off[:, 2] - ahead[2] * (off @ ahead)
    far = SIDE_SHARE * margin_m
    first = {
        "turned left": _first(left > far),
        "turned right": _first(left < -far),
        "climbed": _first(up > far),
        "descended": _first(up < -far),
    }
    word = min(first, key=lambda name: first[name])
    if first[word] < len(way_m):
        return word
    return "stopped" if lengths[-1] < 1e-6 else "flown on"


def _first(told: FloatArray) -> int:
    return int(np.argmax(told)) if told.any() else len(told)
