"""A guardian over MAVLink: commands of a pilot or planner in, what may be flown of them out."""

from __future__ import annotations

import math
from collections import Counter

from clearway.base.errors import InputError
from clearway.live.guard.guard_session import GuardSession
from clearway.live.link.guarded import Guarded
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.own_motion import OwnMotion
from clearway.live.link.set_point import SetPoint
from clearway.mavlink import dialect as known
from clearway.mavlink.boot_time import boot_ms
from clearway.mavlink.dialect import Message
from clearway.mavlink.inbox import ReceivedMessage
from clearway.mavlink.mavlink_session import MavlinkSession, MavlinkTerms
from clearway.mavlink.wishes import (
    Sticks,
    encode_velocity,
    is_of_velocity,
    of_set_point,
    of_sticks,
    same_again,
)
from clearway.sensors import Lidar

COMMANDS = {known.SET_POSITION_TARGET_LOCAL_NED: 8, known.MANUAL_CONTROL: 8}
"""Messages that wish something, and how many of each are decoded at a tick, the newest."""
SAID_S = 5.0
"""What the guardian does is not told more often."""
NOTICE = 5
"""MAV_SEVERITY_NOTICE."""
NO_STICKS = "wish: sticks are not for a vehicle that cannot stop"
STICKS_REFUSED = "sticks are refused: the vehicle of the mission cannot stop"
STICKS_NEED = 'for a copter, set kind = "multirotor" in [vehicle]'
NO_FRAME = "wish: where the local frame lies is not known yet"
OTHER_VEHICLE = "wish: for another vehicle"
UNUSABLE = "wish: cannot be used"


class GuardMavlinkSession(MavlinkSession[GuardSession]):
    """Feed it with `take` and `take_wish`, and ask it with `tick` at a set rate."""

    def __init__(
        self, core: GuardSession, sensor: Lidar | None, terms: MavlinkTerms, counts: Counter[str]
    ) -> None:
        super().__init__(core, sensor, terms, counts)
        self._sticks = Sticks.of(core.planner)
        self._by_velocity = False  # Whether velocities were sent last, or places.
        self._said: bool | None = None
        self._said_s = self._refused_s = -math.inf

    def take_wish(self, arrival: ReceivedMessage, wall_s: float) -> None:
        """What somebody commands; what is no command is counted."""
        try:
            self._take_wish(arrival.message, arrival.number, wall_s)
        except InputError:
            self.counts[UNUSABLE] += 1

    def _take_wish(self, message: Message, number: int, wall_s: float) -> None:
        if number == known.MANUAL_CONTROL:
            if message.target not in (0, self.terms.system):
                self.counts[OTHER_VEHICLE] += 1
            elif self._sticks is None:
                self.counts[NO_STICKS] += 1
                self._refuse_sticks(wall_s)
            else:
                self.core.hear_wish(of_sticks(message, self._sticks), None, wall_s)
            return
        offset = self.place.world_from_local_m
        if message.target_system not in (0, self.terms.system):
            self.counts[OTHER_VEHICLE] += 1
        elif offset is None:
            self.counts[NO_FRAME] += 1
        else:
            maker = of_set_point(message, offset, self.core.speed_mps)
            self.core.hear_wish(maker, message, wall_s)

    def _refuse_sticks(self, wall_s: float) -> None:
        """Say so to the pilot and on the screen: else nothing happens, and nobody knows why."""
        if wall_s - self._refused_s < SAID_S:
            return
        self._refused_s = wall_s
        self._answers.notes.append(f"{STICKS_REFUSED}; {STICKS_NEED}")
        if self.terms.session.act:
            self._outgoing += self.sayings.text(STICKS_REFUSED)

    def _lead_vehicle(self, outcome: TickOutcome) -> list[Message]:
        guarded = outcome.guarded
        if guarded is None or outcome.set_point is None:
            return self._set_points(outcome.set_point, outcome.time_s)
        at = (boot_ms(outcome.time_s), self.terms.system, self.terms.component)
        messages = self._why(guarded, outcome.time_s)
        if outcome.wished is not None:
            self._by_velocity = is_of_velocity(outcome.wished)
            return [same_again(outcome.wished, *at), *messages]
        if guarded.is_velocity:
            self._by_velocity = True
            rate = guarded.yaw_rate_rps
            return [encode_velocity(guarded.velocity_mps, rate, *at), *messages]
        return [*self._set_points(outcome.set_point, outcome.time_s), *messages]

    def encode(
        self, set_point: SetPoint, time_s: float, own: OwnMotion | None = None
    ) -> list[Message]:
        """As velocities, where velocities are wished: with another kind of set-point ArduCopter
        begins a controller anew, and takes what it accelerates by for wind. To hold ends that."""
        if not self._by_velocity or set_point.velocity_mps is None:
            return super().encode(set_point, time_s)
        place, heading = set_point.position_m, set_point.yaw_rad
        if own is not None:
            place, heading = own.position_m, own.heading_rad
        velocity, rate = set_point.as_velocity(place, heading, self.core.speed_mps)
        at = (boot_ms(time_s), self.terms.system, self.terms.component)
        return [encode_velocity(velocity, rate, *at, set_point.acceleration_mps2)]

    def _why(self, guarded: Guarded, time_s: float) -> list[Message]:
        """A sentence where the guardian steps in, or no longer does."""
        if guarded.is_wish is self._said or time_s - self._said_s < SAID_S:
            return []
        first, self._said, self._said_s = self._said is None, guarded.is_wish, time_s
        if guarded.is_wish:
            return [] if first else self.sayings.text("the wish passes again", NOTICE)
        return self.sayings.text(guarded.why)
