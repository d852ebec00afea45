"""The hot loop of estimating footprints: random walks along one footprint.

A walk starts at one of a footprint's trajectory ends and takes movements at random, each as
likely, out of those that stay in its present cell or go on to the next one of a given way. Behind
the way's last cell it goes anywhere; where that is, is its outcome. Every trajectory along the way
has a chance, so an outcome has one if and only if some trajectory has that footprint.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats2, Int32s2, Ints, UInt64s
from clearway.base.compiled import compiled
from clearway.base.grid import GridEdges
from clearway.reach.compare.offspring import START_CELL
from clearway.reach.expand.lattice import LatticePieces
from clearway.reach.expand.trace import NEAR, OUT_BEYOND, end_place

LOST = -2
"""Outcome of a walk that cannot go on."""


class Along(NamedTuple):
    """Where walks start, and the cells that they follow."""

    state: Floats2
    """[n, 4] trajectory ends in the way's first cell, as in `offspring_of`."""
    place: Int32s2
    """[n, 2]"""
    way: Ints
    """[cells] one after the other."""
    deep: int
    pieces: LatticePieces
    rotation: Floats2
    edges: GridEdges


@compiled
def outcomes_of_walks(
    along: Along,
    walks: int,
    seed: int,
) -> Ints:
    """[cells + 1] how many walks end in each cell behind the way; the last is beyond the range."""
    found = np.zeros(_cells(along.edges) + 1, dtype=np.int64)
    draw = np.array([seed], dtype=np.uint64)
    order = np.arange(along.pieces.following.shape[1])
    for _ in range(walks):
        outcome = _walk(along, order, draw)
        if outcome != LOST:
            found[outcome] += 1
    return found


@compiled
def walks_until(
    along: Along,
    wanted: int,
    times: int,
    seed: int,
) -> int:
    """How many walks it takes until `times` of them have ended in a wanted cell."""
    draw = np.array([seed], dtype=np.uint64)
    order = np.arange(along.pieces.following.shape[1])
    walks = seen = 0
    while seen < times:
        walks += 1
        if _walk(along, order, draw) == wanted:
            seen += 1
    return walks


@compiled
def _walk(along: Along, order: Ints, draw: UInt64s) -> int:
    """Outcome of one walk: a cell, beyond the range, or LOST; `order` is any order of movements."""
    pieces, way = along.pieces, along.way
    last = pieces.path.shape[2] - 1
    n = _below(len(along.state), draw)
    x, y, z, yaw = along.state[n]
    at, depth, here = along.place[n, 0], along.place[n, 1], 0
    while depth < along.deep:
        depth += 1
        origin = (x, y, z, np.cos(yaw), np.sin(yaw))
        to = m = LOST
        # The first one open in a random order is any of the open ones with the same chance.
        for tried in range(len(order)):
            other = tried + _below(len(order) - tried, draw)
            order[tried], order[other] = order[other], order[tried]
            m = order[tried]
            if pieces.following[at, m] >= 0:
                end = end_place(origin, pieces.path[at, m, last:], along.rotation, along.edges)
                to = _onward(end, way, here, along.edges)
                if to != LOST:
                    break
        if to == LOST:
            return LOST
        if to != way[here]:
            here += 1
            if here == len(way):
                return int(to)
        offset = pieces.path[at, m, last]
        x += origin[3] * offset[0] - origin[4] * offset[1]
        y += origin[4] * offset[0] + origin[3] * offset[1]
        z += offset[2]
        yaw += pieces.turn_rad[at, m]
        at = pieces.following[at, m]
    return LOST


@compiled
def _onward(end: int, way: Ints, here: int, edges: GridEdges) -> int:
    """The cell that a movement leads to, `cells` beyond the range, or LOST off the way."""
    per_layer = (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    to = START_CELL if end == NEAR else end
    if end == OUT_BEYOND:
        to = _cells(edges)
    elif to < START_CELL or to // per_layer < way[here] // per_layer:
        return LOST
    on_the_way = to == way[here] or here + 1 == len(way) or to == way[here + 1]
    return to if on_the_way else LOST


@compiled
def _cells(edges: GridEdges) -> int:
    per_layer = (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    return (len(edges.range_m) - 1) * per_layer


@compiled
def _below(count: int, draw: UInt64s) -> int:
    """A random number from 0 to count - 1, by splitmix64."""
    draw[0] += np.uint64(0x9E3779B97F4A7C15)
    mixed = draw[0]
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed = mixed ^ (mixed >> np.uint64(31))
    return int((mixed >> np.uint64(11)) * (1.0 / 9007199254740992.0) * count)
