"""A guardian on topics: somebody's commands in, what may be flown of them out."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Any

from clearway.base.frames import FloatArray
from clearway.live.guard.guard_session import GuardSession
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.set_point import SetPoint
from clearway.ros2 import told
from clearway.ros2.bus import LATCHED, Quality
from clearway.ros2.kinds import SET_POINT_KINDS, Heard
from clearway.ros2.messages import pack_message
from clearway.ros2.parameters import SetPointParameters
from clearway.ros2.topic_link import TopicLink
from clearway.ros2.wishes import wish_maker

NEWEST = Quality(reliable=False, depth=1)
"""Of commands the newest counts; a reader of best effort hears reliable ones too."""


class GuardLink(TopicLink[GuardSession]):
    """A `live.link.outcome.Link` over any `TopicBus`."""

    told_always = (
        ("~/plan", "nav_msgs/msg/Path", LATCHED),
        ("~/way_out", "nav_msgs/msg/Path", LATCHED),
        ("~/decision", "std_msgs/msg/String", LATCHED),
    )

    def more_heard(self) -> list[Heard]:
        given = self.parameters.guard
        kind = SET_POINT_KINDS[given.type]
        return [Heard(self.names(given.topic), kind, NEWEST, self._take_wish, True)]

    def _take_wish(self, message: Any, wall_s: float, topic: str) -> None:
        session, given = self.session, self.parameters
        now = session.clock.now(wall_s)

        def place_of(pose: Any) -> FloatArray | None:
            return self.place_of(pose, now, topic)

        speed = given.guard.speed_mps or session.speed_mps
        maker = wish_maker(message, given, speed, place_of)
        session.hear_wish(maker, pack_message(message), wall_s)

    # --- out ------------------------------------------------------------------------------

    def tick(self, wall_s: float) -> TickOutcome:
        outcome = self.session.tick(wall_s)
        guarded, frame = outcome.guarded, self.parameters.map_frame
        sends = partial(self._tell_set_point, outcome)
        outcome = self.handing.send(self.session, outcome, wall_s, sends)
        if guarded is not None:
            self.publish("~/decision", told.string_of(told.make_guarded_row(outcome)))
            decision = guarded.decision
            if decision is not None:
                time_s = outcome.time_s
                self.publish("~/plan", told.path_message(decision.path_m, time_s, frame))
                way = decision.way_out_path_m
                self.publish("~/way_out", told.path_message(way, time_s, frame))
        self.diagnose(outcome, wall_s, "" if guarded is None else guarded.why)
        return replace(outcome, notes=(*outcome.notes, *self.news()))

    def _tell_set_point(self, outcome: TickOutcome) -> None:
        if outcome.set_point is not None and self.session.terms.act:
            for one in self.parameters.set_points.values():
                self.publish(one.topic, self._message(one, outcome, outcome.set_point))

    def _message(self, one: SetPointParameters, outcome: TickOutcome, point: SetPoint) -> Any:
        """The wish as it came where it passed, else what is flown in its place."""
        given, time_s = self.parameters, outcome.time_s
        same = one.type == given.guard.type and one.frame == given.guard.frame
        if same and outcome.wished is not None:
            return outcome.wished
        guarded = outcome.guarded
        if guarded is None or not guarded.is_velocity or one.type == "Path":
            return self.set_point_message(one, point, time_s)
        velocity, rate = guarded.velocity_mps, guarded.yaw_rate_rps
        if one.type in ("Twist", "TwistStamped"):
            return self.velocity_message(one, velocity, rate, time_s)
        return told.make_velocity_message(one.type, velocity, rate, time_s, given.map_frame)

    def end(self, *, crashed: bool = False) -> None:
        self.handing.end(self._farewell, crashed=crashed)

    def _farewell(self) -> None:
        """To hold, where the vehicle was led."""
        last = self.session.farewell() if self.session.terms.act else None
        if last is None:
            return
        time_s = self.session.clock.now(time.monotonic())
        for one in self.parameters.set_points.values():
            self.publish(one.topic, self.set_point_message(one, last, time_s))
