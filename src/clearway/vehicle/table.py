"""Movements known only by measurement: where each leads from level flight (tables 4.1, 4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.base.brief import brief
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, world_from_body


@dataclass(frozen=True)
class MovementTable:
    """Per movement the change of state (4.1) from level flight at equal times until its end.

    offsets[m][s]: six numbers (m, rad) after (s + 1) / steps of the movement's duration. Predicts
    by (4.14), (4.15): the level displacement, turned with the vehicle. For the plane model that is
    exact at pitch 0 only (up to 0.029 m a movement at 30 deg), so prefer the model where there is
    one. Raises ClearwayError for offsets of the wrong shape or not finite.
    """

    names: tuple[str, ...]
    offsets: tuple[tuple[tuple[float, ...], ...], ...]

    __repr__ = brief

    def __post_init__(self) -> None:
        if len(self.names) != len(self.offsets):
            raise ClearwayError("movement table: one entry per movement name is needed")
        for name, rows in zip(self.names, self.offsets, strict=True):
            if not rows or any(len(row) != 6 for row in rows):
                raise ClearwayError(f"movement table, {name}: rows of six numbers are needed")
            if not np.all(np.isfinite(rows)):
                raise ClearwayError(f"movement table, {name}: numbers must be finite")

    @classmethod
    def from_rows(cls, rows: Mapping[str, npt.ArrayLike]) -> MovementTable:
        """From [6] or [steps, 6] arrays by movement name: x, y, z, roll, pitch, yaw changes."""
        offsets = []
        for name, row in rows.items():
            array = np.atleast_2d(np.asarray(row, dtype=np.float64))
            if array.ndim != 2 or array.shape[1] != 6:
                raise ClearwayError(f"movement table, {name}: rows of six numbers are needed")
            offsets.append(tuple(tuple(float(value) for value in line) for line in array))
        return cls(tuple(rows), tuple(offsets))

    def row(self, name: str) -> FloatArray:
        """[6] change of state by the whole movement."""
        return np.array(self.offsets[self.names.index(name)][-1])

    def predict(self, state: npt.ArrayLike, name: str, share: float = 1.0) -> FloatArray:
        """State [6] after a share in [0, 1] of the movement; linear between measured times."""
        rows = np.array([(0.0,) * 6, *self.offsets[self.names.index(name)]])
        at = np.clip(share, 0.0, 1.0) * (len(rows) - 1)
        before = min(int(at), len(rows) - 2)
        offset = rows[before] + (at - before) * (rows[before + 1] - rows[before])
        start = np.asarray(state, dtype=np.float64)
        displacement = world_from_body(start[3:]) @ offset[:3]  # (4.14)
        end: FloatArray = start + np.concatenate([displacement, offset[3:]])  # (4.15)
        return end
