"""Proof that a place is walled in: no way out of it keeps the margin, however far things are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.live.routing.distance_field import HALF_DIAGONAL, Distance, VoxelField

VOXELS_PER_MARGIN = (2.0, 1.0)
"""Fine enough for walls without thickness, then coarser for larger rooms behind thicker walls."""
BOX_VOXELS = (24, 48, 88)
"""Widths of the boxes, in voxels, within which walls are looked for."""
REFINED_VOXELS = 48
"""Boxes up to this width are looked at again finer where a coarse voxel may hold a gap."""
REFINEMENT = 3


@dataclass(frozen=True, eq=False)
class InfeasibilityProof:
    """A closed space around a place."""

    clearance_m: float
    """No way out of it stays farther than this from the obstacles; as voxels tell, not exact."""
    walls_m: FloatArray
    """[n, 3] world points in what closes the space, at least one."""


def prove_infeasible(
    distance: Distance, place_m: FloatArray, radius_m: float, margin_m: float, away_m: FloatArray
) -> InfeasibilityProof | None:
    """The closed space around a ball, if it holds no point at `away_m`; None where none is proven.

    A voxel counts as blocked only if all of it is nearer to an obstacle than the margin, and a way
    may go on to any of 26 neighbours: a gap is never overlooked, and a wall is found if it is, with
    the margin on both sides, some three voxels thick.
    """
    for per_margin in VOXELS_PER_MARGIN:
        width = margin_m / per_margin
        for voxels in BOX_VOXELS:
            half = 0.5 * voxels * width
            if half < radius_m + 2.0 * width:
                continue
            field = VoxelField.sample(distance, place_m - half, place_m + half, place_m, width)
            ceiling = field.ceiling()
            found = _proof_in(ceiling, place_m, radius_m, margin_m, away_m)
            if found is None and voxels <= REFINED_VOXELS:
                inside = ceiling.within(place_m, radius_m + HALF_DIAGONAL * width)
                open_voxels = _find_reached(ceiling.distance_m, margin_m, inside)
                finer = ceiling.refine(distance, open_voxels, REFINEMENT)
                found = _proof_in(finer, place_m, radius_m, margin_m, away_m)
            if found is not None:
                return found
    return None


def _proof_in(
    ceiling: VoxelField,
    place_m: FloatArray,
    radius_m: float,
    margin_m: float,
    away_m: FloatArray,
) -> InfeasibilityProof | None:
    """The closed space that upper bounds of the distance in each voxel prove, if any."""
    spread = HALF_DIAGONAL * ceiling.width_m
    inside = ceiling.within(place_m, radius_m + spread)
    outside = ceiling.within(away_m, spread)
    if not _is_closed(ceiling.distance_m, margin_m, inside, outside):
        return None
    clearance = _widest_way(ceiling.distance_m, margin_m, inside, outside)
    walls = _walls(ceiling.distance_m, clearance, inside)
    return InfeasibilityProof(clearance, ceiling.centers_m(walls))


def _find_reached(passable: FloatArray, margin_m: float, inside: IntArray) -> BoolArray:
    """[nx, ny, nz] voxels that ways from inside can come to."""
    from scipy.ndimage import label

    labels, _ = label(passable >= margin_m, structure=np.ones((3, 3, 3)))
    seeds = np.unique(labels.ravel()[inside])
    return np.isin(labels, seeds[seeds > 0])


def _is_closed(passable: FloatArray, margin_m: float, inside: IntArray, outside: IntArray) -> bool:
    """Whether ways from inside come neither to the border of the box nor to the outside."""
    reached = _find_reached(passable, margin_m, inside)
    if np.any(reached.ravel()[outside]):
        return False
    return not any(np.any(np.take(reached, end, axis=axis)) for axis in range(3) for end in (0, -1))


def _widest_way(
    passable: FloatArray, margin_m: float, inside: IntArray, outside: IntArray
) -> float:
    """Smallest margin, within a hundredth, at which the space is closed."""
    low, high = float(passable.min()), margin_m
    while high - low > 0.01 * margin_m:
        middle = 0.5 * (low + high)
        if _is_closed(passable, middle, inside, outside):
            high = middle
        else:
            low = middle
    return high


def _walls(passable: FloatArray, clearance_m: float, inside: IntArray) -> IntArray:
    """Flat numbers of the blocked voxels next to the closed space."""
    from scipy.ndimage import binary_dilation

    reached = _find_reached(passable, clearance_m, inside)
    if not np.any(reached):
        return inside
    around = binary_dilation(reached, structure=np.ones((3, 3, 3)))
    return np.flatnonzero(around & ~reached)
