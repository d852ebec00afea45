"""A robot's side of ROS 2 topics, message by message, and a bus without a network."""

from __future__ import annotations

import math
import time
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.session import Session
from clearway.live.mission import Mission
from clearway.reach import ReachLibrary
from clearway.ros2.bus import Quality, TopicMessage
from clearway.ros2.messages import make_message, pack_message, unpack_cdr
from clearway.ros2.parameters import Names, NodeParameters
from clearway.ros2.ros2_link import Ros2Link
from clearway.ros2.told import header, point, turn_into_message
from clearway.sensors import BeamPattern, Lidar, Mounting
from clearway.vehicle.automaton import MovementAutomaton
from free_ports import own_domain

DOMAIN = own_domain(97)
"""Of the tests alone."""
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/>"
    "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers>"
    "</Discovery></Domain></CycloneDDS>"
)
BEGAN_S = 1_700_000_000.0
GRID = AvoidanceGrid.uniform()
PATTERN = BeamPattern.per_cell(GRID, 8, max_range_m=10.0)
MOUNTING = Mounting(np.array([0.2, 0.0, 0.1]), np.array([0.0, 0.0, 0.0]))
LIDAR = Lidar("front", PATTERN, mounting=MOUNTING)


class LocalBus:
    """Topics in one process."""

    def __init__(self) -> None:
        self.name, self.recorded = "a local bus", False
        self.lost = Counter[str]()
        self.kinds: dict[str, str] = {}
        self.came: list[TopicMessage] = []
        self.sent: dict[str, list[Any]] = defaultdict(list)
        self._sent_kinds: dict[str, str] = {}

    def subscribe(self, topic: str, kind: str, quality: Quality) -> None:
        del quality
        self.kinds[topic] = kind

    def advertise(self, topic: str, kind: str, quality: Quality) -> None:
        del quality
        self._sent_kinds[topic] = kind

    def publish(self, topic: str, raw: bytes) -> bool:
        self.sent[topic].append(unpack_cdr(raw, self._sent_kinds[topic]))
        return True

    def take(self) -> list[TopicMessage]:
        came, self.came = self.came, []
        return came

    def publishers(self, topic: str) -> int:
        return int(topic in self.kinds)

    def why_unheard(self, topic: str) -> str:
        del topic
        return ""

    def wait(self, seconds: float) -> None:
        del seconds

    def close(self) -> None: ...

    def tell(self, topic: str, message: Any) -> None:
        raw = message if isinstance(message, bytes) else pack_message(message)
        self.came.append(TopicMessage(topic, self.kinds.get(topic, "?"), raw))


def odometry(
    time_s: float,
    place: Any = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
    speed: float = 1.0,
    frame: str = "map",
    child: str = "base_link",
    variance: float = 0.0,
) -> Any:
    message = make_message(
        "nav_msgs/msg/Odometry", header=header(time_s, frame), child_frame_id=child
    )
    message.pose.pose.position = point(np.asarray(place, dtype=float))
    message.pose.pose.orientation = turn_into_message(yaw)
    message.pose.covariance[::7] = variance
    message.twist.twist.linear.x = speed
    return message


def transform(
    child: str, parent: str, place: Any = (0.0, 0.0, 0.0), yaw: float = 0.0, time_s: float = 0.0
) -> Any:
    one = make_message(
        "geometry_msgs/msg/TransformStamped", header=header(time_s, parent), child_frame_id=child
    )
    one.transform.translation = point(np.asarray(place, dtype=float), "Vector3")
    one.transform.rotation = turn_into_message(yaw)
    return make_message("tf2_msgs/msg/TFMessage", transforms=[one])


def cloud(
    time_s: float,
    points: Any,
    frame: str = "lidar",
    later_s: Any = None,
    big_endian: bool = False,
    rows: int = 1,
) -> Any:
    """A PointCloud2 with padding, and times where they are given."""
    order = ">" if big_endian else "<"
    form = np.dtype(
        {"names": ["x", "y", "z", "t"], "formats": [order + "f4"] * 3 + [order + "u4"],
         "offsets": [0, 4, 8, 16], "itemsize": 24}
    )  # fmt: skip
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    table = np.zeros(len(points), form)
    for axis, name in enumerate("xyz"):
        table[name] = points[:, axis]
    names = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]
    if later_s is not None:
        table["t"] = np.round(np.asarray(later_s) * 1e9)
        names.append(("t", 16, 6))
    fields = [
        make_message("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=kind, count=1)
        for name, offset, kind in names
    ]
    wide = len(points) // rows
    return make_message(
        "sensor_msgs/msg/PointCloud2", header=header(time_s, frame), height=rows, width=wide,
        fields=fields, is_bigendian=big_endian, point_step=24, row_step=24 * wide,
        data=np.frombuffer(table.tobytes(), dtype=np.uint8),
    )  # fmt: skip


def transponder(address: int = 0xABCDEF, **more: Any) -> Any:
    """Of a drone north-east of the origin, flying south."""
    told = {
        "icao_address": address, "lat": 52.0000719, "lon": 4.3000874, "altitude": 10.0,
        "heading": math.pi, "hor_velocity": 1.0, "flags": 1 | 2 | 4 | 8 | 128, "emitter_type": 14,
    } | more  # fmt: skip
    return make_message("px4_msgs/msg/TransponderReport", **told)


class RosBench:
    """A node told everything by hand; our clock and the vehicle's run together."""

    def __init__(self, automaton: MovementAutomaton | None = None, **parameters: Any) -> None:
        given: dict[str, Any] = {
            "mission": Path("none.toml"),
            "act": True,
            "clouds": {"front": {"topic": "points"}},
            "traffic": {"adsb": {"topic": "adsb", "type": "TransponderReport"}},
            "set_points": {
                "px4": {"topic": "px4", "type": "TrajectorySetpoint"},
                "mavros": {"topic": "mavros", "type": "PositionTarget"},
                "velocity": {"topic": "cmd_vel", "type": "Twist"},
                "follow": {"topic": "follow", "type": "Path"},
            },
            "ground_m": -50.0,
        }
        self.parameters = NodeParameters.model_validate(given | parameters)
        automaton = automaton or MovementAutomaton.plane()
        planner = Planner.of(ReachLibrary.build(automaton, GRID), AvoidanceSettings())
        goal = np.array([[30.0, 0.0, 0.0]])
        start = State(np.zeros(3), time_s=BEGAN_S)
        lidars = dict.fromkeys(self.parameters.clouds, LIDAR)
        system = AvoidanceSystem(
            planner, Mission("out", start, waypoints_m=goal), lidars=tuple(lidars.values())
        )
        terms = SessionTerms(act=self.parameters.act, floor=FloorRule(0.6))
        self.bus, self.counts = LocalBus(), Counter[str]()
        sensor = LIDAR if lidars else None
        self.session = Session(system, sensor, terms, self.counts)
        self.link = Ros2Link(
            self.bus, self.session, self.parameters, Names(), lidars, np.array([52.0, 4.3, 10.0])
        )
        self.bus.tell("/tf_static", transform("lidar", "base_link", (0.2, 0.0, 0.1)))

    def tick(self, time_s: float) -> TickOutcome:
        self.link.hear(time_s)
        return self.link.tick(time_s)

    def fly(self, ticks: int, begins: int = 0, points: Any = ((5.0, 4.0, 0.0),)) -> TickOutcome:
        """Straight on along x at 1 m/s, at 10 Hz."""
        outcome = None
        for tick in range(begins, begins + ticks):
            now = 0.1 * tick
            self.bus.tell("/odom", odometry(BEGAN_S + now, (now, 0.0, 0.0)))
            self.bus.tell("/points", cloud(BEGAN_S + now, points))
            outcome = self.tick(now)
        assert outcome is not None
        return outcome

    def sent(self, topic: str) -> list[Any]:
        return self.bus.sent[topic]


def until(true: Any, seconds: float = 20.0) -> bool:
    """Whether something becomes true within a time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if true():
            return True
        time.sleep(0.02)
    return False
