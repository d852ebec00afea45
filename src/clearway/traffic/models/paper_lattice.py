"""The paper's own numbers for the spread (5.24)-(5.34): a lattice in each plane, plane by plane.

Slow, and only as fine as its lattice; kept to reproduce the paper and to check the ray form.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid, GridEdges, cell_of_point
from clearway.traffic.intruder import Intruder
from clearway.traffic.models.cells import ModelArrays, ModelCells, empty_arrays
from clearway.traffic.models.line import stay
from clearway.traffic.models.many import Intruders
from clearway.traffic.models.spread import cone_axes
from clearway.traffic.models.timing import VehicleTimes


def lattice_cells(
    grid: AvoidanceGrid,
    intruders: Sequence[Intruder],
    up: FloatArray,
    points_per_m: int = 10,
    vehicle_times: VehicleTimes | None = None,
) -> ModelCells:
    """Spread of each intruder by the paper's lattice (5.31), with times of arrival (5.33), (5.34).

    Intruders are in the grid's frame at the decision time, t = 0; up [3] is world up in it.
    `points_per_m` is the density k of (5.24), in the planes and between them. With vehicle times
    `timed` is the count of hits of (5.6).
    """
    if points_per_m < 1:
        raise ClearwayError(f"points_per_m: at least 1 is needed, got {points_per_m!r}")
    arrays = empty_arrays(len(intruders), grid.cells)
    among = Intruders.of(intruders)
    position, velocity = among.motions(grid.range_m)
    if vehicle_times is None:
        entry, leave = np.full(grid.cells, np.inf), np.full(grid.cells, -np.inf)
    else:
        entry, leave = vehicle_times.entry_s, vehicle_times.leave_s
    share = np.zeros((len(intruders), grid.cells))
    _lattices(
        position,
        velocity,
        np.sin(among.spread_rad),
        up,
        1.0 / points_per_m,
        grid.edges,
        entry,
        leave,
        arrays,
        share,
    )
    timed = None if vehicle_times is None else arrays.probability * share
    return ModelCells(*arrays, timed=timed)


@compiled
def _lattices(
    position: Floats2,
    velocity: Floats2,
    sine: Floats2,
    up: Floats,
    spacing: float,
    edges: GridEdges,
    vehicle_entry_s: Floats,
    vehicle_leave_s: Floats,
    arrays: ModelArrays,
    share: Floats2,
) -> None:
    for n in range(len(position)):
        if not np.any(velocity[n]):
            x, y, z = position[n]
            stay(n, cell_of_point(x, y, z, edges), arrays)
            continue
        axes = cone_axes(velocity[n], up)
        speed = np.sqrt(np.sum(velocity[n] ** 2))
        closest = -np.sum(position[n] * axes[0])
        outer = edges.range_m[-1]
        first = max(0, int(np.floor((closest - outer) / spacing)))
        last = int(np.ceil((closest + outer) / spacing))
        hits, timely = np.zeros(share.shape[1]), np.zeros(share.shape[1])
        for plane in range(first, last + 1):
            distance = plane * spacing
            time = distance / speed
            probability, count = _plane(
                position[n], axes, distance, sine[n], spacing, edges, share.shape[1]
            )
            for cell in np.flatnonzero(count):
                if hits[cell] == 0.0:
                    arrays.entry_s[n, cell] = time
                arrays.leave_s[n, cell] = time
                arrays.dwell_s[n, cell] += probability[cell] * spacing / speed
                hits[cell] += count[cell]
                if vehicle_entry_s[cell] <= time <= vehicle_leave_s[cell]:
                    timely[cell] += count[cell]
        for cell in np.flatnonzero(hits):
            hull = arrays.leave_s[n, cell] - arrays.entry_s[n, cell] + spacing / speed
            arrays.probability[n, cell] = arrays.dwell_s[n, cell] / hull
            share[n, cell] = timely[cell] / hits[cell]


@compiled
def _plane(
    apex: Floats,
    axes: tuple[Floats, Floats, Floats],
    distance: float,
    sine: Floats,
    spacing: float,
    edges: GridEdges,
    cells: int,
) -> tuple[Floats, Floats]:
    """Probability (5.30) and number of lattice points in each cell for one ellipse.

    (5.26), (5.28), (5.29); the points in a cell, plane after plane, are (5.32).

    The lattice is laid in the plane, centred on the axis: there is always a point (5.28).
    """
    along, level, across = axes
    center = apex + distance * along
    semi_level, semi_across = distance * sine[0], distance * sine[1]
    probability, count = np.zeros(cells), np.zeros(cells)
    total = 0.0
    most_level, most_across = int(semi_level / spacing), int(semi_across / spacing)
    for a in range(-most_level, most_level + 1):
        u = a * spacing / semi_level if a != 0 else 0.0
        for b in range(-most_across, most_across + 1):
            w = b * spacing / semi_across if b != 0 else 0.0
            if u * u + w * w > 1.0:
                continue
            # Average of the two normals (5.20), both times the product of the semi-axes.
            density = semi_across * np.exp(-0.5 * u * u) + semi_level * np.exp(-0.5 * w * w)
            density = max(density, 1e-300)
            total += density
            point = center + a * spacing * level + b * spacing * across
            cell = cell_of_point(point[0], point[1], point[2], edges)
            if cell >= 0:
                probability[cell] += density
                count[cell] += 1.0
    return probability / total, count
