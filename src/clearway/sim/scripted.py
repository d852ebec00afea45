"""Scripted traffic for simulations: intruders that appear, fly on, and report themselves.

An intruder appears at a time of the mission, at a place relative to the nominal straight flight,
to the ownship, or to the world. From then on it flies straight, or anywhere inside its stated
spread. With a transponder it reports its true position and announced velocity, with noise if asked
for; a visible one is a ball that simulated sensors see.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from operator import itemgetter
from typing import Literal, Protocol

import numpy as np

from clearway.base.brief import brief
from clearway.base.frames import FloatArray, world_from_body
from clearway.base.made import TimedPlaces
from clearway.base.state import State, freeze_array
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.traffic import Intruder

Spawn = Literal["nominal", "ownship", "world"]
"""Frame of an intruder's place: nominal straight flight, true ownship, or world."""


@dataclass(frozen=True, eq=False)
class ScriptedIntruder:
    """One intruder of a mission."""

    name: str
    appears_s: float
    """Time from which it is there, and reports itself if it can."""
    position_m: FloatArray
    """[3] where it is then, in the frame of `spawn`."""
    velocity_mps: FloatArray
    """[3] likewise."""
    spread_rad: FloatArray = field(default_factory=lambda: np.zeros(2))
    """[2] horizontal, vertical."""
    radius_m: float = 0.0
    spawn: Spawn = "nominal"
    transponder: bool = True
    """Whether it reports itself."""
    visible: bool = False
    """Whether simulated sensors see it, as a ball of its radius."""
    course: Callable[[float], FloatArray] | None = None
    """Where [3] it is at a time, world frame, in place of straight flight."""

    __repr__ = brief

    def __post_init__(self) -> None:
        for name, length in (("position_m", 3), ("velocity_mps", 3), ("spread_rad", 2)):
            object.__setattr__(self, name, freeze_array(getattr(self, name), (length,)))


@dataclass(frozen=True, slots=True)
class TrafficSettings:
    """How well traffic is known, and how it behaves."""

    position_sigma_m: float = 0.0
    velocity_sigma_mps: float = 0.0
    deviates: bool = False
    """Whether intruders use their stated spread: a new direction inside it every second."""
    report_s: float = 1.0
    """Time between reports of one intruder."""


def nominal_state(mission: Mission, time_s: float, speed_mps: float) -> State:
    """Where straight flight from waypoint to waypoint would be at a time, level and on course."""
    corners = np.concatenate([mission.start.position_m[None], mission.waypoints_m])
    left = max(0.0, (time_s - mission.start.time_s) * speed_mps)
    course = np.array([1.0, 0.0, 0.0])
    place = corners[0]
    for start, end in pairwise(corners):
        length = float(np.linalg.norm(end - start))
        if length > 1e-9:
            course = (end - start) / length
        place = start + left * course
        if left <= length:
            break
        left -= length
        place = end + left * course
    return State(place, np.array([0.0, 0.0, np.arctan2(course[1], course[0])]), time_s=time_s)


class AirTraffic(Protocol):
    """What a simulated flight asks of the traffic around it; `Traffic` is one."""

    @property
    def tracks(self) -> Mapping[str, Sequence[tuple[float, FloatArray]]]:
        """Times and true positions of each intruder by name, while it was there."""
        ...

    def step(self, own: State) -> None:
        """Move on to the time of the own true state."""
        ...

    def reports(self, time_s: float) -> list[Intruder]:
        """What is reported at a time, world frame."""
        ...

    def bodies(self, time_s: float) -> list[Obstacle]:
        """What sensors see of the traffic, where it was at a time already flown."""
        ...

    def radii_m(self) -> Mapping[str, float]:
        """Body radius by name; the margin is kept from it."""
        ...


class Traffic:
    """The intruders of one flight, true and as reported; the same seed gives the same traffic."""

    def __init__(
        self,
        script: Sequence[ScriptedIntruder],
        mission: Mission,
        speed_mps: float,
        settings: TrafficSettings | None = None,
        seed: int = 0,
    ) -> None:
        self.settings = settings or TrafficSettings()
        self._mission, self._speed = mission, speed_mps
        self._waiting = sorted(script, key=lambda intruder: intruder.appears_s)
        self._flying: dict[str, _Flyer] = {}
        self._rng = np.random.default_rng([seed, 30])
        self.tracks: dict[str, TimedPlaces] = {}

    def step(self, own: State) -> None:
        """Move on to the time of the own true state; intruders that are due appear."""
        while self._waiting and self._waiting[0].appears_s <= own.time_s + 1e-9:
            scripted = self._waiting.pop(0)
            self._flying[scripted.name] = self._appear(scripted, own)
            self.tracks[scripted.name] = TimedPlaces()
        for name, flyer in self._flying.items():
            flyer.move(own.time_s)
            self.tracks[name].append((own.time_s, flyer.position_m))

    def reports(self, time_s: float) -> list[Intruder]:
        """What the intruders report at a time, in the world frame."""
        reports = []
        for name, flyer in self._flying.items():
            if not flyer.transponder or time_s < flyer.next_report_s - 1e-9:
                continue
            flyer.next_report_s = time_s + self.settings.report_s
            settings = self.settings
            noise = self._rng.normal(0.0, 1.0, (2, 3))
            reports.append(
                Intruder(
                    flyer.position_m + settings.position_sigma_m * noise[0],
                    flyer.axis_mps + settings.velocity_sigma_mps * noise[1],
                    spread_rad=flyer.spread_rad,
                    radius_m=flyer.radius_m,
                    name=name,
                    time_s=time_s,
                    position_std_m=settings.position_sigma_m,
                    velocity_std_mps=settings.velocity_sigma_mps,
                )
            )
        return reports

    def bodies(self, time_s: float) -> list[Obstacle]:
        """Visible intruders as balls where they were at a time already flown."""
        return [
            Obstacle.ball(self._place(name, time_s), flyer.radius_m, name=name)
            for name, flyer in self._flying.items()
            if flyer.visible and self.tracks[name][0][0] <= time_s + 1e-9
        ]

    def _place(self, name: str, time_s: float) -> FloatArray:
        """[3] position of an intruder at a step of its track."""
        track = self.tracks[name]
        return track[bisect_left(track, time_s - 1e-9, key=itemgetter(0))][1]

    def radii_m(self) -> dict[str, float]:
        """Body radius by name, of all that have appeared."""
        return {name: flyer.radius_m for name, flyer in self._flying.items()}

    def _appear(self, scripted: ScriptedIntruder, own: State) -> _Flyer:
        position, velocity = scripted.position_m, scripted.velocity_mps
        # Between two steps of the simulation it is where its own time says.
        since_s = scripted.appears_s
        if scripted.spawn != "world":
            frame = nominal_state(self._mission, scripted.appears_s, self._speed)
            if scripted.spawn == "ownship":
                frame, since_s = own, own.time_s
            rotation = world_from_body(frame.attitude_rad)
            position = frame.position_m + rotation @ position
            velocity = rotation @ velocity
        rng = np.random.default_rng(self._rng.integers(2**63))
        return _Flyer(scripted, position, velocity, since_s, rng, self.settings.deviates)


class _Flyer:
    """One intruder under way."""

    def __init__(
        self,
        scripted: ScriptedIntruder,
        position_m: FloatArray,
        velocity_mps: FloatArray,
        time_s: float,
        rng: np.random.Generator,
        deviates: bool,
    ) -> None:
        self.position_m, self.axis_mps = position_m, velocity_mps
        self.spread_rad, self.radius_m = scripted.spread_rad, scripted.radius_m
        self.transponder, self.visible = scripted.transponder, scripted.visible
        self.next_report_s = time_s
        self._time_s, self._turns_s = time_s, time_s
        self._rng, self._deviates = rng, deviates
        self._velocity_mps = velocity_mps
        self._course = scripted.course

    def move(self, time_s: float) -> None:
        """Fly to a time; with deviation, a new direction inside the spread every second."""
        if self._course is not None:
            self.position_m = self._course(time_s)
            return
        while self._time_s < time_s - 1e-12:
            if self._deviates and self._time_s >= self._turns_s - 1e-9:
                self._velocity_mps = self._deviate()
                self._turns_s = self._time_s + 1.0
            until = min(time_s, self._turns_s) if self._deviates else time_s
            self.position_m = self.position_m + (until - self._time_s) * self._velocity_mps
            self._time_s = until

    def _deviate(self) -> FloatArray:
        """A velocity of the same speed along the axis, off it by up to tan(spread)."""
        speed = float(np.linalg.norm(self.axis_mps))
        if speed == 0.0:
            return self.axis_mps
        forward = self.axis_mps / speed
        across = np.cross([0.0, 0.0, 1.0], forward)
        if np.linalg.norm(across) < 1e-9:
            across = np.array([0.0, 1.0, 0.0])
        across /= np.linalg.norm(across)
        radius, angle = np.sqrt(self._rng.random()), self._rng.uniform(0.0, 2.0 * np.pi)
        horizontal, vertical = np.tan(self.spread_rad) * radius * [np.cos(angle), np.sin(angle)]
        aside: FloatArray = horizontal * across + vertical * np.cross(forward, across)
        return self.axis_mps + speed * aside
