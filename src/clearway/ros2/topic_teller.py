"""What every node of ours says on topics: set-points, diagnostics, and what it left out."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, Generic, TypeVar

from clearway.base.frames import FloatArray
from clearway.live.link.hearing import Hearing
from clearway.live.link.link_state import LinkState
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.set_point import SetPoint
from clearway.ros2 import told
from clearway.ros2.bus import USUAL, MissingMessageError, Quality, TopicBus
from clearway.ros2.heard import HeardTopic
from clearway.ros2.kernel import count_dropped_datagrams
from clearway.ros2.kinds import SET_POINT_KINDS, base_of
from clearway.ros2.messages import pack_message
from clearway.ros2.parameters import Names, NodeParameters, SetPointParameters
from clearway.ros2.placed_clouds import WRONG_FRAMES
from clearway.ros2.transforms import NO_TRANSFORM

S = TypeVar("S", bound=Hearing)
DIAGNOSED_S = 1.0
DIAGNOSTICS = ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", USUAL)


class TopicTeller(Generic[S]):
    """The half of a node that publishes."""

    told_always: tuple[tuple[str, str, Quality], ...] = ()
    """Topics that are published whatever the parameters say."""

    def __init__(self, bus: TopicBus, session: S, parameters: NodeParameters, names: Names) -> None:
        self.bus, self.session, self.parameters, self.names = bus, session, parameters, names
        self.counts: Counter[str] = session.counts
        self.topics: dict[str, HeardTopic] = {}
        self.published: Counter[str] = Counter()
        self._said, self._untold = set[str](), set[str]()
        self._unheard: list[str] = []
        self._diagnosed_s = -math.inf
        self._dropped_before = count_dropped_datagrams() or 0

    def _advertise(self) -> None:
        for name, kind, quality in self._list_published():
            topic = self.names(name)
            try:
                self.bus.advertise(topic, kind, quality)
            except MissingMessageError as missing:
                if (name, kind, quality) not in (*self.told_always, DIAGNOSTICS):
                    raise
                self._untold.add(topic)
                self.counts[f"{topic}: not published, {missing}"] += 1

    def _list_published(self) -> list[tuple[str, str, Quality]]:
        """Topics, kinds and qualities of what is published."""
        given = self.parameters
        told = [*self.told_always, DIAGNOSTICS]
        set_points = given.set_points.values() if given.act else ()
        return told + [(one.topic, SET_POINT_KINDS[one.type], USUAL) for one in set_points]

    def diagnose(self, outcome: TickOutcome, wall_s: float, words: str = "") -> None:
        """Once a second, of a recording once a second of its own: the state of the link, and every
        topic."""
        now_s = outcome.time_s if self.bus.recorded else wall_s
        if now_s - self._diagnosed_s < DIAGNOSED_S:
            return
        self._diagnosed_s = now_s
        values: dict[str, object] = {
            topic: heard.words(topic, self.bus).removeprefix(f"{topic} ")
            for topic, heard in self.topics.items()
            if heard.needed or heard.messages
        }
        dropped = self.dropped
        if dropped:
            values["datagrams dropped by the kernel"] = dropped
        values |= {f"{topic}: lost on the way": n for topic, n in self.bus.lost.items()}
        values |= dict(self.session.left_out.most_common(20))
        level = told.OK if outcome.state in (LinkState.FLYING, LinkState.ARRIVED) else told.WARN
        lost = (LinkState.POSITION_LOST, LinkState.SENSOR_LOST, LinkState.LINK_LOST)
        level = told.ERROR if outcome.state in lost else level
        more = outcome.why_state or words
        words = f"{outcome.state}{': ' if more else ''}{more}"
        now = self.session.clock.now(wall_s)
        self.publish("/diagnostics", told.diagnostics("clearway", level, words, values, now))

    def set_point_message(self, one: SetPointParameters, point: SetPoint, time_s: float) -> Any:
        """A set-point as the message of a topic; of velocity alone, drawn to its place."""
        given, motion = self.parameters, self.session.motion
        if one.type not in ("Twist", "TwistStamped") or motion is None:
            return told.make_set_point_message(one.type, point, time_s, given.map_frame)
        place, heading = motion.position_m, motion.heading_rad
        velocity, rate = point.as_velocity(place, heading, self.session.speed_mps)
        return self.velocity_message(one, velocity, rate, time_s)

    def velocity_message(
        self, one: SetPointParameters, velocity_mps: FloatArray, rate_rps: float, time_s: float
    ) -> Any:
        """A Twist, in the body as it points now, or in the map."""
        given, motion = self.parameters, self.session.motion
        base = base_of(one, given)
        yaw = None if base is None or motion is None else motion.heading_rad
        frame = base or given.map_frame
        return told.twist_message(one.type, velocity_mps, rate_rps, time_s, frame, yaw)

    def publish(self, name: str, message: Any) -> None:
        """A message, or one in CDR as it came, on a topic by its name in the parameters."""
        topic = self.names(name)
        if topic in self._untold:
            return
        raw = message if isinstance(message, bytes) else pack_message(message)
        if self.bus.publish(topic, raw):
            self.published[topic] += 1
        else:
            self.counts[f"{topic}: could not be sent"] += 1

    def news(self) -> list[str]:
        """Reasons for which something was left out for the first time."""
        fresh = [reason for reason in self.counts if reason not in self._said]
        self._said.update(fresh)
        return fresh

    @property
    def dropped(self) -> int:
        """Datagrams that the kernel dropped for full buffers since we began, of all programs."""
        return (count_dropped_datagrams() or 0) - self._dropped_before

    def missing(self) -> list[str]:
        """What is needed and does not come, or cannot be used."""
        found = [
            heard.words(topic, self.bus)
            for topic, heard in self.topics.items()
            if heard.needed and heard.messages == heard.refused
        ]
        # What else lacked a transform may have got it since.
        wrong = (*WRONG_FRAMES, f"cloud: {NO_TRANSFORM}")
        return [*found, *self._unheard] + [
            f"{number} x {reason}"
            for reason, number in self.counts.items()
            if reason.startswith(wrong) or (found and f": {NO_TRANSFORM}" in reason)
        ]

    def wait(self, seconds: float) -> None:
        self.bus.wait(seconds)

    def close(self) -> None:
        self.bus.close()
