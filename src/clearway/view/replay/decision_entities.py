"""Foxglove's scene of a decision: plan, cells and trajectories stay where it was taken."""

from __future__ import annotations

import numpy as np
from foxglove import messages as fox

from clearway.avoidance.decision import Decision
from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray
from clearway.reach.tree import ReachSet
from clearway.view.replay.entities import (
    ESCAPE_RGB,
    PLANNED_COLOUR,
    Rgb,
    color,
    entity,
    line,
    line_pieces,
    list_points,
    pose_of,
)

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


def plan(decision: Decision, at_ns: int) -> fox.SceneUpdate:
    """The path that the decision means to fly, and the tube within which it is expected."""
    points = list_points(decision.path_m)
    tube = _balls(decision.path_m, decision.tube_m)
    lines = [line(points, PLANNED_COLOUR, 3.0)]
    planned = entity("plan", at_ns, lines=lines, spheres=tube)
    return fox.SceneUpdate(entities=[planned])


def _balls(places_m: FloatArray, radii_m: FloatArray) -> list[fox.SpherePrimitive]:
    """A tube as a chain of balls, those that have a size."""
    upright = np.zeros(3)
    return [
        fox.SpherePrimitive(
            pose=pose_of(place, upright),
            size=fox.Vector3(x=2.0 * radius, y=2.0 * radius, z=2.0 * radius),
            color=color(PLANNED_COLOUR, 0.15),
        )
        for place, radius in zip(places_m, radii_m.tolist(), strict=True)
        if radius > 0.0
    ]


def way_out(decision: Decision, at_ns: int) -> fox.SceneUpdate:
    """The held escape, up to the end of its first round; nothing where there is none."""
    points = list_points(decision.way_out_path_m)
    lines = [line(points, ESCAPE_RGB, 2.0)] if points else []
    return fox.SceneUpdate(entities=[entity("escape", at_ns, lines=lines)])


class CellScene:
    """Cells with an obstacle probability worth showing, coloured by it."""

    def __init__(self, grid: AvoidanceGrid) -> None:
        edges = np.meshgrid(*grid.edges, indexing="ij")
        corners = cartesian_from_spherical(np.stack(edges, axis=-1))
        self._corners = list_points(corners.reshape(-1, 3))
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

    def update(self, decision: Decision, at_ns: int) -> fox.SceneUpdate:
        obstacle = decision.cells.obstacle
        class_of = np.minimum(len(BLOCKED) * obstacle, len(BLOCKED) - 1).astype(np.int64)
        triangles = []
        for step, rgb in enumerate(BLOCKED):
            cells = np.flatnonzero((obstacle >= TELLING) & (class_of == step))
            if len(cells):
                triangles.append(self._blocks(cells, grid_pose(decision), rgb))
        return fox.SceneUpdate(entities=[entity("cells", at_ns, triangles=triangles)])

    def _blocks(self, cells: IntArray, pose: fox.Pose, rgb: Rgb) -> fox.TriangleListPrimitive:
        return fox.TriangleListPrimitive(
            pose=pose,
            points=[self._corners[corner] for corner in self._of_cell[cells].ravel()],
            color=color(rgb, 0.35),
            indices=[8 * cell + corner for cell in range(len(cells)) for corner in FACES],
        )


class ReachScene:
    """Trajectories of reach sets, movement by movement, coloured by how they are rated."""

    def __init__(self) -> None:
        self._ends: dict[float, list[fox.Point3]] = {}

    def update(self, decision: Decision, at_ns: int) -> fox.SceneUpdate:
        reach_set = decision.prepared.reach_set
        ends = self._points_of(reach_set)
        rating = decision.reach.node_rating
        class_of = np.minimum(len(RATED) * rating, len(RATED) - 1).astype(np.int64)
        lines = []
        for step, rgb in enumerate(RATED):
            nodes = np.flatnonzero(class_of == step)
            if len(nodes):
                pairs = np.stack([reach_set.parent[nodes], nodes], axis=1).ravel()
                pieces = [ends[node] for node in pairs]
                lines.append(line_pieces(pieces, grid_pose(decision), color(rgb, 0.6)))
        return fox.SceneUpdate(entities=[entity("reach set", at_ns, lines=lines)])

    def _points_of(self, reach_set: ReachSet) -> list[fox.Point3]:
        """Ends of the nodes, and last, so that the parent -1 finds it, the start."""
        pitch = reach_set.start_pitch_rad
        if pitch not in self._ends:
            places = np.concatenate([reach_set.samples_m[:, -1], np.zeros((1, 3))])
            self._ends[pitch] = list_points(places)
        return self._ends[pitch]


def grid_pose(decision: Decision) -> fox.Pose:
    frame = decision.frame
    return pose_of(frame.origin_m, frame.attitude_rad)
