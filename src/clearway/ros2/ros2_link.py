"""ROS 2 as a link: topics become what a session hears, and what it says becomes topics."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, attitude_from_rotation
from clearway.base.state import State
from clearway.live.link.link_state import LinkState
from clearway.live.link.past import PastStates
from clearway.live.link.placed_scans import ScanMaker
from clearway.live.link.session import Session, TickOutcome
from clearway.live.link.set_point import SetPoint
from clearway.live.link.status import VehicleStatus
from clearway.ros2 import told
from clearway.ros2.aircraft import aircraft_of
from clearway.ros2.bus import LATCHED, SENSOR, STATIC_TF, USUAL, Quality, TopicBus, TopicMessage
from clearway.ros2.clouds import TimedPoints, points_of
from clearway.ros2.heard import HeardTopic
from clearway.ros2.messages import damages, packed, unpacked
from clearway.ros2.own_place import OwnPlaceHeard
from clearway.ros2.parameters import CloudParameters, Names, NodeParameters
from clearway.ros2.transforms import RigidTransform, Transforms, transform_of
from clearway.sensors import Lidar, Scan

FLYING = VehicleStatus(armed=True, follows=True, airborne=True)
"""Nothing in ROS says so for every vehicle: whoever starts the node with `act` does."""
TF = "tf2_msgs/msg/TFMessage"
SLICES = 32
"""Of a sweep, each moved at once."""
OFF_M, OFF_RAD = 0.02, math.radians(0.5)
"""A sensor mounted farther from where the mission says is not the mission's."""
MOST_GOALS = 1000
DIAGNOSED_S = 1.0
WITHIN_S = 0.5

MALFORMED, UNUSABLE = "malformed", "values that cannot be used"
NO_MOUNTING = "cloud: no transform from its frame to the body"
MOUNTED_ELSEWHERE = "cloud: its sensor is mounted elsewhere than the mission says"
EMPTY = "cloud: empty, which says nothing"


@dataclass(frozen=True, slots=True)
class Heard:
    """A topic and what is done with its messages."""

    topic: str
    kind: str
    quality: Quality
    take: Callable[[Any, float, str], None]
    needed: bool = False


class Ros2Link:
    """A `live.link.session.Link` over any `TopicBus`."""

    def __init__(
        self,
        bus: TopicBus,
        session: Session,
        parameters: NodeParameters,
        names: Names,
        lidars: Mapping[str, Lidar],
        origin: FloatArray | None,
    ) -> None:
        self.bus, self.session, self.parameters = bus, session, parameters
        self.counts: Counter[str] = session.counts
        self.transforms = Transforms(self.counts)
        self.topics: dict[str, HeardTopic] = {}
        self.published: Counter[str] = Counter()
        self._names, self._lidars, self._origin = names, dict(lidars), origin
        self._own = OwnPlaceHeard(
            self.transforms, parameters.map_frame, parameters.base_frame, self.counts
        )
        self._past = PastStates()
        self._by_topic: dict[str, Heard] = {}
        self._kinds: dict[str, str] = {}
        self._told_s = -math.inf
        self._said: set[str] = set()
        self._diagnosed_s = -math.inf
        for heard in self._all_heard():
            self._by_topic[heard.topic] = heard
            self.topics[heard.topic] = HeardTopic(heard.kind, heard.needed)
            bus.subscribe(heard.topic, heard.kind, heard.quality)
        self._advertise()
        if parameters.ground_m is not None:
            session.hear_ground(parameters.ground_m)

    def _all_heard(self) -> list[Heard]:
        names, given = self._names, self.parameters
        own_package = "nav_msgs" if given.own.type == "Odometry" else "geometry_msgs"
        found = [
            Heard("/tf", TF, Quality(depth=100), self._take_tf),
            Heard("/tf_static", TF, STATIC_TF, self._take_static),
            Heard(
                names(given.own.topic), f"{own_package}/msg/{given.own.type}", SENSOR,
                self._take_own, True,
            ),
            Heard(names(given.goal), "geometry_msgs/msg/PoseStamped", USUAL, self._take_goal),
            Heard(names(given.path), "nav_msgs/msg/Path", USUAL, self._take_path),
        ]  # fmt: skip
        if given.use_sim_time:
            found.append(Heard("/clock", "rosgraph_msgs/msg/Clock", SENSOR, self._take_clock, True))
        for name, cloud in given.clouds.items():
            kind = f"sensor_msgs/msg/{cloud.type}"
            take = self._cloud_taker(name, cloud)
            found.append(Heard(names(cloud.topic), kind, SENSOR, take, True))
        for one in given.traffic:
            package = "px4_msgs" if one.type == "TransponderReport" else "mavros_msgs"
            found.append(
                Heard(names(one.topic), f"{package}/msg/{one.type}", SENSOR, self._take_traffic)
            )
        return found

    def _advertise(self) -> None:
        packages = {
            "TrajectorySetpoint": "px4_msgs", "PositionTarget": "mavros_msgs",
            "Twist": "geometry_msgs", "Path": "nav_msgs",
        }  # fmt: skip
        told_always = (
            ("~/plan", "nav_msgs/msg/Path", LATCHED),
            ("~/way_out", "nav_msgs/msg/Path", LATCHED),
            ("~/decision", "std_msgs/msg/String", LATCHED),
            ("~/markers", "visualization_msgs/msg/MarkerArray", LATCHED),
            ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", USUAL),
        )
        for name, kind, quality in told_always:
            self.bus.advertise(self._names(name), kind, quality)
        for one in self.parameters.set_points if self.parameters.act else ():
            kind = f"{packages[one.type]}/msg/{one.type}"
            self.bus.advertise(self._names(one.topic), kind, USUAL)

    # --- in -------------------------------------------------------------------------------

    def hear(self, wall_s: float) -> None:
        """Take all that has come: transforms first, then the rest in its order."""
        came = list(self.bus.take())
        came.sort(key=lambda one: one.type != TF)
        for one in came:
            self._hear_one(one, wall_s)

    def _hear_one(self, one: TopicMessage, wall_s: float) -> None:
        heard, topic = self._by_topic.get(one.topic), self.topics.get(one.topic)
        if heard is None or topic is None:
            return
        topic.take(wall_s)
        try:
            message = unpacked(one.raw, heard.kind)
            heard.take(message, wall_s, one.topic)
        except damages():
            topic.refused += 1
            self.counts[f"{one.topic}: {MALFORMED}"] += 1
        except ClearwayError:
            topic.refused += 1
            self.counts[f"{one.topic}: {UNUSABLE}"] += 1

    def _stamp(self, message: Any, wall_s: float, topic: str) -> float | None:
        """The time of a stamped message, if it may be used."""
        stamp = message.header.stamp
        time_s = stamp.sec + 1e-9 * stamp.nanosec
        if not 0.0 < time_s < 1e11:
            self.counts[f"{topic}: no stamp"] += 1
            return None
        if not self.session.hear_time(time_s, wall_s):
            return None
        self.topics[topic].age_s = max(0.0, self.session.clock.now(wall_s) - time_s)
        return float(time_s)

    def _take_clock(self, message: Any, wall_s: float, _topic: str) -> None:
        self.session.hear_time(message.clock.sec + 1e-9 * message.clock.nanosec, wall_s)

    def _take_tf(self, message: Any, _wall_s: float, _topic: str) -> None:
        self.transforms.take(message, static=False)

    def _take_static(self, message: Any, _wall_s: float, _topic: str) -> None:
        self.transforms.take(message, static=True)

    def _take_own(self, message: Any, wall_s: float, topic: str) -> None:
        time_s = self._stamp(message, wall_s, topic)
        if time_s is None:
            return
        motion = self._own.take(message, time_s)
        if motion is None or motion.attitude_rad is None:
            self.topics[topic].refused += 1
            return
        self.session.hear_status(FLYING, wall_s)
        self.session.hear_motion(motion)
        state = State(motion.position_m, motion.attitude_rad, time_s)
        self._past.add(state, motion.heading_rad)

    def _cloud_taker(
        self, name: str, parameters: CloudParameters
    ) -> Callable[[Any, float, str], None]:
        def take(message: Any, wall_s: float, topic: str) -> None:
            self._take_cloud(name, parameters, message, wall_s, topic)

        return take

    def _take_cloud(
        self, name: str, parameters: CloudParameters, message: Any, wall_s: float, topic: str
    ) -> None:
        time_s = self._stamp(message, wall_s, topic)
        if time_s is None:
            return
        points = points_of(message, parameters.type)
        told_of = message.width if parameters.type == "PointCloud2" else len(message.ranges)
        flaw = self._flaw_of_cloud(name, message.header.frame_id, time_s)
        flaw = flaw or (None if told_of else EMPTY)
        if flaw is not None:
            self.topics[topic].refused += 1
            self.counts[flaw] += 1
            return
        maker = self._scan_maker(name, points, time_s, deskew=parameters.deskew)
        self.session.hear_scan(time_s, maker, wall_s)

    def _flaw_of_cloud(self, name: str, frame: str, time_s: float) -> str | None:
        """Why a cloud of a frame is none of a sensor's; None if it is."""
        base = self.parameters.base_frame
        there = self.transforms.of(frame, base, time_s)
        if there is None:
            return NO_MOUNTING
        mounting = self._lidars[name].mounting
        off = attitude_from_rotation(there.rotation.T @ mounting.body_from_sensor)
        apart = float(np.linalg.norm(there.position_m - mounting.position_m))
        if apart > OFF_M or float(np.abs(off).max()) > OFF_RAD:
            return MOUNTED_ELSEWHERE
        return None

    def _scan_maker(
        self, name: str, points: TimedPoints, time_s: float, *, deskew: bool
    ) -> ScanMaker:
        def scan(_state: State, _heading: float) -> Scan:
            placed = points.points_m
            if deskew and points.later_s is not None and len(placed):
                placed = self._deskewed(name, placed, points.later_s, time_s)
            return Scan(placed, time_s, name)

        return scan

    def _deskewed(
        self, name: str, points_m: FloatArray, later_s: FloatArray, time_s: float
    ) -> FloatArray:
        """Points as they would have come all at the stamp."""
        at = self._past.at(time_s, WITHIN_S)
        if at is None:
            return points_m
        here, mounting = at[0], self._lidars[name].mounting
        sensor = RigidTransform(mounting.body_from_sensor, mounting.position_m)
        to_here = sensor.then(RigidTransform(here.world_from_body, here.position_m)).inverse
        first, last = float(later_s.min()), float(later_s.max())
        edges = np.linspace(first, last, SLICES + 1)
        which = np.clip(np.searchsorted(edges, later_s, side="right") - 1, 0, SLICES - 1)
        moved = points_m.copy()
        for number in np.unique(which).tolist():
            middle = 0.5 * (edges[number] + edges[number + 1])
            then = self._past.at(time_s + middle, WITHIN_S)
            if then is None:
                continue
            body = RigidTransform(then[0].world_from_body, then[0].position_m)
            mine = which == number
            moved[mine] = sensor.then(body).then(to_here).points(points_m[mine])
        return moved

    def _take_traffic(self, message: Any, wall_s: float, topic: str) -> None:
        own = self.session.motion
        if own is None:
            self.counts["traffic: no own place yet"] += 1
            return
        report = aircraft_of(message, self._origin, float(own.position_m[2]), self.counts)
        if report is None:
            self.topics[topic].refused += 1
        else:
            self.session.hear_aircraft(report, wall_s)

    def _take_goal(self, message: Any, wall_s: float, topic: str) -> None:
        self._go_to([message], wall_s, topic)

    def _take_path(self, message: Any, wall_s: float, topic: str) -> None:
        self._go_to(list(message.poses), wall_s, topic)

    def _go_to(self, poses: list[Any], wall_s: float, topic: str) -> None:
        """Goals in place of the mission; refused as a whole where one is no place."""
        now, goals = self.session.clock.now(wall_s), []
        for one in poses[: MOST_GOALS + 1]:
            frame = one.header.frame_id.lstrip("/") or self.parameters.map_frame
            found = transform_of(one.pose.position, told.turned(0.0))
            there = self.transforms.of(frame, self.parameters.map_frame, now)
            if frame == self.parameters.map_frame:
                there = RigidTransform(np.eye(3), np.zeros(3))
            if found is None or there is None:
                self.counts[f"{topic}: no place in the map frame"] += 1
                return
            goals.append(found.then(there).position_m)
        if not 0 < len(goals) <= MOST_GOALS:
            self.counts[f"{topic}: {len(goals)} goals"] += 1
            return
        refusal = self.session.hear_goal(np.array(goals), wall_s)
        if refusal is not None:
            self.counts[f"{topic}: refused, {refusal}"] += 1

    # --- out ------------------------------------------------------------------------------

    def tick(self, wall_s: float) -> TickOutcome:
        outcome = self.session.tick(wall_s)
        if outcome.flight is not None:
            self._tell_decision(outcome)
        if outcome.set_point is not None:
            self._tell_set_point(outcome.set_point, outcome.time_s)
        if wall_s - self._diagnosed_s >= DIAGNOSED_S:
            self._diagnosed_s = wall_s
            self._diagnose(outcome, wall_s)
        return replace(outcome, notes=(*outcome.notes, *self._news()))

    def _tell_decision(self, outcome: TickOutcome) -> None:
        flight, frame = outcome.flight, self.parameters.map_frame
        assert flight is not None
        time_s = flight.time_s
        self._publish("~/plan", told.path_message(flight.decision.path_m, time_s, frame))
        way = flight.decision.way_out_path_m
        self._publish("~/way_out", told.path_message(way, time_s, frame))
        self._publish("~/decision", told.string_of(told.decision_row(flight, outcome)))
        self._publish("~/markers", told.markers(flight, time_s, frame))

    def _tell_set_point(self, point: SetPoint, time_s: float) -> None:
        given = self.parameters
        for one in given.set_points if given.act else ():
            message = told.set_point_message(one.type, point, time_s, given.map_frame)
            self._publish(one.topic, message)

    def _diagnose(self, outcome: TickOutcome, wall_s: float) -> None:
        values: dict[str, object] = {
            topic: heard.words("", self.bus.publishers(topic)).removeprefix(" ")
            for topic, heard in self.topics.items()
            if heard.needed or heard.messages
        }
        values |= dict(self.left_out.most_common(20))
        level = told.OK if outcome.state in (LinkState.FLYING, LinkState.ARRIVED) else told.WARN
        lost = (LinkState.POSITION_LOST, LinkState.SENSOR_LOST, LinkState.LINK_LOST)
        level = told.ERROR if outcome.state in lost else level
        words = f"{outcome.state}{': ' if outcome.why_state else ''}{outcome.why_state}"
        now = self.session.clock.now(wall_s)
        self._publish("/diagnostics", told.diagnostics("clearway", level, words, values, now))

    @property
    def decision_topic(self) -> str:
        """Where decisions are told."""
        return self._names("~/decision")

    @property
    def left_out(self) -> Counter[str]:
        """All that was not used, by reason."""
        return self.counts + self.session.system.counts

    def _publish(self, name: str, message: Any) -> None:
        topic = self._names(name)
        if self.bus.publish(topic, packed(message)):
            self.published[topic] += 1
        else:
            self.counts[f"{topic}: could not be sent"] += 1

    def _news(self) -> list[str]:
        """Reasons for which something was left out for the first time."""
        fresh = [reason for reason in self.counts if reason not in self._said]
        self._said.update(fresh)
        return fresh

    def missing(self) -> list[str]:
        """What is needed and does not come, or cannot be used."""
        found = [
            heard.words(topic, self.bus.publishers(topic))
            for topic, heard in self.topics.items()
            if heard.needed and heard.messages == heard.refused
        ]
        return found + [
            f"{number} x {reason}"
            for reason, number in self.counts.items()
            if reason in (NO_MOUNTING, MOUNTED_ELSEWHERE)
        ]

    def wait(self, seconds: float) -> None:
        self.bus.wait(seconds)

    def end(self) -> None:
        """To hold, where the vehicle was led."""
        last = self.session.farewell() if self.parameters.act else None
        if last is not None:
            self._tell_set_point(last, self.session.clock.now(time.monotonic()))

    def close(self) -> None:
        self.bus.close()
