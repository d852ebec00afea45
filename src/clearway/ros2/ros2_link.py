"""ROS 2 as a link for a mission: topics become what a session hears, decisions become topics."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from clearway.live.link.outcome import TickOutcome
from clearway.live.link.session import Session
from clearway.live.link.set_point import SetPoint
from clearway.ros2 import told
from clearway.ros2.bus import LATCHED, USUAL
from clearway.ros2.kinds import Heard
from clearway.ros2.topic_link import TopicLink

MOST_GOALS = 1000
MOST_REASONS = 16
OTHER_REASONS = "for other reasons"
"""Reasons why goals are refused that are counted one by one: they name heights, of any number."""


class Ros2Link(TopicLink[Session]):
    """A `live.link.outcome.Link` over any `TopicBus`."""

    told_always = (
        ("~/plan", "nav_msgs/msg/Path", LATCHED),
        ("~/way_out", "nav_msgs/msg/Path", LATCHED),
        ("~/decision", "std_msgs/msg/String", LATCHED),
        ("~/markers", "visualization_msgs/msg/MarkerArray", LATCHED),
    )

    def more_heard(self) -> list[Heard]:
        names, given = self.names, self.parameters
        return [
            Heard(names(given.goal), "geometry_msgs/msg/PoseStamped", USUAL, self._take_goal),
            Heard(names(given.path), "nav_msgs/msg/Path", USUAL, self._take_path),
        ]

    def _take_goal(self, message: Any, wall_s: float, topic: str) -> None:
        self._go_to([message], wall_s, topic)

    def _take_path(self, message: Any, wall_s: float, topic: str) -> None:
        self._go_to(list(message.poses), wall_s, topic)

    def _go_to(self, poses: list[Any], wall_s: float, topic: str) -> None:
        """Goals in place of the mission; refused as a whole where one is no place."""
        now, goals = self.session.clock.now(wall_s), []
        for one in poses[: MOST_GOALS + 1]:
            place = self.place_of(one, now, topic)
            if place is None:
                self.counts[f"{topic}: no place in the map frame"] += 1
                return
            goals.append(place)
        if not 0 < len(goals) <= MOST_GOALS:
            self.counts[f"{topic}: {len(goals)} goals"] += 1
            return
        refusal = self.session.hear_goal(np.array(goals), wall_s)
        if refusal is not None:
            refused = f"{topic}: refused, "
            known = [reason for reason in self.counts if reason.startswith(refused)]
            is_one_more = refused + refusal not in known and len(known) >= MOST_REASONS
            self.counts[refused + (OTHER_REASONS if is_one_more else refusal)] += 1

    @property
    def decision_topic(self) -> str:
        """Where decisions are reported."""
        return self.names("~/decision")

    # --- out ------------------------------------------------------------------------------

    def tick(self, wall_s: float) -> TickOutcome:
        outcome = self.session.tick(wall_s)
        if outcome.flight is not None:
            self._tell_decision(outcome)
        sends = partial(self._tell_set_point, outcome.set_point, outcome.time_s)
        outcome = self.handing.send(self.session, outcome, wall_s, sends)
        self.diagnose(outcome, wall_s)
        return replace(outcome, notes=(*outcome.notes, *self.news()))

    def _tell_decision(self, outcome: TickOutcome) -> None:
        flight, frame = outcome.flight, self.parameters.map_frame
        assert flight is not None
        time_s = flight.time_s
        self.publish("~/plan", told.path_message(flight.decision.path_m, time_s, frame))
        way = flight.decision.way_out_path_m
        self.publish("~/way_out", told.path_message(way, time_s, frame))
        self.publish("~/decision", told.string_of(told.decision_row(flight, outcome)))
        self.publish("~/markers", told.markers(flight, time_s, frame))

    def _tell_set_point(self, point: SetPoint | None, time_s: float) -> None:
        given = self.parameters
        if point is None or not self.session.terms.act:
            return
        for one in given.set_points.values():
            self.publish(one.topic, self.set_point_message(one, point, time_s))

    def end(self, *, crashed: bool = False) -> None:
        self.handing.end(self._farewell, crashed=crashed)

    def _farewell(self) -> None:
        """To hold, where the vehicle was led."""
        last = self.session.farewell() if self.session.terms.act else None
        self._tell_set_point(last, self.session.clock.now(time.monotonic()))
