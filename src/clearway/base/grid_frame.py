"""Where the avoidance grid sits in the world: the one place that leaves out the roll."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.brief import brief
from clearway.base.frames import FloatArray, compute_rotation
from clearway.base.state import State


@dataclass(frozen=True, slots=True, eq=False)
class GridFrame:
    """The frame of the avoidance grid at an own state estimate: its place, pitch and yaw, roll left
    out."""

    origin_m: FloatArray
    """[3] world frame."""
    attitude_rad: FloatArray
    """[3] roll, which is 0, pitch and yaw."""
    world_from_grid: FloatArray
    """[3, 3] rotation (3.37)."""

    __repr__ = brief

    @classmethod
    def of(cls, state: State) -> GridFrame:
        _, pitch, yaw = state.attitude_rad.tolist()
        attitude = np.array([0.0, pitch, yaw])
        return cls(state.position_m, attitude, compute_rotation(0.0, pitch, yaw))

    @property
    def up(self) -> FloatArray:
        """[3] world up, in the grid frame."""
        up: FloatArray = self.world_from_grid[2]
        return up

    def grid_points(self, world_points_m: FloatArray) -> FloatArray:
        """[..., 3] world points, in the grid frame."""
        points: FloatArray = (world_points_m - self.origin_m) @ self.world_from_grid
        return points

    def world_points(self, grid_points_m: FloatArray) -> FloatArray:
        """[..., 3] points of the grid frame, in the world."""
        # As one table: numpy multiplies a stack of small ones one by one.
        turned = grid_points_m.reshape(-1, 3) @ self.world_from_grid.T
        points: FloatArray = turned.reshape(grid_points_m.shape) + self.origin_m
        return points

    def world_vectors(self, grid_vectors: FloatArray) -> FloatArray:
        """[..., 3] directions or velocities of the grid frame, in the world."""
        vectors: FloatArray = grid_vectors @ self.world_from_grid.T
        return vectors

    def grid_from_body(self, pose: State) -> tuple[FloatArray, FloatArray] | None:
        """Rotation [3, 3] and translation [3] from the body at a pose; None where they are one."""
        # Lists of three are compared faster than arrays.
        is_here = pose.position_m.tolist() == self.origin_m.tolist()
        if is_here and pose.attitude_rad.tolist() == self.attitude_rad.tolist():
            return None
        rotation = self.world_from_grid.T @ pose.world_from_body
        return rotation, self.world_from_grid.T @ (pose.position_m - self.origin_m)
