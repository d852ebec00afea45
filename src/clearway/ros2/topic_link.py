"""Topics become what a session hears; what every node says of itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.handing import Handing
from clearway.live.link.aircraft import AircraftReport
from clearway.live.link.status import VehicleStatus
from clearway.ros2 import told
from clearway.ros2.aircraft import aircraft_in_frame, read_ros2_aircraft
from clearway.ros2.bus import (
    SENSOR,
    STATIC_TF,
    MissingMessageError,
    Quality,
    TopicBus,
    TopicMessage,
    wire_kind,
)
from clearway.ros2.clouds import read_cloud_points
from clearway.ros2.heard import HeardTopic
from clearway.ros2.kinds import TRAFFIC_KINDS, Heard
from clearway.ros2.messages import damages, make_message, pack_message, unpack_cdr
from clearway.ros2.own_place import OwnPlaceHeard
from clearway.ros2.parameters import (
    CloudParameters,
    Names,
    NodeParameters,
)
from clearway.ros2.placed_clouds import EMPTY, PlacedClouds
from clearway.ros2.topic_teller import S, TopicTeller
from clearway.ros2.transforms import Transforms, transform_of
from clearway.sensors import Lidar

FLYING = VehicleStatus(armed=True, follows=True, airborne=True)
"""Nothing in ROS says so for every vehicle: whoever starts the node with `act` does."""
TF = "tf2_msgs/msg/TFMessage"

MALFORMED = "malformed"
UNUSABLE = "values that cannot be used"


class TopicLink(TopicTeller[S]):
    """What every node of ours is on topics: the half of a `live.link.outcome.Link` that hears."""

    def __init__(
        self,
        bus: TopicBus,
        session: S,
        parameters: NodeParameters,
        names: Names,
        lidars: Mapping[str, Lidar],
        origin: FloatArray | None,
    ) -> None:
        super().__init__(bus, session, parameters, names)
        self._origin = origin
        self.transforms = Transforms(self.counts)
        self._own = OwnPlaceHeard(
            self.transforms, parameters.map_frame, parameters.base_frame, self.counts
        )
        self._clouds = PlacedClouds(self.transforms, parameters.base_frame, lidars)
        self._by_topic: dict[str, Heard] = {}
        self.handing = Handing()
        for heard in self._all_heard():
            self._by_topic[heard.topic] = heard
            self.topics[heard.topic] = HeardTopic(wire_kind(heard.kind), heard.needed)
            self._subscribe(heard)
        self._advertise()
        kinds = {one.kind for one in self._by_topic.values()} | {
            one[1] for one in self._list_published()
        }
        for kind in kinds:
            unpack_cdr(
                pack_message(make_message(kind)), kind
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
        for one in given.traffic.values():
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

    @property
    def is_relieved(self) -> bool:
        """Whether the second process has taken over for good."""
        return self.handing.hand.relieved

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
            message = unpack_cdr(one.raw, heard.kind)
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
            self.counts["traffic: no own position yet"] += 1
            return
        report = read_ros2_aircraft(message, self._origin, float(own.position_m[2]), self.counts)
        self._tell_aircraft(report, wall_s, topic)

    def _take_aircraft(self, message: Any, wall_s: float, topic: str) -> None:
        time_s = self._stamp(message, wall_s, topic)
        if time_s is None or self.session.motion is None:
            return
        frame = message.header.frame_id.lstrip("/")
        there = self.transforms.locate(frame, self.parameters.map_frame, time_s, "traffic")
        if there is None:
            self.topics[topic].refused += 1
            return
        age_s = max(0.0, self.session.clock.now(wall_s) - time_s)
        report = aircraft_in_frame(message, there, age_s, self.counts)
        self._tell_aircraft(report, wall_s, topic)

    def _tell_aircraft(self, report: AircraftReport | None, wall_s: float, topic: str) -> None:
        if report is None:
            self.topics[topic].refused += 1
        else:
            self.session.hear_aircraft(report, wall_s)

    def place_of(self, pose: Any, now_s: float, topic: str) -> FloatArray | None:
        """[3] of a topic's PoseStamped in the map frame; None where nothing ties its frame."""
        frame = pose.header.frame_id.lstrip("/")
        found = transform_of(pose.pose.position, told.turn_into_message(0.0))
        there = self.transforms.locate(frame, self.parameters.map_frame, now_s, topic)
        return None if found is None or there is None else found.then(there).position_m
