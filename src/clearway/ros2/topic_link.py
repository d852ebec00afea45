"""Topics become what a session hears; what every node says of itself."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Generic, TypeVar

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.link.aircraft import AircraftReport
from clearway.live.link.hearing import Hearing
from clearway.live.link.link_state import LinkState
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.set_point import SetPoint
from clearway.live.link.status import VehicleStatus
from clearway.ros2 import told
from clearway.ros2.aircraft import aircraft_in_frame, read_ros2_aircraft
from clearway.ros2.bus import (
    SENSOR,
    STATIC_TF,
    USUAL,
    MissingMessageError,
    Quality,
    TopicBus,
    TopicMessage,
    wire_kind,
)
from clearway.ros2.clouds import read_cloud_points
from clearway.ros2.heard import HeardTopic
from clearway.ros2.kernel import dropped_datagrams
from clearway.ros2.kinds import SET_POINT_KINDS, TRAFFIC_KINDS, Heard, base_of
from clearway.ros2.messages import damages, made, pack_message, unpacked
from clearway.ros2.own_place import OwnPlaceHeard
from clearway.ros2.parameters import (
    CloudParameters,
    Names,
    NodeParameters,
    SetPointParameters,
)
from clearway.ros2.placed_clouds import EMPTY, WRONG_FRAMES, PlacedClouds
from clearway.ros2.transforms import HERE, Transforms, transform_of
from clearway.sensors import Lidar

S = TypeVar("S", bound=Hearing)
FLYING = VehicleStatus(armed=True, follows=True, airborne=True)
"""Nothing in ROS says so for every vehicle: whoever starts the node with `act` does."""
TF = "tf2_msgs/msg/TFMessage"
DIAGNOSED_S = 1.0

MALFORMED, UNUSABLE = "malformed", "values that cannot be used"
DIAGNOSTICS = ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", USUAL)


class TopicLink(Generic[S]):
    """What every node of ours is on topics: the half of a `live.link.outcome.Link` that hears."""

    told_always: tuple[tuple[str, str, Quality], ...] = ()
    """Topics that are published whatever the parameters say."""

    def __init__(
        self,
        bus: TopicBus,
        session: S,
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
        self.names, self._origin = names, origin
        self._own = OwnPlaceHeard(
            self.transforms, parameters.map_frame, parameters.base_frame, self.counts
        )
        self._clouds = PlacedClouds(self.transforms, parameters.base_frame, lidars)
        self._by_topic: dict[str, Heard] = {}
        self._said, self._untold = set[str](), set[str]()
        self._unheard: list[str] = []
        self._diagnosed_s = -math.inf
        self._dropped_before = dropped_datagrams() or 0
        for heard in self._all_heard():
            self._by_topic[heard.topic] = heard
            self.topics[heard.topic] = HeardTopic(wire_kind(heard.kind), heard.needed)
            self._subscribe(heard)
        self._advertise()
        kinds = {one.kind for one in self._by_topic.values()} | {one[1] for one in self._told()}
        for kind in kinds:
            unpacked(
                pack_message(made(kind)), kind
            )  # The first of a kind takes 10 ms, here and not then.
        if parameters.ground_m is not None:
            session.hear_ground(parameters.ground_m)

    def _subscribe(self, heard: Heard) -> None:
        """Messages that nothing depends on may be missing."""
        try:
            self.bus.subscribe(heard.topic, heard.kind, heard.quality)
        except MissingMessageError as missing:
            if heard.needed:
                raise
            self._unheard.append(f"{heard.topic}: not heard, {missing}")
            self.counts[self._unheard[-1]] += 1

    def _all_heard(self) -> list[Heard]:
        names, given = self.names, self.parameters
        found = [
            Heard("/tf", TF, Quality(depth=100), self._take_tf),
            Heard("/tf_static", TF, STATIC_TF, self._take_static),
            *self.own_heard(),
            *self.more_heard(),
        ]
        if given.use_sim_time:
            kind, needed = "rosgraph_msgs/msg/Clock", not self.bus.recorded
            found.append(Heard("/clock", kind, SENSOR, self._take_clock, needed))
        for name, cloud in given.clouds.items():
            kind = f"sensor_msgs/msg/{cloud.type}"
            take = self._cloud_taker(name, cloud)
            quality = replace(SENSOR, reliable=cloud.reliable)
            found.append(Heard(names(cloud.topic), kind, quality, take, True))
        for one in given.traffic:
            take = self._take_aircraft if one.type == "Aircraft" else self._take_traffic
            found.append(Heard(names(one.topic), TRAFFIC_KINDS[one.type], SENSOR, take))
        return found

    def own_heard(self) -> list[Heard]:
        """Topics that tell where the vehicle is, and what it does."""
        own = self.parameters.own
        package = "nav_msgs" if own.type == "Odometry" else "geometry_msgs"
        kind = f"{package}/msg/{own.type}"
        return [Heard(self.names(own.topic), kind, SENSOR, self._take_own, True)]

    def more_heard(self) -> list[Heard]:
        """Topics of one kind of node alone."""
        return []

    def _advertise(self) -> None:
        for name, kind, quality in self._told():
            topic = self.names(name)
            try:
                self.bus.advertise(topic, kind, quality)
            except MissingMessageError as missing:
                if (name, kind, quality) not in (*self.told_always, DIAGNOSTICS):
                    raise
                self._untold.add(topic)
                self.counts[f"{topic}: not published, {missing}"] += 1

    def _told(self) -> list[tuple[str, str, Quality]]:
        """Topics, kinds and qualities of what is published."""
        given = self.parameters
        told = [*self.told_always, DIAGNOSTICS]
        set_points = given.set_points if given.act else ()
        return told + [(one.topic, SET_POINT_KINDS[one.type], USUAL) for one in set_points]

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
        topic.take(wall_s if one.recorded_s is None else one.recorded_s)
        try:
            message = unpacked(one.raw, heard.kind)
            heard.take(message, wall_s, one.topic)
        except ClearwayError:  # Some are ValueErrors too.
            topic.refused += 1
            self.counts[f"{one.topic}: {UNUSABLE}"] += 1
        except damages():
            topic.refused += 1
            self.counts[f"{one.topic}: {MALFORMED}"] += 1

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
        state = State(motion.position_m, motion.attitude_rad, time_s=time_s)
        self._clouds.move(state, motion.heading_rad)

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
        points = read_cloud_points(message, parameters.type, parameters.frame)
        is_cloud = parameters.type == "PointCloud2"
        told_of = message.width * message.height if is_cloud else len(message.ranges)
        flaw = self._clouds.flaw(name, message.header.frame_id, time_s, points.points_m)
        flaw = flaw or (None if told_of else EMPTY)
        if flaw is not None:
            self.topics[topic].refused += 1
            self.counts[flaw] += 1
            return
        maker = self._clouds.maker(name, points, time_s, deskew=parameters.deskew)
        self.session.hear_scan(time_s, maker, wall_s)

    def _take_traffic(self, message: Any, wall_s: float, topic: str) -> None:
        own = self.session.motion
        if own is None:
            self.counts["traffic: no own place yet"] += 1
            return
        report = read_ros2_aircraft(message, self._origin, float(own.position_m[2]), self.counts)
        self._tell_aircraft(report, wall_s, topic)

    def _take_aircraft(self, message: Any, wall_s: float, topic: str) -> None:
        time_s = self._stamp(message, wall_s, topic)
        if time_s is None or self.session.motion is None:
            return
        within, frame = self.parameters.map_frame, message.header.frame_id.lstrip("/")
        there = HERE if frame in ("", within) else self.transforms.of(frame, within, time_s)
        age_s = max(0.0, self.session.clock.now(wall_s) - time_s)
        report = aircraft_in_frame(message, there, age_s, self.counts)
        self._tell_aircraft(report, wall_s, topic)

    def _tell_aircraft(self, report: AircraftReport | None, wall_s: float, topic: str) -> None:
        if report is None:
            self.topics[topic].refused += 1
        else:
            self.session.hear_aircraft(report, wall_s)

    def place_of(self, pose: Any, now_s: float) -> FloatArray | None:
        """[3] of a PoseStamped in the map frame; None where nothing ties its frame to it."""
        within = self.parameters.map_frame
        frame = pose.header.frame_id.lstrip("/") or within
        found = transform_of(pose.pose.position, told.turned(0.0))
        there = HERE if frame == within else self.transforms.of(frame, within, now_s)
        return None if found is None or there is None else found.then(there).position_m

    # --- out ------------------------------------------------------------------------------

    def diagnose(self, outcome: TickOutcome, wall_s: float, words: str = "") -> None:
        """Once a second: the state of the link, and every topic."""
        if wall_s - self._diagnosed_s < DIAGNOSED_S:
            return
        self._diagnosed_s = wall_s
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
        return (dropped_datagrams() or 0) - self._dropped_before

    def missing(self) -> list[str]:
        """What is needed and does not come, or cannot be used."""
        found = [
            heard.words(topic, self.bus)
            for topic, heard in self.topics.items()
            if heard.needed and heard.messages == heard.refused
        ]
        return [*found, *self._unheard] + [
            f"{number} x {reason}"
            for reason, number in self.counts.items()
            if reason in WRONG_FRAMES
        ]

    def wait(self, seconds: float) -> None:
        self.bus.wait(seconds)

    def close(self) -> None:
        self.bus.close()
