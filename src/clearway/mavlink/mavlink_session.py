"""A session over MAVLink: messages become what a session hears, and what it says becomes messages.

No link and no clock: `take` and `tick` are told the time of our monotonic clock.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from clearway.avoidance.plan.time_cost import speed_abilities
from clearway.base.frames import FloatArray, enu_from_ned
from clearway.live.link.hearing import Hearing, SessionTerms
from clearway.live.link.link_state import LinkState
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.own_motion import OwnMotion
from clearway.live.link.set_point import SetPoint
from clearway.mavlink import dialect as known
from clearway.mavlink.accuracy import StatedAccuracy
from clearway.mavlink.adsb import read_adsb_aircraft
from clearway.mavlink.answers import Answers
from clearway.mavlink.boot_time import boot_ms, time_of
from clearway.mavlink.dialect import Message
from clearway.mavlink.inbox import ReceivedMessage
from clearway.mavlink.mode import airborne_by, status_of
from clearway.mavlink.outbox import ACTIVE, CRITICAL, STANDBY, heartbeat
from clearway.mavlink.own_state import MILLIMETRE, OwnPlace
from clearway.mavlink.parameters import Parameters
from clearway.mavlink.reasons import Sayings
from clearway.mavlink.remote_id import FIX_3D, drone_of
from clearway.mavlink.set_points import encode_set_point
from clearway.mavlink.streams import Streams, streams_for
from clearway.mavlink.surroundings import Surroundings
from clearway.sensors import Lidar

S = TypeVar("S", bound=Hearing)
ACCURACIES = (
    known.LOCAL_POSITION_NED_COV,
    known.ODOMETRY,
    known.ESTIMATOR_STATUS,
    known.EKF_STATUS_REPORT,
)
QUESTIONS = (
    known.COMMAND_INT,
    known.COMMAND_LONG,
    known.SET_POSITION_TARGET_GLOBAL_INT,
    known.TIMESYNC,
)
HEARTBEAT_S = 1.0
"""Between our heartbeats."""
NO_PLACE_IN_TARGET = 0x007
"""Bits of a type mask that leave the position out."""


@dataclass(frozen=True, slots=True)
class MavlinkTerms:
    """What the link needs to know beside the session."""

    system: int = 1
    component: int = 1
    """The autopilot's."""
    position_std_m: float = 0.0
    """Of the own position at least; the link may tell more."""
    mission_origin: tuple[float, float, float] | None = None
    asks: bool = False
    """Whether streams and parameters are asked for."""
    session: SessionTerms = field(default_factory=SessionTerms)


class MavlinkSession(Generic[S]):
    """Feed it with `take`, and ask it with `tick` at a set rate; see `live.link.session`."""

    def __init__(
        self,
        core: S,
        sensor: Lidar | None,
        terms: MavlinkTerms,
        counts: Counter[str],
    ) -> None:
        self.core: S = core
        self.terms, self.counts = terms, counts
        self.place = OwnPlace(terms.mission_origin, counts)
        self.parameters = Parameters()
        self._sensor = sensor
        self._accuracy = StatedAccuracy(terms.position_std_m, counts)
        self._surroundings = Surroundings(self.core, sensor, counts)
        pitches = not core.planner.automaton.stays_level
        wanted = streams_for(
            act=terms.session.act or terms.asks, pitches=pitches, sensor=sensor is not None
        )
        self._streams = Streams(wanted, asks=terms.asks)
        self._answers = Answers(terms.system, terms.component, self._fly_to, self._pause)
        self._airborne: bool | None = None
        self._geoid_m: float | None = None
        self._beat: Message | None = None
        self._beat_s = self._heard_s = -math.inf
        self._wall_s = 0.0
        self._outgoing: list[Message] = []
        self.sayings = Sayings()
        self.by_kind: dict[int, Callable[[Message, float], None]] = {
            known.GPS_GLOBAL_ORIGIN: lambda message, _: self.place.take_origin(message),
            known.HOME_POSITION: lambda message, _: self.place.take_home(message),
            known.EXTENDED_SYS_STATE: self._take_landed,
            known.ADSB_VEHICLE: self._take_traffic,
            known.OPEN_DRONE_ID_LOCATION: self._take_drone,
            known.GPS_RAW_INT: self._take_geoid,
            known.OBSTACLE_DISTANCE: self._surroundings.take_circle,
            known.DISTANCE_SENSOR: self._take_sector,
            known.SYS_STATUS: self._surroundings.take_health,
            known.OBSTACLE_DISTANCE_3D: self._take_obstacle,
            known.POSITION_TARGET_LOCAL_NED: self._take_target,
            known.PARAM_VALUE: lambda message, _: self.parameters.hear(message),
            known.COMMAND_ACK: lambda message, _: self._streams.hear_answer(message),
        }

    @property
    def asked_mps2(self) -> float | None:
        """The greatest acceleration that plans ask for; None of a vehicle without inertia."""
        automaton = self.core.planner.automaton
        return speed_abilities(automaton).acceleration_mps2 if automaton.has_inertia else None

    # --- in -------------------------------------------------------------------------------

    def take(self, arrival: ReceivedMessage, wall_s: float) -> bool:
        """Use one message; true for a heartbeat of the autopilot."""
        message, number = arrival.message, arrival.number
        self._wall_s = wall_s
        self._streams.hear(number, wall_s)
        if number == known.HEARTBEAT:
            self._beat, self._heard_s = message, wall_s
            self.core.hear_status(status_of(message, self._airborne), wall_s)
            return True
        if number in (known.ATTITUDE, known.LOCAL_POSITION_NED, known.GLOBAL_POSITION_INT):
            self._take_timed(message, number, wall_s)
        elif number in ACCURACIES:
            self._accuracy.take(message, number)
        elif number in QUESTIONS:
            self._outgoing += self._answers.to(message, number, arrival.sender)
        elif number in self.by_kind:
            self.by_kind[number](message, wall_s)
        ground = self.place.ground_m
        if ground is not None:
            self.core.hear_ground(ground)
        return False

    def _take_timed(self, message: Message, number: int, wall_s: float) -> None:
        clock = self.core.clock
        time_s = time_of(message.time_boot_ms, clock.newest_s)
        if not self.core.hear_time(time_s, wall_s):
            return
        oldest = self.terms.session.limits.stale_s
        if number == known.ATTITUDE:
            self.place.take_attitude(message, time_s)
            return
        if number == known.LOCAL_POSITION_NED:
            motion = self.place.take_local(message, time_s, oldest)
        else:
            motion = self.place.take_global(message, time_s, oldest)
        if motion is not None:
            accuracy = self._accuracy
            self.core.hear_motion(
                replace(
                    motion,
                    position_std_m=accuracy.position_std_m,
                    attitude_std_rad=accuracy.attitude_std_rad,
                )
            )

    def _take_landed(self, message: Message, _wall_s: float) -> None:
        self._airborne = airborne_by(message)
        if self._beat is not None:
            self.core.hear_status(status_of(self._beat, self._airborne), self._heard_s)

    def _take_traffic(self, message: Message, wall_s: float) -> None:
        own = self.core.motion
        height = None if own is None else float(own.position_m[2])
        report = read_adsb_aircraft(message, self.place.origin_geodetic, height, self.counts)
        if report is not None:
            self.core.hear_aircraft(report, wall_s)

    def _take_drone(self, message: Message, wall_s: float) -> None:
        own = self.core.motion
        height = None if own is None else float(own.position_m[2])
        origin = self.place.origin_geodetic
        report = drone_of(message, origin, height, self._geoid_m, self.counts)
        if report is not None:
            self.core.hear_aircraft(report, wall_s)

    def _take_geoid(self, message: Message, _wall_s: float) -> None:
        if message.fix_type >= FIX_3D and message.alt_ellipsoid:
            self._geoid_m = MILLIMETRE * (message.alt_ellipsoid - message.alt)

    def _take_sector(self, message: Message, wall_s: float) -> None:
        time_s = time_of(message.time_boot_ms, self.core.clock.newest_s)
        own = message.get_srcComponent() == self.terms.component
        self._surroundings.take_sector(message, time_s, wall_s, by_autopilot=own)

    def _take_obstacle(self, message: Message, _wall_s: float) -> None:
        time_s = time_of(message.time_boot_ms, self.core.clock.newest_s)
        self._surroundings.take_obstacle(message, time_s)

    def _take_target(self, message: Message, _wall_s: float) -> None:
        offset = self.place.world_from_local_m
        if offset is not None and not message.type_mask & NO_PLACE_IN_TARGET:
            self.core.hear_target(enu_from_ned([message.x, message.y, message.z]) + offset)

    def _fly_to(self, geodetic: FloatArray, above_home: bool) -> str | None:
        if not self.terms.session.act:
            return "read-only"
        place = self.place.place_of(geodetic, above_home=above_home)
        if place is None:
            return "the place of the local frame, or of the home, is not known"
        return self.core.hear_goal(place, self._wall_s)

    def _pause(self) -> str | None:
        own = self.core.motion
        if not self.terms.session.act or own is None:
            return "read-only" if own else "the own position is not known"
        return self.core.hear_goal(own.position_m, self._wall_s)

    # --- out ------------------------------------------------------------------------------

    def tick(self, wall_s: float) -> TickOutcome:
        """Decide if it is due and allowed, and make the messages that say so."""
        self._surroundings.flush(wall_s)
        before = self.core.state
        outcome = self.core.tick(wall_s)
        messages = [*self._outgoing, *self._heartbeat(wall_s)]
        self._outgoing.clear()
        target = (self.terms.system, self.terms.component)
        if self.terms.asks and self.core.status is not None:
            messages += self._streams.to_ask(wall_s, *target)
            messages += self.parameters.to_ask(wall_s, *target)
        if self.terms.session.act:
            messages += self._lead_vehicle(outcome)
            if outcome.state is not before:
                why = f": {outcome.why_state}" if outcome.why_state else ""
                messages += self.sayings.text(f"{outcome.state}{why}")
        return replace(outcome, messages=tuple(messages), notes=self._notes(wall_s))

    def missing(self, wall_s: float) -> list[str]:
        """What does not come of what an acting session needs."""
        names = self._streams.find_needed(wall_s, sensor=self._sensor is not None)
        return [f"missing: {self._streams.how((name,))}" for name in names]

    def _notes(self, wall_s: float) -> tuple[str, ...]:
        """What the observer is told now."""
        said, self._answers.notes = self._answers.notes, []
        if self.core.status is not None:
            waiting = self.core.state in (LinkState.WAITING, LinkState.ON_GROUND)
            said += self._streams.notes(wall_s, sensor=self._sensor is not None, waiting=waiting)
        return (*said, *self.parameters.news(self.core.speed_mps, self.asked_mps2))

    def _lead_vehicle(self, outcome: TickOutcome) -> list[Message]:
        """What the vehicle is told, and why."""
        messages = self._set_points(outcome.set_point, outcome.time_s)
        if outcome.flight is not None:
            messages += self.sayings.of_decision(outcome.flight, outcome.approaches)
        return messages

    def _set_points(self, set_point: SetPoint | None, time_s: float) -> list[Message]:
        return [] if set_point is None else self.encode(set_point, time_s, self.core.motion)

    def encode(
        self, set_point: SetPoint, time_s: float, _own: OwnMotion | None = None
    ) -> list[Message]:
        """A set-point as messages; none while nobody knows where the local frame lies.

        own: where the vehicle is then; None takes it to be where it should be.
        """
        offset = self.place.world_from_local_m
        if offset is None:
            return []
        target = (self.terms.system, self.terms.component)
        return [encode_set_point(set_point, offset, boot_ms(time_s), *target)]

    def farewell(self, wall_s: float) -> list[Message]:
        """What is said last: to hold, where the vehicle was led, and that this ends."""
        if not self.terms.session.act:
            return []
        holds = self._set_points(self.core.farewell(), self.core.clock.now(wall_s))
        return holds + self.sayings.text("ends, set-points stop")

    def _heartbeat(self, wall_s: float) -> list[Message]:
        if wall_s - self._beat_s < HEARTBEAT_S - 1e-3:
            return []
        self._beat_s = wall_s
        if self.core.state in (LinkState.WAITING, LinkState.ON_GROUND):
            return [heartbeat(STANDBY)]
        return [heartbeat(ACTIVE if self.core.state.steers else CRITICAL)]
