"""What a node on topics hears and sends where it is one of PX4's flight modes.

It sends set-points only while PX4 flies its mode, and gives the vehicle up to PX4's Hold mode
whenever it doubts anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np

from clearway.base.frames import ned_from_enu
from clearway.base.state import State
from clearway.live.link.link_state import LinkState
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.status import VehicleStatus
from clearway.live.link.vehicle_clock import STRAYS, Tick
from clearway.mavlink.surroundings import Surroundings
from clearway.px4.mode import AGAIN_S, ARMED, Px4Mode
from clearway.px4.own_set_points import OwnSetPoints
from clearway.px4.own_state import Px4OwnState
from clearway.px4.releases import Release
from clearway.ros2.bus import SENSOR, USUAL, Quality, TopicBus
from clearway.ros2.kinds import Heard
from clearway.ros2.messages import pack_message, unpack_cdr
from clearway.ros2.parameters import Names, NodeParameters
from clearway.ros2.setup import NodeSetup
from clearway.ros2.topic_link import TopicLink
from clearway.ros2.topic_teller import S

TRUSTED = (
    LinkState.FLYING, LinkState.OTHER_MODE, LinkState.AGEING, LinkState.BLIND, LinkState.ARRIVED,
)  # fmt: skip
"""States of the link in which the mode is flown; in any other the vehicle is given up."""
BEGINS_S: Final = 0.3
"""After the mode becomes active it may take so long to the first set-point."""
INSISTS_S: Final = 1.0
"""For so long Hold is asked for before PX4 learns that the mode cannot be flown."""
STRANGE_S: Final = 1.0
"""Set-points of others are a reason to doubt for so long after the last one."""
OTHERS = "another program sends set-points to PX4 as well: end it, or let it command `--guard`"
APART = (
    "PX4 and the sensors tell times that lie apart: set PX4's UXRCE_DDS_SYNCT to 1, or "
    "use_sim_time in a simulation"
)
FAST = Quality(reliable=False, depth=20)
"""Odometry comes at 100 Hz, and is taken at every tick."""
NEEDED = ("VehicleStatus", "VehicleLandDetected", "VehicleLocalPosition", "VehicleOdometry")
FORGOTTEN = "PX4 no longer asks for the mode: it was restarted, or its agent is gone"


class Faces(NamedTuple):
    """What a link faces: a release of PX4, and people."""

    release: Release
    notice: Callable[[str], None]


class Px4Topics(TopicLink[S]):
    """The side of a node that faces PX4."""

    def __init__(
        self,
        bus: TopicBus,
        session: S,
        parameters: NodeParameters,
        names: Names,
        setup: NodeSetup,
        faces: Faces,
    ) -> None:
        given = parameters.px4
        self.release, self.notice = faces
        self.place = Px4OwnState(setup.origin, session.counts)
        self.mode = Px4Mode(
            self.release, given.name, self._send, replaces_offboard=given.replaces_offboard
        )
        self._surroundings = Surroundings(session, setup.sensor, session.counts)
        self._set_point_topic = given.prefix.rstrip("/") + self.release.topic("TrajectorySetpoint")
        self.own_set_points = OwnSetPoints()
        self._strange_s = self._active_s = self._held_s = self._given_up_s = -math.inf
        self._is_armed, self._nav_state = False, -1
        self._airborne: bool | None = None
        self._doubt = self._given_up = ""
        """Why PX4 may not choose the mode now; and why a mode that is still active was left."""
        self._resets, self._has_completed = 0, False
        self.activations, self.is_forgotten = 0, False
        """How often PX4 has begun to fly the mode; whether it no longer knows of it."""
        super().__init__(bus, session, parameters, names, setup.lidars, setup.origin)

    def own_heard(self) -> list[Heard]:
        mode = self.mode
        takers: dict[str, Callable[[Any, float, str], None]] = {
            "VehicleStatus": self._take_status,
            "VehicleLandDetected": self._take_landed,
            "VehicleLocalPosition": self._take_local,
            "VehicleOdometry": self._take_odometry,
            "HomePosition": self._take_home,
            "ArmingCheckRequest": self._take_question,
            "RegisterExtComponentReply": lambda reply, _s, _t: mode.hear_registered(reply),
            "MessageFormatResponse": lambda reply, _s, _t: mode.hear_format(reply),
            "SetpointConfigReply": lambda reply, _s, _t: mode.hear_configured(reply),
            "TrajectorySetpoint": self._take_set_point,
        }
        heard = [
            Heard(self.topic(name), self.release.kind(name), FAST, take, name in NEEDED)
            for name, take in takers.items()
            if name in self.release.messages
        ]
        distances = self.parameters.px4.distances
        if distances:
            topic, kind = self.names(distances), "px4_msgs/msg/ObstacleDistance"
            heard.append(Heard(topic, kind, SENSOR, self._take_distances, True))
        return heard

    def _list_published(self) -> list[tuple[str, str, Quality]]:
        into = (name for name in self.release.messages if "/fmu/in/" in self.release.topic(name))
        told = [(self.topic(name), self.release.kind(name), USUAL) for name in into]
        return [
            *super()._list_published(),
            *(one for one in told if one[0] != self._set_point_topic),
        ]

    def topic(self, message: str) -> str:
        """The topic of a message of PX4's."""
        return self.parameters.px4.prefix.rstrip("/") + self.release.topic(message)

    @property
    def is_active(self) -> bool:
        """Whether PX4 flies our mode."""
        return self._is_armed and self._nav_state == self.mode.mode_id

    @property
    def leads(self) -> bool:
        """Whether set-points are sent: PX4 flies our mode, and nothing is in doubt."""
        return self.is_active and not self._doubt

    # --- in -------------------------------------------------------------------------------

    def hear(self, wall_s: float) -> None:
        super().hear(wall_s)
        if self.parameters.act:
            self.mode.ask(wall_s)

    def _take_status(self, message: Any, wall_s: float, _topic: str) -> None:
        was_active = self.is_active
        self._is_armed, self._nav_state = message.arming_state == ARMED, int(message.nav_state)
        if self.is_active and not was_active:
            self.mode.configure(applies=True)
            self._active_s, self._given_up, self._has_completed = wall_s, "", False
            self.activations += 1
            self.notice(f"PX4 flies the mode {self.mode.name!r}")
        elif was_active and not self.is_active:
            why = f"; it was given up: {self._given_up}" if self._given_up else ""
            self.notice(f"PX4 flies another mode, nav_state {self._nav_state}{why}")
            self._given_up = ""
        status = VehicleStatus(self._is_armed, self.is_active, self._airborne)
        self.session.hear_status(status, wall_s)

    def _take_landed(self, message: Any, _wall_s: float, _topic: str) -> None:
        self._airborne = not message.landed

    def _take_local(self, message: Any, _wall_s: float, _topic: str) -> None:
        # Of several topics that waited one would seem to be from the past: odometry tells the time.
        self.place.take_local(message)

    def _take_odometry(self, message: Any, wall_s: float, topic: str) -> None:
        if not self.session.hear_time(1e-6 * message.timestamp, wall_s):
            return
        motion = self.place.take_odometry(message, with_attitude=not self.parameters.px4.distances)
        if motion is None or self.place.flaw:
            self.topics[topic].refused += 1
            return
        self.topics[topic].age_s = max(0.0, self.session.clock.now(wall_s) - motion.time_s)
        self.session.hear_motion(motion)
        if motion.attitude_rad is not None:
            state = State(motion.position_m, motion.attitude_rad, time_s=motion.time_s)
            self._clouds.move(state, motion.heading_rad)

    def _take_home(self, message: Any, _wall_s: float, _topic: str) -> None:
        offset = self.place.world_from_local_m
        if message.valid_lpos and offset is not None and self.parameters.ground_m is None:
            self.session.hear_ground(float(offset[2]) - float(message.z))

    def _take_question(self, message: Any, wall_s: float, _topic: str) -> None:
        # PX4 goes to Hold as commanded, before a "no" has it choose a failsafe of its own.
        insists = self.is_active and wall_s <= self._given_up_s + INSISTS_S
        self.mode.hear_question(message, wall_s, can_run=not self._doubt or insists)

    def _take_set_point(self, message: Any, wall_s: float, _topic: str) -> None:
        if not self.own_set_points.has(pack_message(message)):
            self._strange_s = wall_s

    def _take_distances(self, message: Any, wall_s: float, _topic: str) -> None:
        circle = SimpleNamespace(
            frame=message.frame, distances=message.distances, increment_f=message.increment,
            angle_offset=message.angle_offset, min_distance=message.min_distance,
            max_distance=message.max_distance, time_usec=message.timestamp,
        )  # fmt: skip
        self._surroundings.take_circle(circle, wall_s)

    # --- out ------------------------------------------------------------------------------

    def before_tick(self, wall_s: float) -> None:
        """Note what of PX4 speaks against set-points; raises what speaks against all of it."""
        if self.mode.refusal is not None:
            raise self.mode.refusal
        self._note_resets(wall_s)
        self._doubt = self._given_up or self._doubt_of_px4(wall_s)

    def after_tick(self, outcome: TickOutcome, wall_s: float) -> TickOutcome:
        """Give the vehicle up where the session is in doubt; what came of the tick."""
        if outcome.state is LinkState.RELIEVED:
            return outcome  # The second process leads: a Hold would end its escape.
        self._doubt = self._doubt or self.doubt_of_link(outcome, wall_s)
        if self.is_active:
            self._act(outcome, wall_s)
        self.is_forgotten = self.mode.is_forgotten(wall_s)
        if self.is_forgotten:
            return replace(outcome, state=LinkState.RESTARTED, why_state=FORGOTTEN)
        return replace(outcome, why_state=outcome.why_state or self._doubt)

    def _act(self, outcome: TickOutcome, wall_s: float) -> None:
        """Give up where there is any doubt; tell PX4 once that all is done."""
        if self._doubt and not self._given_up:
            self._give_up(self._doubt, wall_s)
        if self._given_up:
            if wall_s >= self._held_s + AGAIN_S:
                self._held_s = wall_s
                self.mode.hold()
        elif outcome.state is LinkState.ARRIVED and not self._has_completed:
            self._has_completed = True
            self.mode.complete()

    def _give_up(self, why: str, wall_s: float) -> None:
        self._given_up, self._given_up_s = why, wall_s
        self.notice(f"gives the vehicle up to PX4's Hold: {why}")

    def _note_resets(self, wall_s: float) -> None:
        """Where the estimate has jumped, nobody knows where seen space lies."""
        if self.place.resets == self._resets:
            return
        self._resets = self.place.resets
        self.session.forget_free_space()
        self.counts[self.place.why_reset] += 1
        if self.is_active and not self._given_up:
            self._give_up(self.place.why_reset, wall_s)

    def _doubt_of_px4(self, wall_s: float) -> str:
        """Why no set-point is sent, whatever the session says; "" for no reason."""
        if self.mode.flaw and self.parameters.act:
            return self.mode.flaw
        if wall_s - self._strange_s <= STRANGE_S:
            return OTHERS
        return self.place.flaw

    def doubt_of_link(self, outcome: TickOutcome, wall_s: float) -> str:
        state, more = outcome.state, outcome.why_state
        if self.session.refusal is not None:
            return self.session.refusal
        if state is LinkState.WAITING and self.counts[str(Tick.STRAY)] >= STRAYS:
            return APART
        if state not in TRUSTED and (self.is_active or state is not LinkState.ON_GROUND):
            return f"{state}{': ' if more else ''}{more}"
        if self.is_active and outcome.set_point is None and wall_s > self._active_s + BEGINS_S:
            return "there is no set-point to send"
        return ""

    def publish(self, name: str, message: Any) -> None:
        """Set-points only where PX4 flies our mode and nothing is in doubt, and in PX4's frame."""
        if name != self._set_point_topic:
            super().publish(name, message)
            return
        if not self.leads:
            return
        kind = self.release.kind("TrajectorySetpoint")
        told = unpack_cdr(message, kind) if isinstance(message, bytes) else message
        raw = self.in_local_frame(told)
        self.own_set_points.note_sent(raw)
        super().publish(name, raw)

    def in_local_frame(self, told: Any) -> bytes:
        """A TrajectorySetpoint of the world in PX4's local frame, serialised."""
        offset = self.place.world_from_local_m
        assert offset is not None  # A set-point follows an own state.
        told.position = (told.position - ned_from_enu(offset)).astype(np.float32)
        told.timestamp = 0  # PX4 sets its own.
        return pack_message(told)

    def _send(self, message: str, told: Any) -> None:
        super().publish(self.topic(message), told)

    def leave(self) -> None:
        """Out of PX4, which holds where it flew our mode; not where the second process flies it."""
        if not self.handing.hand.relieved:
            if self.is_active:
                self.mode.hold()
            self.mode.unregister()
