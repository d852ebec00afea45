"""Foxglove's messages of a run: what stands still, traffic, transforms, clouds and log lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove import messages as fox

from clearway.base.frames import (
    FloatArray,
    attitude_from_rotation,
    world_from_body,
)
from clearway.live.mission import Mode

Rgb = tuple[float, float, float]
Transforms = fox.FrameTransforms
WORLD = "world"
VEHICLE = "vehicle"
PLANNED_COLOUR = (0.84, 0.15, 0.16)
EXECUTED = (0.12, 0.37, 0.75)
WAYPOINT = (0.18, 0.62, 0.31)
ESCAPE_RGB = (0.03, 0.55, 0.51)
INTRUDER = (0.85, 0.15, 0.6)
POINT = (0.75, 0.22, 0.17)
KNOWN: dict[str, Rgb] = {
    "world": (0.80, 0.55, 0.35),
    "both": (0.55, 0.57, 0.60),
    "map": (0.45, 0.55, 0.85),
    "rule": (0.85, 0.35, 0.30),
}
"""Obstacles: only there, there and in the map, only in the map; volumes that rules keep out of."""


def color(rgb: Rgb, alpha: float = 1.0) -> fox.Color:
    return fox.Color(r=rgb[0], g=rgb[1], b=rgb[2], a=alpha)


def make_timestamp(at_ns: int) -> fox.Timestamp:
    """Nanoseconds since 1970."""
    whole, rest = divmod(at_ns, 1_000_000_000)
    return fox.Timestamp(sec=whole, nsec=rest)


def pose_of(position_m: FloatArray, attitude_rad: FloatArray) -> fox.Pose:
    """Place and attitude (roll, pitch nose down positive, yaw left positive)."""
    return fox.Pose(position=vector(position_m), orientation=quaternion(attitude_rad))


def quaternion(attitude_rad: FloatArray) -> fox.Quaternion:
    """Of the rotation Rz(yaw) Ry(pitch) Rx(roll)."""
    return quaternions(attitude_rad[None])[0]


def quaternions(attitudes_rad: FloatArray) -> list[fox.Quaternion]:
    """The same of many attitudes [n, 3]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(0.5 * attitudes_rad).T, np.sin(0.5 * attitudes_rad).T
    each = zip(
        (cr * cp * cy + sr * sp * sy).tolist(),
        (sr * cp * cy - cr * sp * sy).tolist(),
        (cr * sp * cy + sr * cp * sy).tolist(),
        (cr * cp * sy - sr * sp * cy).tolist(),
        strict=True,
    )
    return [fox.Quaternion(w=w, x=x, y=y, z=z) for w, x, y, z in each]


def transform(at_ns: int, place_m: FloatArray, turned: fox.Quaternion) -> fox.FrameTransforms:
    """The vehicle's frame in the world, from its place [3] there and how it is turned."""
    return fox.FrameTransforms(
        transforms=[
            fox.FrameTransform(
                timestamp=make_timestamp(at_ns),
                parent_frame_id=WORLD,
                child_frame_id=VEHICLE,
                translation=vector(place_m),
                rotation=turned,
            )
        ]
    )


def mount_sensor(
    at_ns: int, name: str, position_m: FloatArray, attitude_rad: FloatArray
) -> Transforms:
    """The frame of a sensor on the vehicle."""
    return fox.FrameTransforms(
        transforms=[
            fox.FrameTransform(
                timestamp=make_timestamp(at_ns),
                parent_frame_id=VEHICLE,
                child_frame_id=name,
                translation=vector(position_m),
                rotation=quaternion(attitude_rad),
            )
        ]
    )


def location_fix(at_ns: int, place: FloatArray, state: FloatArray) -> fox.LocationFix:
    """Latitude and longitude in degrees and height, for maps; state: [6], its yaw left of east."""
    latitude, longitude, height = place.tolist()
    return fox.LocationFix(
        timestamp=make_timestamp(at_ns),
        frame_id=VEHICLE,
        latitude=latitude,
        longitude=longitude,
        altitude=height,
        heading=float((0.5 * np.pi - state[5]) % (2.0 * np.pi)),
    )


def point_cloud(at_ns: int, points_m: FloatArray, frame: str = WORLD) -> fox.PointCloud:
    """Points [n, 3] of a frame as x, y, z of 4 bytes each."""
    kind = fox.PackedElementFieldNumericType.Float32
    return fox.PointCloud(
        timestamp=make_timestamp(at_ns),
        frame_id=frame,
        pose=pose_of(np.zeros(3), np.zeros(3)),
        point_stride=12,
        fields=[
            fox.PackedElementField(name=name, offset=4 * at, type=kind)
            for at, name in enumerate("xyz")
        ],
        data=points_m.astype("<f4").tobytes(),
    )


def log_line(at_ns: int, mode: Mode, text: str) -> fox.Log:
    warning = fox.LogLevel.Warning
    level = {
        Mode.EMERGENCY: fox.LogLevel.Error,
        Mode.ESCAPE: warning,
        Mode.HOLD: warning,
        Mode.NARROW: warning,
        Mode.AVOIDANCE: warning,
    }
    return fox.Log(
        timestamp=make_timestamp(at_ns),
        level=level.get(mode, fox.LogLevel.Info),
        message=text,
        name="clearway",
    )


# --- what stays --------------------------------------------------------------------------


def scene(mission: dict[str, Any], path_m: FloatArray, at_ns: int) -> fox.SceneUpdate:
    """Obstacles, waypoints with their reach radius, and the whole path that was flown [n, 3]."""
    goals = [*mission["waypoints_m"], *mission["landing_m"]]
    radius = mission["reach_radius_m"]
    waypoints = entity(
        "waypoints",
        at_ns,
        spheres=[
            fox.SpherePrimitive(
                pose=pose_of(np.array(goal), np.zeros(3)),
                size=vector((2 * radius,) * 3),
                color=color(WAYPOINT, 0.25),
            )
            for goal in goals
        ],
        texts=[draw_text(np.array(goal), str(at + 1), WAYPOINT) for at, goal in enumerate(goals)],
    )
    flown = entity("flown", at_ns, lines=[line(list_points(path_m), EXECUTED, 2.0)])
    return fox.SceneUpdate(
        entities=[
            waypoints,
            flown,
            *(_obstacle(n, one, at_ns) for n, one in enumerate(mission["obstacles"])),
        ]
    )


def _obstacle(number: int, obstacle: dict[str, Any], at_ns: int) -> fox.SceneEntity:
    place, radius = np.array(obstacle["position_m"]), obstacle["radius_m"]
    pose = pose_of(place, np.array(obstacle["orientation_rad"]))
    paint = color(KNOWN[obstacle["known"]], 0.45 if obstacle["known"] in ("map", "rule") else 1.0)
    size = [*obstacle["size_m"], 0.0, 0.0, 0.0][:3]
    name = f"obstacle {number} {obstacle['name']}".rstrip()
    if obstacle["shape"] == "ball":
        ball = fox.SpherePrimitive(pose=pose, size=vector((2 * radius,) * 3), color=paint)
        return entity(name, at_ns, spheres=[ball])
    if obstacle["shape"] == "line":
        return _capsule(name, place, obstacle, paint, at_ns)
    # Foxglove has no rounded boxes: the rims of plates end where their faces do.
    rim = 2 * radius if obstacle["shape"] == "cuboid" else 0.0
    across = (size[0] + rim, size[1] + rim, size[2] + 2 * radius)
    return entity(
        name, at_ns, cubes=[fox.CubePrimitive(pose=pose, size=vector(across), color=paint)]
    )


def _capsule(
    name: str, place: FloatArray, obstacle: dict[str, Any], paint: fox.Color, at_ns: int
) -> fox.SceneEntity:
    """A cylinder, whose axis Foxglove has along z, with a ball at each end."""
    radius, (length,) = obstacle["radius_m"], obstacle["size_m"]
    rotation = world_from_body(obstacle["orientation_rad"])
    upright = attitude_from_rotation(rotation @ world_from_body([0.0, 0.5 * np.pi, 0.0]))
    ends = [place + sign * 0.5 * length * rotation[:, 0] for sign in (-1.0, 1.0)]
    return entity(
        name,
        at_ns,
        cylinders=[
            fox.CylinderPrimitive(
                pose=pose_of(place, upright),
                size=vector((2 * radius, 2 * radius, length)),
                bottom_scale=1.0,
                top_scale=1.0,
                color=paint,
            )
        ],
        spheres=[
            fox.SpherePrimitive(
                pose=pose_of(end, np.zeros(3)), size=vector((2 * radius,) * 3), color=paint
            )
            for end in ends
        ],
    )


def draw_intruders(
    message: dict[str, Any], radius_m: dict[str, float], ahead_s: float, at_ns: int
) -> fox.SceneUpdate:
    """Intruders as balls with names, and arrows to where they will be `ahead_s` later."""
    entities = []
    for one in message["intruders"]:
        place, velocity = np.array(one["position_m"]), np.array(one["velocity_mps"])
        radius = radius_m.get(one["name"]) or 0.5
        ball = fox.SpherePrimitive(
            pose=pose_of(place, np.zeros(3)), size=vector((2 * radius,) * 3), color=color(INTRUDER)
        )
        above = place + np.array([0.0, 0.0, 1.6 * radius])
        entities.append(
            entity(
                f"intruder {one['name']}",
                at_ns,
                spheres=[ball],
                arrows=_arrows(place, velocity * ahead_s, radius),
                texts=[draw_text(above, one["name"], INTRUDER)],
            )
        )
    return fox.SceneUpdate(entities=entities)


def _arrows(place: FloatArray, way: FloatArray, radius: float) -> list[fox.ArrowPrimitive]:
    length = float(np.linalg.norm(way))
    if length < 1e-6:
        return []
    along = np.array([0.0, -np.arcsin(way[2] / length), np.arctan2(way[1], way[0])])
    return [
        fox.ArrowPrimitive(
            pose=pose_of(place, along),
            shaft_length=length,
            shaft_diameter=0.3 * radius,
            head_length=0.8 * radius,
            head_diameter=0.8 * radius,
            color=color(INTRUDER),
        )
    ]


# --- parts --------------------------------------------------------------------------------


def entity(name: str, at_ns: int, **primitives: Any) -> fox.SceneEntity:
    return fox.SceneEntity(timestamp=make_timestamp(at_ns), frame_id=WORLD, id=name, **primitives)


def line(points: list[fox.Point3], rgb: Rgb, width: float) -> fox.LinePrimitive:
    """A line through points of the world, its width in pixels."""
    return fox.LinePrimitive(
        type=fox.LinePrimitiveLineType.LineStrip,
        pose=pose_of(np.zeros(3), np.zeros(3)),
        thickness=width,
        scale_invariant=True,
        points=points,
        color=color(rgb),
    )


def line_pieces(points: list[fox.Point3], pose: fox.Pose, paint: fox.Color) -> fox.LinePrimitive:
    """Single lines of one pixel between pairs of points, in the frame of a pose."""
    return fox.LinePrimitive(
        type=fox.LinePrimitiveLineType.LineList,
        pose=pose,
        thickness=1.0,
        scale_invariant=True,
        points=points,
        color=paint,
    )


def draw_text(place: FloatArray, text: str, rgb: Rgb) -> fox.TextPrimitive:
    return fox.TextPrimitive(
        pose=pose_of(place, np.zeros(3)),
        billboard=True,
        font_size=14.0,
        scale_invariant=True,
        color=color(rgb),
        text=text,
    )


def vector(values: Sequence[float] | FloatArray) -> fox.Vector3:
    return fox.Vector3(x=float(values[0]), y=float(values[1]), z=float(values[2]))


def list_points(places_m: FloatArray) -> list[fox.Point3]:
    """Of places [n, 3]; numbers are taken faster from lists than from arrays."""
    return [fox.Point3(x=x, y=y, z=z) for x, y, z in places_m.tolist()]
