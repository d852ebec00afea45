"""What any session over a link hears: the vehicle's pulse, clock and positions, scans, aircraft.

Told in the world frame and by the vehicle's clock, at times of our monotonic clock, so that a
session can be run through anything in a test, and faster than real time.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import Counter, deque
from dataclasses import dataclass, field, replace
from typing import Protocol

from clearway.avoidance.plan.planner import Planner
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.inputs.own_states import COURSE_MPS
from clearway.live.inputs.readings import Reading
from clearway.live.link.aircraft import AircraftHeard, AircraftReport, TrafficTerms
from clearway.live.link.floor import FloorRule
from clearway.live.link.following import SetPointsFollowed
from clearway.live.link.link_state import LinkFacts, LinkLimits, LinkState
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.own_motion import OwnMotion
from clearway.live.link.placed_scans import PlacedScans, ScanMaker
from clearway.live.link.set_point import HOLDS, SetPoint, SetPointAhead, sample_escape
from clearway.live.link.status import VehicleStatus
from clearway.live.link.vehicle_clock import Tick, VehicleClock
from clearway.sensors import Lidar
from clearway.traffic import Intruder

SLOWEST = 0.3
"""Share of the speed of a movement below which the heading stands for the direction of flight."""
MOST_REPORTS = 256
"""Of other aircraft, between two ticks: the newest."""


@dataclass(frozen=True, slots=True)
class SessionTerms:
    """How a session is run."""

    act: bool = False
    """Lead the vehicle; otherwise only decide."""
    lead_s: float = 0.05
    """How far ahead on the plan set-points are: half a tick, since each counts for one."""
    limits: LinkLimits = field(default_factory=LinkLimits)
    speedup: float | None = 1.0
    """Of the vehicle's clock against ours; None for lock-step."""
    traffic: TrafficTerms = field(default_factory=TrafficTerms)
    floor: FloorRule = field(default_factory=lambda: FloorRule(0.0, -math.inf))


class Fed(Protocol):
    """The one that decides on what is heard: a system with a mission, or a guardian."""

    @property
    def planner(self) -> Planner: ...
    @property
    def counts(self) -> Counter[str]: ...
    @property
    def floor_m(self) -> float: ...
    @floor_m.setter
    def floor_m(self, height_m: float) -> None: ...

    def begin_at(self, place_m: FloatArray) -> None: ...
    def forget_free_space(self) -> None: ...
    def update(self, reading: Reading) -> None: ...


class Hearing(ABC):
    """The half of a session that is fed; sensor: None where the mission has none.

    counts grows by data that are left out, by reason.
    """

    def __init__(
        self, sink: Fed, sensor: Lidar | None, terms: SessionTerms, counts: Counter[str]
    ) -> None:
        self.terms, self.counts = terms, counts
        self.status: VehicleStatus | None = None
        self.state = LinkState.WAITING
        self.clock = VehicleClock(terms.speedup)
        self.motion: OwnMotion | None = None
        self._sink, self._sensor = sink, sensor
        self._traffic = AircraftHeard(terms.traffic, counts)
        self._intruders: dict[str, Intruder] = {}
        self._reports: deque[Intruder] = deque(maxlen=MOST_REPORTS)
        """Since the last tick, all of them: two aircraft may report by one address."""
        self._own: State | None = None
        self._scans = PlacedScans(sensor is not None, counts)
        self._pulse_s = -math.inf
        self._ground_m: float | None = None
        self._restarted = False
        self._following = SetPointsFollowed(sink.planner.speed_mps)
        self._is_begun = False  # Whether the vehicle has been handed over, or is watched.
        self._led = False  # Whether the last tick would have had the vehicle follow.
        self._last: SetPoint | None = None  # The last one sent that moves.
        self._holds = 0

    @property
    def own_s(self) -> float | None:
        """Time of the newest own position; None before any."""
        return None if self._own is None else self._own.time_s

    @property
    def left_out(self) -> Counter[str]:
        """All that was not used, by reason."""
        return self.counts + self._sink.counts

    @property
    def planner(self) -> Planner:
        """Of the one that decides."""
        return self._sink.planner

    @property
    def speed_mps(self) -> float:
        """Of the vehicle."""
        return self.planner.speed_mps

    @property
    def pressing(self) -> bool:
        """Whether anything has come that should not wait for the next tick: a scan."""
        return self._scans.ready

    @abstractmethod
    def hear_goal(self, place_m: FloatArray, wall_s: float) -> str | None:
        """A goal [3], or several [n, 3]; why it is refused, or None."""

    @property
    @abstractmethod
    def refusal(self) -> str | None:
        """Why the vehicle may not be led; None if it may."""

    @abstractmethod
    def tick(self, wall_s: float) -> TickOutcome:
        """Decide if it is due and allowed, and say what is to be flown."""

    def hear_status(self, status: VehicleStatus, wall_s: float) -> None:
        """The vehicle's pulse, and what it says of itself."""
        self._pulse_s, self.status = wall_s, status

    def hear_time(self, time_s: float, wall_s: float) -> bool:
        """A time by the vehicle's clock; whether what was told with it may be used."""
        tick = self.clock.take(time_s, wall_s)
        if tick is not Tick.GOOD:
            self.counts[str(tick)] += 1
        if tick is Tick.RESTARTED:
            self._restarted = True
        return tick not in (Tick.STRAY, Tick.RESTARTED)

    def hear_motion(self, motion: OwnMotion) -> None:
        """Where the vehicle is and how it moves, at a time that was heard."""
        state = self._state_of(motion)
        if self._own is None or state.time_s > self._own.time_s:
            self.motion, self._own = motion, state
            self._scans.move(state, motion.heading_rad)
        self._sink.update(state)

    def _state_of(self, motion: OwnMotion) -> State:
        """The own state that decisions start from."""
        if self.planner.automaton.has_inertia:
            return replace(motion.state(COURSE_MPS), velocity_mps=motion.velocity_mps)
        return motion.state(SLOWEST * self.speed_mps)

    def forget_free_space(self) -> None:
        """The own position has jumped, or the frame that it is told in."""
        self._sink.forget_free_space()

    def hear_scan(self, told_s: float | None, scan_at: ScanMaker, wall_s: float) -> None:
        """A scan, to be made for the own state of its time; told_s: None where nothing is told."""
        arrived_s = self.clock.estimate_arrival(wall_s)
        self._scans.take(told_s, arrived_s, self.clock.now(wall_s), scan_at)

    def hear_aircraft(self, report: AircraftReport, wall_s: float) -> None:
        """Another aircraft; nothing can be made of it before the own position is known."""
        assert self.motion is not None
        now = self.clock.now(wall_s)
        intruder = self._traffic.take(report, now, self.motion)
        if intruder is not None:
            oldest = now - self.terms.traffic.oldest_s
            self._intruders = {k: i for k, i in self._intruders.items() if i.time_s >= oldest}
            self._intruders[intruder.name] = intruder
            self._reports.append(intruder)

    def hear_ground(self, height_m: float) -> None:
        """Height of the home in the world frame."""
        if math.isfinite(height_m):
            self._ground_m = height_m
            self._sink.floor_m = self.floor_m

    def hear_target(self, place_m: FloatArray) -> None:
        """Where the vehicle says that it flies to, world frame."""
        if self._is_led:
            self._following.hear_target(place_m)

    @property
    def floor_m(self) -> float:
        """How low the vehicle is led at most, world frame; -inf without a floor."""
        return self.terms.floor.height_m(self._ground_m)

    @property
    def _is_led(self) -> bool:
        """Whether the vehicle should do what we say."""
        status = self.status
        return (
            self.terms.act
            and status is not None
            and status.armed
            and status.follows
            and status.airborne is True
        )

    @property
    def _flaw(self) -> str | None:
        return self._following.flaw if self._is_led else None

    # --- for those who decide ---------------------------------------------------------------

    def _note_hand_over(self) -> None:
        """Begin where the vehicle is handed over, which need not be where the mission starts."""
        begins = self._own is not None and (self._is_led or not self.terms.act)
        if begins and not self._is_begun and self._own is not None:
            self._sink.begin_at(self._own.position_m)
        self._is_begun = begins

    def _take_scans(self) -> None:
        for scan in self._scans.place_waiting():
            self._sink.update(scan)

    def _take_reports(self) -> None:
        for report in self._reports:
            self._sink.update(report)
        self._reports.clear()

    def _facts(self, now: float, wall_s: float, *, arrived: bool, refused: bool) -> LinkFacts:
        status, act = self.status, self.terms.act
        flies = status is not None and status.armed and status.airborne is True
        return LinkFacts(
            heartbeat_age_s=wall_s - self._pulse_s,
            position_age_s=math.inf if self._own is None else now - self._own.time_s,
            distances_age_s=None if self._sensor is None else now - self._scans.newest_s,
            restarted=self._restarted,
            arrived=arrived,
            airborne=flies or not act,
            refused=act and refused,
            mode_follows=status is None or status.follows,
            followed=self._flaw is None,
        )

    def _pick_set_point(self, now: float, found: SetPoint | None) -> SetPoint | None:
        """What to send; where set-points end, the last one to hold, a few times."""
        if found is not None and self._own is not None:
            found = found.above(self.floor_m, self._own.position_m)
            if found.velocity_mps is None:
                self._last, self._holds = None, 0
            else:
                self._last, self._holds = found, HOLDS
                if self._is_led:
                    place = self._own.position_m
                    self._following.tell(now, found.position_m, found.velocity_mps, place)
            return found
        self._following.begin()
        if self._last is None or self._holds == 0 or not self.state.may_hold:
            self._last = None
            return None
        self._holds -= 1
        return self._last.hold()

    def farewell(self) -> SetPoint | None:
        """The last set-point, when the session ends: to hold where the vehicle was led to."""
        last, self._last = self._last, None
        return last.hold() if last is not None and self.state.may_hold else None

    def escape_ahead(self, sent: SetPoint | None, period_s: float) -> list[SetPointAhead]:
        """What is held after the last tick, to its end and a hold there; none without an escape.

        sent: the set-point of that tick, with which it begins. period_s: between two of them.
        """
        if sent is None or not self.terms.act:
            return []
        lasts_s = 0.0 if sent.velocity_mps is None else self._escape_lasts_s()
        return sample_escape(sent, lasts_s, self._on_escape, period_s, self.floor_m)

    @abstractmethod
    def _escape_lasts_s(self) -> float | None:
        """For how long the held escape is flown from the last tick on; None without one."""

    @abstractmethod
    def _on_escape(self, later_s: float) -> SetPoint | None:
        """The set-point of the held escape so long after the last tick."""

    def _why_state(self, refusal: str | None) -> str:
        if self.state is LinkState.REFUSED:
            return refusal or ""
        if self.state is LinkState.NOT_FOLLOWED:
            return self._flaw or ""
        status = self.status
        silent = status is not None and status.armed and status.airborne is None
        if self.state is LinkState.ON_GROUND and silent:
            return "nothing says that the vehicle is in the air"
        return ""
