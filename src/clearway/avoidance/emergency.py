"""The emergency rule: where nothing keeps the margin, the complete trajectory that keeps most.

Looking at every movement would be slowest where most stands about. So a greedy way gives what can
be had, and no movement is looked at any more once its way there keeps less.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.candidates import Candidates
from clearway.avoidance.hazards import Hazards, MovingHazards, PointBins
from clearway.avoidance.verify import (
    KnownClearances,
    MovementRoom,
    Paths,
    movement_clearance,
    movement_room,
)
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.obstacles.obstacle import Shapes

EMERGENCY_MARGINS = (0.75, 0.5, 0.25, 0.0)
"""Shares of the margin that the emergency rule steps down through."""
ALIKE = 0.01
"""Clearances that round to the same multiple of this share of the margin are alike."""


def emergency(
    looked: KnownClearances, candidates: Candidates, hazards: Hazards, margin_m: float
) -> tuple[int, float]:
    """Candidate with the best clearance, and the stepped-down margin that it keeps.

    Where all are alike (the start itself is too near), the one that lacks least on its way, then
    the cheapest.
    """
    found = best_clearances(looked, candidates, hazards, margin_m)
    coarse = np.round(found[:, 0] / (ALIKE * margin_m))
    best = int(np.lexsort((candidates.cost_m, found[:, 1], -coarse))[0])
    kept = found[best, 0] / margin_m
    return best, margin_m * next((share for share in EMERGENCY_MARGINS if kept >= share), 0.0)


def best_clearances(
    looked: KnownClearances, candidates: Candidates, hazards: Hazards, margin_m: float
) -> FloatArray:
    """[candidates, 2] as `verify.clearances` of those whose clearance rounds to the best; of others
    the clearance may be told as any that does not, -inf too."""
    nodes = candidates.nodes
    asked = id(hazards), margin_m, nodes.tobytes()
    if asked not in looked.best:
        is_end = np.zeros(len(looked.paths.parent), dtype=np.bool_)
        is_end[nodes] = True
        known = looked.at(hazards, margin_m)
        looked.best[asked] = _best_clearances(
            looked.paths, hazards.bins, hazards.shapes, hazards.moving, margin_m, is_end, known
        )[nodes]
    return looked.best[asked]


@compiled
def _best_clearances(
    paths: Paths,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    is_end: BoolArray,
    known: FloatArray,
) -> FloatArray:
    result, room = np.empty((len(is_end), 2)), movement_room(paths)
    best = _greedy(paths, bins, shapes, moving, margin, is_end, known, room)
    _note_best(paths, bins, shapes, moving, margin, is_end, known, room, best, result)
    return result


@borrowing
def _coarse(clearance: float, margin: float) -> float:
    return float(np.rint(clearance / (ALIKE * margin)))


@borrowing
def _looked_at(
    paths: Paths,
    n: int,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    least: float,
    known: FloatArray,
    room: MovementRoom,
) -> float:
    """Clearance of one movement up to the margin; below `least` only that it is below."""
    if np.isnan(known[n, 0]):
        found = movement_clearance(paths, n, bins, shapes, moving, margin, least, room)
        if found[0] < least:
            return float(found[0])
        known[n, 0], known[n, 1], known[n, 2] = found
    return float(min(known[n, 0], margin))


@borrowing
def _greedy(
    paths: Paths,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    is_end: BoolArray,
    known: FloatArray,
    room: MovementRoom,
) -> float:
    """Coarse clearance that a candidate keeps: the best along always the best next movement."""
    best, at, here = -np.inf, -1, margin
    while True:
        following, kept = -1, -np.inf
        for n in range(at + 1, len(is_end)):
            if paths.parent[n] == at:
                found = _looked_at(paths, n, bins, shapes, moving, margin, kept, known, room)
                if min(here, found) > kept:
                    following, kept = n, min(here, found)
        if following < 0:
            return best
        at, here = following, kept
        if is_end[at]:
            best = max(best, _coarse(here, margin))


@borrowing
def _note_best(
    paths: Paths,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    is_end: BoolArray,
    known: FloatArray,
    room: MovementRoom,
    best: float,
    result: FloatArray,
) -> None:
    """Fill in [nodes, 2] clearance and lack along the way to each node, -inf below the best."""
    for n in range(len(is_end)):
        before, lacking = margin, 0.0
        if paths.parent[n] >= 0:
            before, lacking = result[paths.parent[n], 0], result[paths.parent[n], 1]
        result[n, 0], result[n, 1] = -np.inf, 0.0
        if _coarse(before, margin) < best:
            continue
        # Half a step below what still rounds to the best, so that rounding cannot matter.
        least = (best - 1.0) * ALIKE * margin
        distance = _looked_at(paths, n, bins, shapes, moving, margin, least, known, room)
        if distance < least:
            continue
        result[n, 0] = min(before, distance)
        result[n, 1] = lacking + (margin - distance)
        if is_end[n]:
            best = max(best, _coarse(result[n, 0], margin))
