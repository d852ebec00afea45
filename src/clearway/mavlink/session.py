"""One session with an autopilot: messages in, decisions when due, messages out; no clock, no link.

`take` and `tick` are told the time of our monotonic clock, so that a session can be run through
anything in a test, and faster than real time.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live import AvoidanceSystem, FlightDecision
from clearway.mavlink import dialect as known
from clearway.mavlink.accuracy import StatedAccuracy
from clearway.mavlink.adsb import AdsbPicture, AdsbSettings
from clearway.mavlink.clock import Tick, VehicleClock
from clearway.mavlink.dialect import Message
from clearway.mavlink.health import LinkFacts, LinkLimits, LinkState, link_state
from clearway.mavlink.inbox import ReceivedMessage
from clearway.mavlink.mode import AutopilotMode
from clearway.mavlink.outbox import ACTIVE, CRITICAL, STANDBY, heartbeat
from clearway.mavlink.own_state import OwnMotion, OwnPlace
from clearway.mavlink.plan import turned_onto
from clearway.mavlink.reasons import PredictedApproach, Sayings, approaches
from clearway.mavlink.sector_scans import SectorScans
from clearway.mavlink.setpoints import SetPoint
from clearway.sensors import Lidar
from clearway.traffic import Intruder

ACCURACIES = (
    known.LOCAL_POSITION_NED_COV,
    known.ODOMETRY,
    known.ESTIMATOR_STATUS,
    known.EKF_STATUS_REPORT,
)
HEARTBEAT_S = 1.0
"""Between our heartbeats."""
SLOWEST = 0.3
"""Share of the speed of a movement below which the heading stands for the direction of flight."""


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """How a session is run."""

    act: bool = False
    """Send set-points and reasons; otherwise nothing but our heartbeat."""
    system: int = 1
    component: int = 1
    """The autopilot's."""
    lead_s: float = 0.05
    """How far ahead on the plan set-points are: half a tick, since each counts for one."""
    position_std_m: float = 0.0
    """Of the own position at least; the link may tell more."""
    limits: LinkLimits = field(default_factory=LinkLimits)
    speedup: float | None = 1.0
    """Of the vehicle's clock against ours; None for lock-step."""
    mission_origin: tuple[float, float, float] | None = None
    traffic: AdsbSettings = field(default_factory=AdsbSettings)


@dataclass(frozen=True, slots=True, eq=False)
class TickOutcome:
    """What a tick came to."""

    time_s: float
    """The vehicle's time."""
    state: LinkState
    flight: FlightDecision | None
    """The decision, if one was due."""
    why_now: str
    elapsed_s: float
    """That the decision took."""
    set_point: SetPoint | None
    """What is sent, or would be."""
    approaches: tuple[PredictedApproach, ...]
    messages: tuple[Message, ...]
    """To be sent, in this order."""


class Session:
    """Feed it with `take`, and ask it with `tick` at a set rate.

    system: warmed up, with `sensor` as its only LiDAR (None where the mission has none). counts
    grows by data that are left out, by reason.
    """

    def __init__(
        self,
        system: AvoidanceSystem,
        sensor: Lidar | None,
        settings: SessionSettings,
        counts: Counter[str],
    ) -> None:
        self.system, self.settings, self.counts = system, settings, counts
        self.mode: AutopilotMode | None = None
        self.state = LinkState.WAITING
        self.heartbeats = 0
        self._sensor = sensor
        self._clock = VehicleClock(settings.speedup)
        self._place = OwnPlace(settings.mission_origin, counts)
        self._accuracy = StatedAccuracy(settings.position_std_m, counts)
        self._traffic = AdsbPicture(settings.traffic, counts)
        self._intruders: dict[str, Intruder] = {}
        self._reports: dict[str, Intruder] = {}
        self._motion: OwnMotion | None = None
        self._own: State | None = None
        self._distances = SectorScans(sensor, counts)
        self._heartbeat_s = -math.inf
        self._said_s = -math.inf
        self._held_height_m: float | None = None  # Of a vehicle that stays level, at the last goal.
        self._restarted = False
        self._sayings = Sayings()

    @property
    def own_s(self) -> float | None:
        """Time of the newest own position; None before any."""
        return None if self._own is None else self._own.time_s

    # --- in -------------------------------------------------------------------------------

    def take(self, arrival: ReceivedMessage, wall_s: float) -> bool:
        """Use one message; true for a heartbeat of the autopilot."""
        message, number = arrival.message, arrival.number
        if number == known.HEARTBEAT:
            self._heartbeat_s, self.mode = wall_s, AutopilotMode.of(message)
            self.heartbeats += 1
            return True
        if number in (known.ATTITUDE, known.LOCAL_POSITION_NED, known.GLOBAL_POSITION_INT):
            self._take_timed(message, number, wall_s)
        elif number == known.GPS_GLOBAL_ORIGIN:
            self._place.take_origin(message)
        elif number == known.HOME_POSITION:
            self._place.take_home(message)
        elif number in ACCURACIES:
            self._accuracy.take(message, number)
        elif number == known.ADSB_VEHICLE:
            self._take_traffic(message, wall_s)
        elif number == known.OBSTACLE_DISTANCE:
            self._distances.take(message, self._clock.now(wall_s))
        return False

    def _take_timed(self, message: Message, number: int, wall_s: float) -> None:
        tick = self._clock.take(message.time_boot_ms, wall_s)
        if tick is not Tick.GOOD:
            self.counts[str(tick)] += 1
        if tick is Tick.RESTARTED:
            self._restarted = True
        if tick in (Tick.STRAY, Tick.RESTARTED):
            return
        time_s = self._clock.time_of(message.time_boot_ms)
        oldest = self.settings.limits.stale_s
        if number == known.ATTITUDE:
            self._place.take_attitude(message, time_s)
            return
        if number == known.LOCAL_POSITION_NED:
            motion = self._place.take_local(message, time_s, oldest)
        else:
            motion = self._place.take_global(message, time_s, oldest)
        if motion is not None:
            self._take_motion(motion)

    def _take_motion(self, motion: OwnMotion) -> None:
        speed = self.system.planner.speed_mps
        state = motion.state(
            SLOWEST * speed, self._accuracy.position_std_m, self._accuracy.attitude_std_rad
        )
        follows = self.settings.act and self.mode is not None and self.mode.follows
        planned = self._planned(state.time_s) if follows else None
        if planned is not None:
            state = turned_onto(planned, state, self.counts)
        if self._own is None or state.time_s > self._own.time_s:
            self._motion, self._own = motion, state
            self._distances.move(state, motion.heading_rad)
        self.system.update(state)

    def _take_traffic(self, message: Message, wall_s: float) -> None:
        now = self._clock.now(wall_s)
        intruder = self._traffic.take(message, now, self._motion, self._place.origin_geodetic)
        if intruder is not None:
            oldest = now - self.settings.traffic.oldest_s
            self._intruders = {k: i for k, i in self._intruders.items() if i.time_s >= oldest}
            self._intruders[intruder.name] = self._reports[intruder.name] = intruder

    # --- out ------------------------------------------------------------------------------

    def tick(self, wall_s: float) -> TickOutcome:
        """Decide if it is due and allowed, and say what is to be sent."""
        now = self._clock.now(wall_s)
        for scan in self._distances.placed():
            self.system.update(scan)
        self.system.catch_up(now)
        before, self.state = self.state, self._state_at(now, wall_s)
        flight, why, elapsed = self._decide(now)
        close: list[PredictedApproach] = []
        if flight is not None and self._motion is not None:
            close = approaches(flight, self._motion, self._intruders.values())
        set_point = self._set_point(now)
        messages = self._heartbeat(wall_s)
        if self.settings.act:
            if set_point is not None:
                target = (self.settings.system, self.settings.component)
                messages.append(set_point.message(self._clock.boot_ms(now), *target))
            if flight is not None:
                messages += self._sayings.of_decision(flight, close)
            if self.state is not before:
                messages += self._sayings.text(f"{self.state}")
        return TickOutcome(
            now,
            self.state,
            flight,
            why,
            elapsed,
            set_point,
            tuple(close),
            tuple(messages),
        )

    def farewell(self) -> list[Message]:
        """What is said last."""
        return self._sayings.text("ends, set-points stop")

    def _state_at(self, now: float, wall_s: float) -> LinkState:
        if self.mode is None or not (self.mode.armed and self.mode.follows):
            # Patience with a goal that does not come nearer begins when we are followed.
            self.system.progress = replace(self.system.progress, nearest_s=now)
        facts = LinkFacts(
            heartbeat_age_s=wall_s - self._heartbeat_s,
            position_age_s=math.inf if self._own is None else now - self._own.time_s,
            distances_age_s=None if self._sensor is None else now - self._distances.newest_s,
            restarted=self._restarted,
            arrived=self.system.progress.done(self.system.mission),
        )
        return link_state(facts, self.settings.limits)

    def _decide(self, now: float) -> tuple[FlightDecision | None, str, float]:
        if not self.state.decides:
            return None, "", 0.0
        for report in self._reports.values():
            self.system.update(report)
        self._reports.clear()
        why = self.system.due(now)
        if why is None:
            return None, "", 0.0
        started = time.perf_counter()
        flight = self.system.decide(now)
        return flight, why, time.perf_counter() - started

    def _set_point(self, now: float) -> SetPoint | None:
        offset = self._place.world_from_local_m
        if not self.state.steers or offset is None or self._own is None:
            return None
        if self.state is LinkState.ARRIVED:
            return self._holding(offset)
        if self.state is LinkState.STALE and now > self.system.holds_until_s:
            return None
        ahead = self._planned(now + self.settings.lead_s)
        movement = None if ahead is None else self.system.movement_at(ahead.time_s)
        if ahead is None or movement is None:
            return None
        climb = movement.climb_mps or 0.0
        return SetPoint.following(ahead.vector, movement.speed_mps, offset, climb_mps=climb)

    def _planned(self, time_s: float) -> State | None:
        """Where the plan has the vehicle; it begins with a decision, which news may be older than.

        None before the first decision and past the plan's end.
        """
        return self.system.state_at(max(time_s, self.system.buffer.start_s))

    def _holding(self, offset: FloatArray) -> SetPoint:
        """At the last goal, pointing as the plan left it; a vehicle that stays level, above or
        below it: on the way up or down nothing has been looked at."""
        assert self._own is not None
        yaw = float(self._own.attitude_rad[2])
        goal = self.system.mission.goals_m[-1]
        if self.system.planner.automaton.stays_level:
            if self._held_height_m is None:
                self._held_height_m = float(self._own.position_m[2])
            goal = np.array([goal[0], goal[1], self._held_height_m])
        return SetPoint.holding(goal, yaw, offset)

    def _heartbeat(self, wall_s: float) -> list[Message]:
        if wall_s - self._said_s < HEARTBEAT_S - 1e-3:
            return []
        self._said_s = wall_s
        if self.state is LinkState.WAITING:
            return [heartbeat(STANDBY)]
        return [heartbeat(ACTIVE if self.state.steers else CRITICAL)]
