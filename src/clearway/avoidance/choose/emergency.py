"""The emergency rule: where nothing keeps the margin, the complete trajectory that keeps most.

Looking at every movement would be slowest where most stands about. So a greedy way gives what can
be had, and no movement is looked at any more once its way there keeps less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.choose.candidates import Candidates
from clearway.avoidance.clear.hazards import Hazards, MovingHazards, PointBins
from clearway.avoidance.clear.verify import (
    KnownClearances,
    MovementRoom,
    Paths,
    movement_clearance,
    movement_room,
)
from clearway.base.arrays import Bools, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
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
    the clearance may be reported as any that does not, -inf too."""
    nodes = candidates.nodes
    asked = hazards, margin_m, nodes.tobytes()
    if asked not in looked.best:
        is_end = np.zeros(len(looked.paths.parent), dtype=np.bool_)
        is_end[nodes] = True
        known = looked.at(hazards, margin_m)
        looked.best[asked] = _best_clearances(
            looked.paths, hazards.bins, hazards.shapes, hazards.moving, margin_m, is_end, known
        )[nodes]
    return looked.best[asked]


class _Looks(NamedTuple):
    """What movements are checked against, and what is known of them."""

    paths: Paths
    bins: PointBins
    shapes: Shapes
    moving: MovingHazards
    margin_m: float
    is_end: Bools
    """[nodes] whether a candidate ends there."""
    known: Floats2
    """[nodes, 3] as of `KnownClearances.at`."""
    room: MovementRoom


@compiled
def _best_clearances(
    paths: Paths,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    is_end: Bools,
    known: Floats2,
) -> Floats2:
    room = movement_room(paths, shapes)
    looks = _Looks(paths, bins, shapes, moving, margin, is_end, known, room)
    result = np.empty((len(is_end), 2))
    _note_best(looks, _greedy(looks), result)
    return result


@compiled
def _coarse(clearance: float, margin: float) -> float:
    return float(np.rint(clearance / (ALIKE * margin)))


@compiled
def _measure_clearance(looks: _Looks, n: int, least: float) -> float:
    """Clearance of one movement up to the margin; below `least` only that it is below."""
    known, margin = looks.known, looks.margin_m
    if np.isnan(known[n, 0]):
        found = movement_clearance(
            looks.paths, n, looks.bins, looks.shapes, looks.moving, margin, least, looks.room
        )
        if found[0] < least:
            return float(found[0])
        known[n, 0], known[n, 1], known[n, 2] = found
    return float(min(known[n, 0], margin))


@compiled
def _greedy(looks: _Looks) -> float:
    """Coarse clearance that a candidate keeps: the best along always the best next movement."""
    best, at, here = -np.inf, -1, looks.margin_m
    while True:
        following, kept = -1, -np.inf
        for n in range(at + 1, len(looks.is_end)):
            if looks.paths.parent[n] == at:
                found = _measure_clearance(looks, n, kept)
                if min(here, found) > kept:
                    following, kept = n, min(here, found)
        if following < 0:
            return best
        at, here = following, kept
        if looks.is_end[at]:
            best = max(best, _coarse(here, looks.margin_m))


@compiled
def _note_best(looks: _Looks, best: float, result: Floats2) -> None:
    """Fill in [nodes, 2] clearance and lack along the way to each node, -inf below the best."""
    parent, margin = looks.paths.parent, looks.margin_m
    for n in range(len(looks.is_end)):
        before, lacking = margin, 0.0
        if parent[n] >= 0:
            before, lacking = result[parent[n], 0], result[parent[n], 1]
        result[n, 0], result[n, 1] = -np.inf, 0.0
        if _coarse(before, margin) < best:
            continue
        # Half a step below what still rounds to the best, so that rounding cannot matter.
        least = (best - 1.0) * ALIKE * margin
        distance = _measure_clearance(looks, n, least)
        if distance < least:
            continue
        result[n, 0] = min(before, distance)
        result[n, 1] = lacking + (margin - distance)
        if looks.is_end[n]:
            best = max(best, _coarse(result[n, 0], margin))
