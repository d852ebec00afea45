"""Points into cells without an arctangent: tables of the monotone stand-ins of the two angles.

A point's azimuth is replaced by the pseudo-angle y / (|x| + |y|), unfolded over the four quadrants,
and its elevation by the sine z / d. Both grow with their angle, so a table of equal steps says the
column or row, but for the few steps that hold a border: there stand-ins are checked against those
of the borders, and within the tolerance of one the exact rule of `grid` decides.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Int32s, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled, read_only
from clearway.base.frames import FloatArray
from clearway.base.grid import (
    BORDER_TOLERANCE,
    RANGE_TOLERANCE,
    AvoidanceGrid,
    GridEdges,
    cell_of_point,
    interval_of,
)
from clearway.base.state import IntArray
from clearway.sensors.beams.pattern import BeamPattern

STEPS = 4096
BORDER = 1 << 24
"""In a table: the step holds a border, `cell_at_border` must decide."""
OUTSIDE = 1 << 28
"""In a table: no interval of the grid. Up to three of these add up within an int32."""
UNSURE = -2
"""In place of an interval: too near a border to tell by stand-ins."""
TINY = 1e-300
"""Keeps a division defined at the origin."""

TableArray = npt.NDArray[np.int32]


class CellTables(NamedTuple):
    """A grid as the fast binning takes it: per axis a table of STEPS entries.

    The three entries of a point add up to its flat cell; to BORDER or more where one of its steps
    holds a border, to OUTSIDE or more where there is no cell.
    """

    edges: GridEdges
    stand_ins: GridEdges
    """Of the edges: distances, pseudo-angles, sines."""
    layer: Int32s
    column: Int32s
    row: Int32s
    steps_per_m: float
    cone: Floats
    """[6] around the grid's directions: normals (x, y) of the half-planes at its sides, zero where
    it is no narrower than half a circle, then its lowest and highest sine, squared with their
    signs."""

    def __repr__(self) -> str:
        return brief(self)


ABOUT_RAD = 1e-6
"""By which the cone is wider than the grid: within it, the tables decide."""


@lru_cache(maxsize=16)
def cell_tables(grid: AvoidanceGrid) -> CellTables:
    """The tables of a grid; the last few grids are remembered."""
    # The last step begins at the outer border, so that everything beyond falls into it.
    steps_per_m = (STEPS - 2) / grid.range_m
    pseudo_angles = _pseudo_angles(grid.azimuth_edges_rad)
    sines = np.sin(grid.elevation_edges_rad)
    column = _table(pseudo_angles, -2.0, STEPS / 4.0, grid.rows)
    if BORDER in (column[0], column[-1]):  # straight behind, azimuth is both pi and -pi
        column[[0, -1]] = BORDER
    return CellTables(
        grid.edges,
        GridEdges(grid.range_edges_m, read_only(pseudo_angles), read_only(sines)),
        _table(grid.range_edges_m, 0.0, steps_per_m, grid.columns * grid.rows),
        column,
        _table(sines, -1.0, STEPS / 2.0, 1),
        steps_per_m,
        _cone(grid.azimuth_edges_rad, grid.elevation_edges_rad),
    )


def _cone(azimuth_rad: FloatArray, elevation_rad: FloatArray) -> FloatArray:
    right, left = azimuth_rad[0] - ABOUT_RAD, azimuth_rad[-1] + ABOUT_RAD
    sides = [-np.sin(right), np.cos(right), np.sin(left), -np.cos(left)]
    if left - right >= np.pi - ABOUT_RAD:
        sides = [0.0, 0.0, 0.0, 0.0]
    ends = np.array([elevation_rad[0] - ABOUT_RAD, elevation_rad[-1] + ABOUT_RAD])
    sines = np.sin(np.clip(ends, -0.5 * np.pi, 0.5 * np.pi))
    # Straight up and down rounding must leave nothing out.
    sines += np.array([-ABOUT_RAD, ABOUT_RAD]) * (np.abs(sines) > 1.0 - ABOUT_RAD)
    return read_only(np.array([*sides, *(sines * np.abs(sines))]))


def _pseudo_angles(azimuth_rad: FloatArray) -> FloatArray:
    """The stand-ins of azimuths, in [-2, 2]; `quick_column` computes the same from x and y."""
    x, y = np.cos(azimuth_rad), np.sin(azimuth_rad)
    forward = y / (np.abs(x) + np.abs(y))
    stand_ins: FloatArray = np.where(x >= 0.0, forward, np.copysign(2.0, azimuth_rad) - forward)
    return stand_ins


def _table(edges: FloatArray, low: float, steps_per_unit: float, stride: int) -> TableArray:
    """For every step from `low`: stride times the interval of ascending edges, or a mark."""
    starts = low + np.arange(STEPS) / steps_per_unit
    intervals = np.searchsorted(edges, starts, side="right") - 1
    table = np.where((intervals < 0) | (intervals >= len(edges) - 1), OUTSIDE, intervals * stride)
    # A stand-in changes no faster than its angle; twice the tolerance covers rounding too.
    for shift in (-2.0 * BORDER_TOLERANCE, 2.0 * BORDER_TOLERANCE):
        steps = np.floor((edges + shift - low) * steps_per_unit).astype(np.int64)
        table[np.clip(steps, 0, STEPS - 1)] = BORDER
    return np.ascontiguousarray(table, dtype=np.int32)


@compiled
def quick_column(x: float, y: float, sine: float, column: Int32s, row: Int32s) -> int:
    """Sum of the entries of a direction: column * rows + row, or a mark.

    Takes the two tables rather than `CellTables`: loops hoist them, which makes them five times
    as fast.
    """
    forward = y / (abs(x) + abs(y) + TINY)
    turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
    j = column[np.uint64(min((turned + 2.0) * (STEPS / 4.0), STEPS - 1.0))]
    k = row[np.uint64(max(min((sine + 1.0) * (STEPS / 2.0), STEPS - 1.0), 0.0))]
    entry: int = j + k
    return entry


@compiled
def cell_at_border(x: float, y: float, z: float, tables: CellTables) -> int:
    """Flat cell of a point whose steps hold a border; OUTSIDE if there is none.

    Nearly all are surely on one side of it, and need no arctangents.
    """
    distance = np.sqrt(x * x + y * y + z * z)
    forward = y / (abs(x) + abs(y) + TINY)
    turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
    ranges, azimuth, elevation = tables.stand_ins
    apart = 2.0 * max(BORDER_TOLERANCE, RANGE_TOLERANCE * ranges[len(ranges) - 1])
    i = _sure_interval(distance, ranges, apart)
    j = _sure_interval(turned, azimuth, apart)
    k = _sure_interval(z / (distance + TINY), elevation, apart)
    least = min(i, min(j, k))
    if least == UNSURE:
        cell = cell_of_point(x, y, z, tables.edges)
        return cell if cell >= 0 else OUTSIDE
    if least < 0:
        return OUTSIDE
    return (i * (len(azimuth) - 1) + j) * (len(elevation) - 1) + k


@compiled
def _sure_interval(stand_in: float, edges: Floats, apart: float) -> int:
    """Interval of ascending edges; -1 outside, UNSURE where it is no farther from an edge."""
    passed, near = 0, False
    for n in range(len(edges)):
        passed += stand_in > edges[n]
        near |= abs(stand_in - edges[n]) <= apart
    if near:
        return UNSURE
    return passed - 1 if passed < len(edges) else -1


@compiled
def exact_column(x: float, y: float, z: float, azimuth: Floats, elevation: Floats) -> int:
    """column * rows + row of a direction by the rule of `grid`; OUTSIDE if there is none."""
    j = interval_of(np.arctan2(y, x), azimuth)
    k = interval_of(np.arctan2(z, np.sqrt(x * x + y * y)), elevation)
    return j * (len(elevation) - 1) + k if j >= 0 and k >= 0 else OUTSIDE


@compiled
def beams_per_column(directions: Floats2, rotation: Floats2, tables: CellTables) -> Ints:
    """[columns * rows] beams through each column, |L| of (5.39), with the border rules of `grid`.

    directions: [beams, 3] unit vectors, sensor frame; rotation: [3, 3] grid from sensor.
    """
    column_table, row_table = tables.column, tables.row
    azimuth, elevation = tables.edges.azimuth_rad, tables.edges.elevation_rad
    columns = (len(azimuth) - 1) * (len(elevation) - 1)
    counts = np.zeros(columns + 1, dtype=np.int64)
    r = rotation
    r00, r01, r02 = r[0, 0], r[0, 1], r[0, 2]
    r10, r11, r12 = r[1, 0], r[1, 1], r[1, 2]
    r20, r21, r22 = r[2, 0], r[2, 1], r[2, 2]
    for n in range(len(directions)):
        a, b, c = directions[n, 0], directions[n, 1], directions[n, 2]
        x = r00 * a + r01 * b + r02 * c
        y = r10 * a + r11 * b + r12 * c
        z = r20 * a + r21 * b + r22 * c
        column = quick_column(x, y, z, column_table, row_table)
        if BORDER <= column < OUTSIDE:
            column = exact_column(x, y, z, azimuth, elevation)
        counts[min(column, columns)] += 1
    return counts[:columns]


@lru_cache(maxsize=32)
def _beams_of(grid: AvoidanceGrid, pattern: BeamPattern, rotation: bytes) -> IntArray:
    matrix = np.frombuffer(rotation, dtype=np.float64).reshape(3, 3)
    counts = beams_per_column(pattern.directions, matrix, cell_tables(grid))
    counts.setflags(write=False)
    return counts


def count_beams(
    grid: AvoidanceGrid, pattern: BeamPattern, grid_from_sensor: FloatArray
) -> IntArray:
    """[columns * rows] beams through each column; counted once per pattern and attitude."""
    return _beams_of(grid, pattern, grid_from_sensor.tobytes())
