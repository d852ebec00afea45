"""Foxglove's messages of a run: scene updates, transforms, point clouds and log lines.

The cells, trajectories and plan of a decision stay where it was taken until the next one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from foxglove import messages as fox

from clearway.avoidance import Decision, grid_frame
from clearway.frames import (
    FloatArray,
    attitude_from_rotation,
    cartesian_from_spherical,
    world_from_body,
)
from clearway.grid import AvoidanceGrid
from clearway.mission import Mode
from clearway.reach.tree import ReachSet

Rgb = tuple[float, float, float]
WORLD, VEHICLE = "world", "vehicle"
PLANNED, EXECUTED, WAYPOINT = (0.84, 0.15, 0.16), (0.12, 0.37, 0.75), (0.18, 0.62, 0.31)
INTRUDER, POINT = (0.85, 0.15, 0.6), (0.75, 0.22, 0.17)
KNOWN: dict[str, Rgb] = {
    "world": (0.80, 0.55, 0.35),
    "both": (0.55, 0.57, 0.60),
    "map": (0.45, 0.55, 0.85),
}
"""Obstacles: only there, there and in the map, only in the map."""
RATED: tuple[Rgb, ...] = (
    (0.65, 0.0, 0.15),
    (0.96, 0.43, 0.26),
    (0.96, 0.76, 0.36),
    (0.29, 0.60, 0.79),
    (0.13, 0.33, 0.63),
)
"""Ratings of trajectories from 0 to 1."""
BLOCKED: tuple[Rgb, ...] = ((0.97, 0.78, 0.61), (0.94, 0.54, 0.38), (0.70, 0.09, 0.17), (0.4, 0, 0))
"""Obstacle probabilities of cells."""
TELLING = 0.05
"""Obstacle probability from which a cell is shown."""
FACES = (
    *(0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5),  # near and far
    *(0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6),  # right and left
    *(0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3),  # bottom and top
)
"""Triangles of a cell; its corner 4 i + 2 j + k lies far, left, up where i, j, k are 1."""


def color(rgb: Rgb, alpha: float = 1.0) -> fox.Color:
    return fox.Color(r=rgb[0], g=rgb[1], b=rgb[2], a=alpha)


def moment(time_s: float) -> fox.Timestamp:
    whole, rest = divmod(round(time_s * 1e9), 1_000_000_000)
    return fox.Timestamp(sec=whole, nsec=rest)


def pose_of(position_m: FloatArray, attitude_rad: FloatArray) -> fox.Pose:
    """Place and attitude (roll, pitch nose down positive, yaw left positive)."""
    return fox.Pose(position=_vector(position_m), orientation=quaternion(attitude_rad))


def quaternion(attitude_rad: FloatArray) -> fox.Quaternion:
    """Of the rotation Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(0.5 * attitude_rad), np.sin(0.5 * attitude_rad)
    return fox.Quaternion(
        w=float(cr * cp * cy + sr * sp * sy),
        x=float(sr * cp * cy - cr * sp * sy),
        y=float(cr * sp * cy + sr * cp * sy),
        z=float(cr * cp * sy - sr * sp * cy),
    )


def transform(time_s: float, state: FloatArray) -> fox.FrameTransforms:
    """The vehicle's frame in the world; state: [6]."""
    return fox.FrameTransforms(
        transforms=[
            fox.FrameTransform(
                timestamp=moment(time_s),
                parent_frame_id=WORLD,
                child_frame_id=VEHICLE,
                translation=_vector(state[:3]),
                rotation=quaternion(state[3:]),
            )
        ]
    )


def point_cloud(time_s: float, points_m: FloatArray) -> fox.PointCloud:
    """World points [n, 3] as x, y, z of 4 bytes each."""
    kind = fox.PackedElementFieldNumericType.Float32
    return fox.PointCloud(
        timestamp=moment(time_s),
        frame_id=WORLD,
        pose=pose_of(np.zeros(3), np.zeros(3)),
        point_stride=12,
        fields=[
            fox.PackedElementField(name=name, offset=4 * at, type=kind)
            for at, name in enumerate("xyz")
        ],
        data=points_m.astype("<f4").tobytes(),
    )


def log_line(time_s: float, mode: Mode, text: str) -> fox.Log:
    level = {Mode.EMERGENCY: fox.LogLevel.Error, Mode.AVOIDANCE: fox.LogLevel.Warning}
    return fox.Log(
        timestamp=moment(time_s),
        level=level.get(mode, fox.LogLevel.Info),
        message=text,
        name="clearway",
    )


# --- what stays --------------------------------------------------------------------------


def scene(mission: dict[str, Any], path_m: FloatArray) -> fox.SceneUpdate:
    """Obstacles, waypoints with their reach radius, and the whole path that was flown [n, 3]."""
    goals = [*mission["waypoints_m"], *mission["landing_m"]]
    radius = mission["reach_radius_m"]
    waypoints = _entity(
        "waypoints",
        spheres=[
            fox.SpherePrimitive(
                pose=pose_of(np.array(goal), np.zeros(3)),
                size=_size((2 * radius,) * 3),
                color=color(WAYPOINT, 0.25),
            )
            for goal in goals
        ],
        texts=[_text(np.array(goal), str(at + 1), WAYPOINT) for at, goal in enumerate(goals)],
    )
    flown = _entity("flown", lines=[_line([_point(p) for p in path_m], EXECUTED, 2.0)])
    return fox.SceneUpdate(
        entities=[waypoints, flown, *(_obstacle(n, o) for n, o in enumerate(mission["obstacles"]))]
    )


def _obstacle(number: int, obstacle: dict[str, Any]) -> fox.SceneEntity:
    place, radius = np.array(obstacle["position_m"]), obstacle["radius_m"]
    pose = pose_of(place, np.array(obstacle["orientation_rad"]))
    paint = color(KNOWN[obstacle["known"]], 0.45 if obstacle["known"] == "map" else 1.0)
    size = [*obstacle["size_m"], 0.0, 0.0, 0.0][:3]
    name = f"obstacle {number} {obstacle['name']}".rstrip()
    if obstacle["shape"] == "ball":
        ball = fox.SpherePrimitive(pose=pose, size=_size((2 * radius,) * 3), color=paint)
        return _entity(name, spheres=[ball])
    if obstacle["shape"] == "line":
        return _capsule(name, place, obstacle, paint)
    # Foxglove has no rounded boxes: the rims of plates end where their faces do.
    rim = 2 * radius if obstacle["shape"] == "cuboid" else 0.0
    across = (size[0] + rim, size[1] + rim, size[2] + 2 * radius)
    return _entity(name, cubes=[fox.CubePrimitive(pose=pose, size=_size(across), color=paint)])


def _capsule(
    name: str, place: FloatArray, obstacle: dict[str, Any], paint: fox.Color
) -> fox.SceneEntity:
    """A cylinder, whose axis Foxglove has along z, with a ball at each end."""
    radius, (length,) = obstacle["radius_m"], obstacle["size_m"]
    rotation = world_from_body(obstacle["orientation_rad"])
    upright = attitude_from_rotation(rotation @ world_from_body([0.0, 0.5 * np.pi, 0.0]))
    ends = [place + sign * 0.5 * length * rotation[:, 0] for sign in (-1.0, 1.0)]
    return _entity(
        name,
        cylinders=[
            fox.CylinderPrimitive(
                pose=pose_of(place, upright),
                size=_size((2 * radius, 2 * radius, length)),
                bottom_scale=1.0,
                top_scale=1.0,
                color=paint,
            )
        ],
        spheres=[
            fox.SpherePrimitive(
                pose=pose_of(end, np.zeros(3)), size=_size((2 * radius,) * 3), color=paint
            )
            for end in ends
        ],
    )


# --- what a decision was ------------------------------------------------------------------


def plan(decision: Decision) -> fox.SceneUpdate:
    """The path that the decision means to fly."""
    points = [_point(place) for place in decision.path_m]
    entity = _entity("plan", decision.state.time_s, lines=[_line(points, PLANNED, 3.0)])
    return fox.SceneUpdate(entities=[entity])


class CellScene:
    """Cells with an obstacle probability worth showing, coloured by it."""

    def __init__(self, grid: AvoidanceGrid) -> None:
        edges = np.meshgrid(*grid.edges, indexing="ij")
        corners = cartesian_from_spherical(np.stack(edges, axis=-1))
        self._corners = [_point(corner) for corner in corners.reshape(-1, 3)]
        index = np.arange(len(self._corners)).reshape(corners.shape[:3])
        self._of_cell = np.stack(
            [
                index[i : i + grid.layers, j : j + grid.columns, k : k + grid.rows].ravel()
                for i in (0, 1)
                for j in (0, 1)
                for k in (0, 1)
            ],
            axis=1,
        )

    def update(self, decision: Decision) -> fox.SceneUpdate:
        obstacle = decision.cells.obstacle
        class_of = np.minimum(len(BLOCKED) * obstacle, len(BLOCKED) - 1).astype(np.int64)
        shown = [
            self._cells(np.flatnonzero((obstacle >= TELLING) & (class_of == step)), decision, rgb)
            for step, rgb in enumerate(BLOCKED)
        ]
        triangles = [one for one in shown if one is not None]
        return fox.SceneUpdate(
            entities=[_entity("cells", decision.state.time_s, triangles=triangles)]
        )

    def _cells(self, cells: Any, decision: Decision, rgb: Rgb) -> fox.TriangleListPrimitive | None:
        if not len(cells):
            return None
        return fox.TriangleListPrimitive(
            pose=grid_pose(decision),
            points=[self._corners[corner] for corner in self._of_cell[cells].ravel()],
            color=color(rgb, 0.35),
            indices=[8 * cell + corner for cell in range(len(cells)) for corner in FACES],
        )


class ReachScene:
    """Trajectories of reach sets, movement by movement, coloured by how they are rated."""

    def __init__(self) -> None:
        self._ends: dict[float, list[fox.Point3]] = {}

    def update(self, decision: Decision) -> fox.SceneUpdate:
        reach_set = decision.repertoire.reach_set
        ends = self._points_of(reach_set)
        rating = decision.reach.node_rating
        class_of = np.minimum(len(RATED) * rating, len(RATED) - 1).astype(np.int64)
        lines = []
        for step, rgb in enumerate(RATED):
            nodes = np.flatnonzero(class_of == step)
            if len(nodes):
                pairs = np.stack([reach_set.parent[nodes], nodes], axis=1).ravel()
                line = _line([ends[node] for node in pairs], rgb, 1.0, 0.6, grid_pose(decision))
                lines.append(line)
        return fox.SceneUpdate(entities=[_entity("reach set", decision.state.time_s, lines=lines)])

    def _points_of(self, reach_set: ReachSet) -> list[fox.Point3]:
        """Ends of the nodes, and last, so that the parent -1 finds it, the start."""
        pitch = reach_set.start_pitch_rad
        if pitch not in self._ends:
            places = np.concatenate([reach_set.samples_m[:, -1], np.zeros((1, 3))])
            self._ends[pitch] = [_point(place) for place in places]
        return self._ends[pitch]


def grid_pose(decision: Decision) -> fox.Pose:
    origin, rotation = grid_frame(decision.state)
    return pose_of(origin, attitude_from_rotation(rotation))


def traffic(message: dict[str, Any], radius_m: dict[str, float]) -> fox.SceneUpdate:
    """Intruders as balls with arrows as long as they fly in two seconds, and names."""
    entities = []
    for one in message["intruders"]:
        place, velocity = np.array(one["position_m"]), np.array(one["velocity_mps"])
        radius = radius_m.get(one["name"]) or 0.5
        ball = fox.SpherePrimitive(
            pose=pose_of(place, np.zeros(3)), size=_size((2 * radius,) * 3), color=color(INTRUDER)
        )
        above = place + np.array([0.0, 0.0, 1.6 * radius])
        entities.append(
            _entity(
                f"intruder {one['name']}",
                message["time_s"],
                spheres=[ball],
                arrows=_arrows(place, velocity, radius),
                texts=[_text(above, one["name"], INTRUDER)],
            )
        )
    return fox.SceneUpdate(entities=entities)


def _arrows(place: FloatArray, velocity: FloatArray, radius: float) -> list[fox.ArrowPrimitive]:
    speed = float(np.linalg.norm(velocity))
    if speed < 1e-6:
        return []
    pitch_down = -np.arcsin(velocity[2] / speed)
    along = np.array([0.0, pitch_down, np.arctan2(velocity[1], velocity[0])])
    return [
        fox.ArrowPrimitive(
            pose=pose_of(place, along),
            shaft_length=2.0 * speed,
            shaft_diameter=0.3 * radius,
            head_length=0.8 * radius,
            head_diameter=0.8 * radius,
            color=color(INTRUDER),
        )
    ]


# --- parts --------------------------------------------------------------------------------


def _entity(name: str, time_s: float = 0.0, **primitives: Any) -> fox.SceneEntity:
    return fox.SceneEntity(timestamp=moment(time_s), frame_id=WORLD, id=name, **primitives)


def _line(
    points: list[fox.Point3],
    rgb: Rgb,
    width: float,
    alpha: float = 1.0,
    pose: fox.Pose | None = None,
) -> fox.LinePrimitive:
    """A line through points; with a pose, single pieces between pairs of them."""
    kind = fox.LinePrimitiveLineType.LineList if pose else fox.LinePrimitiveLineType.LineStrip
    return fox.LinePrimitive(
        type=kind,
        pose=pose or pose_of(np.zeros(3), np.zeros(3)),
        thickness=width,
        scale_invariant=True,
        points=points,
        color=color(rgb, alpha),
    )


def _text(place: FloatArray, text: str, rgb: Rgb) -> fox.TextPrimitive:
    return fox.TextPrimitive(
        pose=pose_of(place, np.zeros(3)),
        billboard=True,
        font_size=14.0,
        scale_invariant=True,
        color=color(rgb),
        text=text,
    )


def _vector(values: FloatArray) -> fox.Vector3:
    return fox.Vector3(x=float(values[0]), y=float(values[1]), z=float(values[2]))


def _size(values: Any) -> fox.Vector3:
    return fox.Vector3(x=float(values[0]), y=float(values[1]), z=float(values[2]))


def _point(values: FloatArray) -> fox.Point3:
    return fox.Point3(x=float(values[0]), y=float(values[1]), z=float(values[2]))
