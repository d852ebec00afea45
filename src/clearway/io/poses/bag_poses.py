"""Where the vehicle was, of a recording's odometry or transforms, and how the LiDAR sits on it.

Frames of ROS (REP 103, 105): x ahead, y left, z up, as here.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray, attitude_from_rotation, world_from_body
from clearway.io.foreign_errors import damage_told
from clearway.io.poses.pose_track import PoseTrack, convert_quaternion, pose_track, quaternions_of
from clearway.io.scans.bag import Bag, RawMessage
from clearway.io.scans.optical import AHEAD_FROM_OPTICAL, is_optical
from clearway.sensors import Mounting

ODOMETRY = "nav_msgs/msg/Odometry"
POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped")
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")


class PoseSource(NamedTuple):
    """Where a recording says the vehicle's place, for tables."""

    holds: str
    option: str


SOURCES = (
    PoseSource(
        "a bag's `nav_msgs/Odometry`, `PoseStamped` or `PoseWithCovarianceStamped`",
        "the first one found, or `--poses /topic`",
    ),
    PoseSource(
        "a bag's transforms (`/tf`, `/tf_static`), from `base_link`, else the sensor, up to the "
        "root",
        "without any of these topics",
    ),
)
BODIES = ("base_link", "base_footprint")
"""Frames of the vehicle by ROS's custom."""
UNMEASURED = 1e4
"""Variances from here on stand for what is not measured."""


class BagPoses(NamedTuple):
    """The vehicle's way, and the sensor's place on the vehicle; None where unknown."""

    track: PoseTrack | None
    mounting: Mounting | None
    notes: tuple[str, ...]


class Edge(NamedTuple):
    """Poses of a frame in its parent, by time."""

    parent: str
    track: PoseTrack


def poses_of_bag(path: Path, bag: Bag, sensor_frame: str, topic: str | None) -> BagPoses:
    """Odometry or poses of a topic, else the transforms, else nothing.

    Raises InputError listing the topics where `topic` is none that tells poses.
    """
    own = [one.name for one in bag.topics if one.type in (ODOMETRY, *POSES)]
    if topic is not None and topic not in own:
        raise InputError(
            str(path), f"no poses of topic {topic!r}; valid: {', '.join(own) or 'none in it'}"
        )
    edges, damaged = _edges(path, bag)
    odometry = [one.name for one in bag.topics if one.type == ODOMETRY]
    chosen = topic or next(iter(odometry or own), None)
    if chosen is not None:
        track, body = _of_topic(path, bag, chosen)
        damaged = (*damaged, *track.notes)
        if not len(track.time_s) and topic is not None:
            raise InputError(str(path), f"no usable pose of topic {topic!r}: {'; '.join(damaged)}")
    if chosen is not None and len(track.time_s):
        mounting = None if body == sensor_frame else _find_fixed(edges, sensor_frame, body)
        note = f"poses of {chosen}"
        if mounting is None and body != sensor_frame:
            note += f"; LiDAR assumed at the place of {body or 'the vehicle'!s}, and turned alike"
        return BagPoses(track, mounting, (note, *damaged))
    found = _of_transforms(path, edges, sensor_frame)
    return found._replace(notes=(*found.notes, *damaged))


def _of_topic(path: Path, bag: Bag, topic: str) -> tuple[PoseTrack, str]:
    """The track of one topic, and the frame whose poses they are."""
    times, poses, body = [], [], ""
    deviations: list[tuple[float, float]] = []
    damaged = 0
    for message in bag.messages([topic]):
        try:
            with damage_told(path, f"message of {topic}"):  # its definition, too, may be damaged
                found = _decode(bag, message)
                pose = found.pose.pose if hasattr(found.pose, "pose") else found.pose
                told = _numbers(pose.position, pose.orientation)
                time_s = _seconds(found.header.stamp) or message.logged_s
        except InputError:
            damaged += 1
            continue
        times.append(time_s)
        poses.append(told)
        deviations.append(_deviations(getattr(found.pose, "covariance", None)))
        body = getattr(found, "child_frame_id", "")
    track = _track(f"{path} {topic}", times, poses, deviations)
    track = replace(track, notes=(*track.notes, *_note_damaged(damaged, topic)))
    if not is_optical(body):
        return track, body
    turned = [convert_quaternion(one) @ AHEAD_FROM_OPTICAL.T for one in track.quaternion]
    ahead = quaternions_of(np.array(turned).reshape(-1, 3, 3))
    return replace(track, quaternion=ahead), body


def _decode(bag: Bag, message: RawMessage) -> Any:
    if message.damage:
        raise ValueError(message.damage)
    return bag.decoded(message)


def _note_damaged(count: int, topics: str) -> tuple[str, ...]:
    return (f"{count} damaged messages of {topics} left out",) if count else ()


def _edges(path: Path, bag: Bag) -> tuple[dict[str, Edge], tuple[str, ...]]:
    """Transforms by child frame, and a note of damaged messages."""
    topics = [one.name for one in bag.topics if one.type in TRANSFORMS]
    times: Mapping[str, list[float]] = defaultdict(list)
    poses: Mapping[str, list[list[float]]] = defaultdict(list)
    parents, damaged = {}, 0
    for message in bag.messages(topics):
        try:
            with damage_told(path, f"message of {message.topic}"):
                told = [
                    (
                        found.child_frame_id.lstrip("/"),
                        found.header.frame_id.lstrip("/"),
                        _seconds(found.header.stamp),
                        _numbers(found.transform.translation, found.transform.rotation),
                    )
                    for found in _decode(bag, message).transforms
                ]
        except InputError:
            damaged += 1
            continue
        for child, parent, time_s, numbers in told:
            parents[child] = parent
            times[child].append(time_s)
            poses[child].append(numbers)
    tracks = {child: _track(f"{path} {child}", times[child], poses[child]) for child in parents}
    edges = {
        child: Edge(parents[child], track) for child, track in tracks.items() if len(track.time_s)
    }
    return edges, _note_damaged(damaged, ", ".join(topics))


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def _numbers(place: Any, turn: Any) -> list[float]:
    return [place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z]


def _deviations(covariance: Sequence[float] | None) -> tuple[float, float]:
    """Standard deviations of position (m) and attitude (rad) by REP 103's six by six, row by row.

    Zero where they are unknown: none told, all zero, or what is no variance (ROS writes -1). Axes
    that are not measured, as the height of a planar estimator, have huge ones and do not count.
    """
    if covariance is None or len(covariance) != 36:
        return 0.0, 0.0
    variances = np.array([float(covariance[7 * axis]) for axis in range(6)])
    known = (variances >= 0.0) & (variances < UNMEASURED)  # NaN is neither
    stds = np.sqrt(np.where(known, variances, 0.0))
    return float(stds[:3].max()), float(min(stds[3:].max(), np.pi))


def _track(
    source: str,
    times: Sequence[float],
    poses: Sequence[Sequence[float]],
    deviations: Sequence[tuple[float, float]] | None = None,
) -> PoseTrack:
    numbers = np.array(poses, dtype=np.float64).reshape(-1, 7)
    stds = None if deviations is None else np.array(deviations, dtype=np.float64).reshape(-1, 2)
    return pose_track(source, np.array(times), numbers[:, :3], numbers[:, 3:], deviations=stds)


def _of_transforms(path: Path, edges: Mapping[str, Edge], sensor_frame: str) -> BagPoses:
    chain = _chain(edges, sensor_frame)
    body = next((name for name in BODIES if name in chain), sensor_frame)
    above = chain[chain.index(body) :]
    moving = [edges[name].track for name in above if name in edges and _moves(edges[name])]
    mounting = _find_fixed(edges, sensor_frame, body) if body != sensor_frame else None
    if not moving:
        return BagPoses(None, mounting, ())
    times = max(moving, key=lambda track: len(track.time_s)).time_s
    found = [(time_s, _pose(edges, above, float(time_s))) for time_s in times]
    known = [(time_s, pose) for time_s, pose in found if pose is not None]
    if not known:
        return BagPoses(None, mounting, ("no poses in it: its transforms never overlap",))
    stack = np.array([pose for _, pose in known])
    track = pose_track(
        f"{path} transforms",
        np.array([time_s for time_s, _ in known]),
        stack[:, :3, 3],
        quaternions_of(stack[:, :3, :3]),
    )
    return BagPoses(track, mounting, (f"poses of {body} in {above[-1]} by transforms",))


def _moves(edge: Edge) -> bool:
    track = edge.track
    return bool(np.any(track.position_m != track.position_m[0])) or bool(
        np.any(track.quaternion != track.quaternion[0])
    )


def _chain(edges: Mapping[str, Edge], frame: str) -> list[str]:
    """A frame, its parent, and so on to the root."""
    chain = [frame.lstrip("/")]
    while chain[-1] in edges and edges[chain[-1]].parent not in chain:
        chain.append(edges[chain[-1]].parent)
    return chain


def _pose(edges: Mapping[str, Edge], chain: Sequence[str], time_s: float) -> FloatArray | None:
    """[4, 4] pose of the first frame of a chain in the last at a time, both with x ahead."""
    pose = _as_named_from_ahead(chain[0])
    for name in chain[:-1]:
        edge = edges[name]
        if not _moves(edge):
            rotation, position = (
                convert_quaternion(edge.track.quaternion[0]),
                edge.track.position_m[0],
            )
        else:
            state = edge.track.at(time_s)
            if state is None:
                return None
            rotation, position = world_from_body(state.attitude_rad), state.position_m
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = rotation, position
        pose = step @ pose
    ahead: FloatArray = _as_named_from_ahead(chain[-1]).T @ pose
    return ahead


def _as_named_from_ahead(frame: str) -> FloatArray:
    """[4, 4] turn from x ahead, y left, z up to the axes that a frame has by its name."""
    turn = np.eye(4)
    if is_optical(frame):
        turn[:3, :3] = AHEAD_FROM_OPTICAL.T
    return turn


def _find_fixed(edges: Mapping[str, Edge], sensor_frame: str, body: str) -> Mounting | None:
    """Pose of the sensor on the body; None where it is unknown, or moves."""
    chain = _chain(edges, sensor_frame)
    if body.lstrip("/") not in chain:
        return None
    chain = chain[: chain.index(body.lstrip("/")) + 1]
    if any(_moves(edges[name]) for name in chain[:-1]):
        return None
    pose = _pose(edges, chain, 0.0)
    assert pose is not None  # fixed transforms hold at any time
    return Mounting(pose[:3, 3], attitude_from_rotation(pose[:3, :3]))
