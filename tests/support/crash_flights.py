"""Flights past shapes by a pilot that remembers its scans, or trusts a map, and nothing else.

It uses shapes and beams of clearway, and none of its decisions, predictions or explanations.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from clearway.base.state import State
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Scan, simulate_scan

STEP_S = 0.05
LASTS_S = 60.0
OFFSETS = np.radians(15.0) * np.arange(-9, 10)
"""Courses that are looked at, from the present one."""
KEPT_MARGINS = 1.5
"""That the pilot keeps to what it knows."""
HOVERS_S = 2.0
"""After which a flight that hovers is over: it has kept clear."""


@dataclass(frozen=True)
class Craft:
    """A vehicle: a plane that keeps its speed, or a copter that brakes."""

    stops: bool
    speed_mps: float
    body_m: float
    margin_m: float
    brakes_mps2: float = 3.0
    plane_turns_rps: float = float(np.radians(15.0))

    def turns_rps(self, speed_mps: float) -> float:
        """How fast its course turns."""
        if not self.stops:
            return self.plane_turns_rps
        return float(min(self.brakes_mps2 / max(speed_mps, 0.5), np.radians(90.0)))


@dataclass(frozen=True)
class Fault:
    """What is wrong with a flight; the defaults are nothing."""

    blind_rad: float = 0.0
    """Half width of a sector ahead that returns nothing."""
    nose_rad: float = 0.0
    """Of the nose, and the sensor, from where the vehicle flies to."""
    farthest_m: float = np.inf
    """Beyond which the sensor returns nothing, whatever it promises."""
    danger_shows_m: float = np.inf
    """Beyond which what will be hit returns nothing: it is dark, or glass at 0."""
    dead_s: float = np.inf
    """From when no scan comes."""
    frozen_s: tuple[float, float] = (np.inf, np.inf)
    """Between which the pilot keeps its course."""
    wind_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Place(NamedTuple):
    """What is there, and what of it a map shows."""

    world: ObstacleMap
    danger: ObstacleMap
    charted: ObstacleMap | None
    """What the pilot flies by in place of its scans; None where it flies by scans."""


@dataclass(frozen=True)
class Flight:
    """A track until the body touches something, the goal is reached, or time is up."""

    time_s: Any
    states: Any
    """[n, 6] world frame."""
    surface_m: Any
    """[n] from the vehicle's middle to the nearest surface."""
    scans: tuple[Scan, ...]
    touched: bool
    hit_danger: bool
    shown: tuple[tuple[float, float], ...]
    """(time, distance to its surface) of scans with returns of the danger."""


@dataclass
class Pilot:
    """Takes the course nearest to the goal that keeps clear of what it knows; a copter without one
    brakes."""

    craft: Craft
    goal_m: Any
    looks_m: float
    charted: ObstacleMap | None
    _seen: list[Any] = field(default_factory=list)

    def remember(self, points_m: Any) -> None:
        """Take in returns [n, 3], world frame."""
        self._seen.append(points_m[::3])

    def choose(self, place_m: Any, course_rad: float, speed_mps: float) -> tuple[float, float]:
        """Course and speed from now on."""
        away = self.goal_m - place_m
        off = course_rad + OFFSETS - np.arctan2(away[1], away[0])
        detour = np.abs(np.arctan2(np.sin(off), np.cos(off)))
        kept = self._clearances(place_m, course_rad)
        clear = kept >= KEPT_MARGINS * self.craft.margin_m
        if clear.any():
            best = int(np.argmin(np.where(clear, detour, np.inf)))
            return course_rad + float(OFFSETS[best]), self.craft.speed_mps
        best = int(np.argmax(kept))
        return course_rad + float(OFFSETS[best]), 0.0 if self.craft.stops else speed_mps

    def _clearances(self, place_m: Any, course_rad: float) -> Any:
        """[courses] least distance along each, to what is known."""
        radius = self.craft.speed_mps / self.craft.turns_rps(self.craft.speed_mps)
        step = self.looks_m / 40.0
        turned = np.minimum(np.abs(OFFSETS)[:, None], step * np.arange(1, 41) / radius)
        heading = course_rad + np.sign(OFFSETS)[:, None] * turned
        flat = np.cumsum(step * np.stack([np.cos(heading), np.sin(heading)], axis=-1), axis=1)
        ways = np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=-1) + place_m
        points = ways.reshape(-1, 3)
        if self.charted is not None:
            return self.charted.distance_m(points).reshape(ways.shape[:2]).min(axis=1)
        known = np.concatenate([np.zeros((0, 3)), *self._seen])
        level = known[np.abs(known[:, 2] - place_m[2]) < 2.0 * self.craft.margin_m]
        if not len(level):
            return np.full(len(OFFSETS), np.inf)
        self._seen = [known[-20_000:]]
        return cKDTree(level).query(points)[0].reshape(ways.shape[:2]).min(axis=1)


@dataclass(frozen=True)
class Course:
    """Where a flight begins and leads, and how often it is decided anew."""

    start_m: Any
    heading_rad: float
    goal_m: Any
    decides_s: float
    scans_hz: float


def fly(craft: Craft, course: Course, place: Place, sensor: Any, fault: Fault, seed: int) -> Flight:
    """Fly it; the same seed gives the same flight."""
    rng = np.random.default_rng(seed)
    looks_m = 0.9 * float(sensor.pattern.max_range_m)
    pilot = Pilot(craft, np.asarray(course.goal_m), looks_m, place.charted)
    at, heading = np.array(course.start_m, dtype=np.float64), course.heading_rad
    speed, asked = craft.speed_mps, (heading, craft.speed_mps)
    times, states, surface = [], [], []
    scans: list[Scan] = []
    shown: list[tuple[float, float]] = []
    scan_every = round(1.0 / (course.scans_hz * STEP_S))
    decide_every = round(course.decides_s / STEP_S)
    hovered = 0.0
    for number in range(round(LASTS_S / STEP_S)):
        now = number * STEP_S
        state = State(at, np.array([0.0, 0.0, heading + fault.nose_rad]), time_s=now)
        times.append(now)
        states.append(state.vector)
        surface.append(float(place.world.distance_m(at[None])[0]))
        if number % scan_every == 0 and now < fault.dead_s:
            scan, ours = _scan(sensor, state, place, fault, rng)
            scans.append(scan)
            pilot.remember(scan.points_m @ state.world_from_body.T + at)
            if ours:
                shown.append((now, float(place.danger.distance_m(at[None])[0])))
        if surface[-1] <= craft.body_m or hovered > HOVERS_S:
            break
        if np.linalg.norm((pilot.goal_m - at)[:2]) < 2.0 * craft.speed_mps:
            break
        if number % decide_every == 0:
            begin, end = fault.frozen_s
            frozen = begin <= now < end
            asked = (heading, speed) if frozen else pilot.choose(at, heading, speed)
        most = craft.turns_rps(speed) * STEP_S
        off = float(np.arctan2(np.sin(asked[0] - heading), np.cos(asked[0] - heading)))
        heading += float(np.clip(off, -most, most))
        if craft.stops:
            change = craft.brakes_mps2 * STEP_S
            speed += float(np.clip(asked[1] - speed, -change, change))
        hovered = hovered + STEP_S if speed < 0.05 * craft.speed_mps else 0.0
        ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
        at = at + STEP_S * (speed * ahead + np.asarray(fault.wind_mps))
    touched = surface[-1] <= craft.body_m
    near = float(place.danger.distance_m(at[None])[0]) <= craft.body_m
    return Flight(
        np.array(times), np.array(states), np.array(surface), tuple(scans), touched,
        touched and near, tuple(shown),
    )  # fmt: skip


def _scan(sensor: Any, state: State, place: Place, fault: Fault, rng: Any) -> tuple[Scan, bool]:
    """What the fault leaves of a scan, and whether the danger is in it."""
    from dataclasses import replace

    scan = simulate_scan(sensor, place.world, state, rng)
    points = scan.points_m
    ranges = np.linalg.norm(points, axis=1)
    world = points @ state.world_from_body.T + state.position_m
    ours = np.abs(place.danger.distance_m(world)) < 0.1 if len(points) else np.zeros(0, bool)
    shows = (ranges <= fault.farthest_m) & (~ours | (ranges <= fault.danger_shows_m))
    if fault.blind_rad:
        shows &= np.abs(np.arctan2(points[:, 1], points[:, 0])) > fault.blind_rad
    return replace(scan, points_m=points[shows]), bool(ours[shows].any())


def escapes(craft: Craft, flight: Flight, place: Place, since_s: float) -> bool:
    """Whether the hardest turn to a side, or braking, from a time on, touches nothing at all."""
    first = int(np.searchsorted(flight.time_s, since_s - 1e-9))
    begin = flight.states[first]
    step = np.diff(flight.states[first : first + 2, :2], axis=0)
    course = float(np.arctan2(step[0, 1], step[0, 0])) if len(step) else float(begin[5])
    for side, brakes in ((-1.0, False), (1.0, False), (0.0, True)):
        if brakes and not craft.stops:
            continue
        at, heading, speed, turned, clear = begin[:3].copy(), course, craft.speed_mps, 0.0, True
        while turned < np.pi and speed > 0.0 and clear:
            rate = side * craft.turns_rps(speed) * STEP_S
            heading, turned = heading + rate, turned + abs(rate)
            speed -= craft.brakes_mps2 * STEP_S if brakes else 0.0
            ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
            at = at + STEP_S * max(speed, 0.0) * ahead
            clear = float(place.world.distance_m(at[None])[0]) > craft.body_m
        if clear:
            return True
    return False
