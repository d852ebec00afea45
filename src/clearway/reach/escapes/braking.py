"""Escapes of a vehicle with inertia: chains that brake to rest, straight or in turns, then hold.

The straightest one comes first, since it needs the least space; those that turn or climb while
they brake lead past what is ahead.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np

from clearway.base.frames import FloatArray
from clearway.reach.escapes.legs import Legs, pose_on
from clearway.reach.escapes.ways import Ways
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.copter import HOLD

TURNING = (0, 1, 2, 3, 5)
"""Movements that turn at the beginning of a chain, while they brake by half."""
STOPS_TURNING = (2, 5)
"""Likewise, of the level ways to brake that trajectories end with."""
LONGEST_STOP = 60
"""Movements within which every class comes to rest."""
SHARES = ("-Half", "")
"""Of the turn that is possible."""
CLIMBS = (("", 0.0), ("Up", 1.0), ("Down", -1.0))
"""Rate of climb during the beginning: its name and its sign."""


def braking_ways(classes: ClassTable, start: int) -> Ways:
    """Escapes from a class of motion, each chain once."""
    number = {name: n for n, name in enumerate(classes.names)}
    rest = classes.first
    tree: list[tuple[int, int, int]] = [(-1, -1, start)]
    known: dict[tuple[int, int], int] = {}
    ends: dict[int, None] = {}
    for climb, turning, share, side in product(CLIMBS, TURNING, SHARES, ("Left", "Right")):
        at, node, flown = start, 0, 0
        turn = f"{side}{share}"
        while at != rest:
            turned = turn if flown < turning else ""
            movement = _brake(classes, number, at, turned, climb, flown <= turning)
            if movement < 0:
                break
            key = (node, movement)
            at = int(classes.following[at, movement])
            if key not in known:
                known[key] = len(tree)
                tree.append((node, movement, at))
            node, flown = known[key], flown + 1
        if at == rest:
            ends[node] = None
    count = len(ends)
    parent, movement, attitude = np.array(tree, dtype=np.int64).T
    return Ways(
        np.ascontiguousarray(parent),
        np.ascontiguousarray(movement),
        np.ascontiguousarray(attitude),
        np.array(list(ends), dtype=np.int64),
        np.zeros(count, dtype=np.int64),
        np.array([rest], dtype=np.int64),
        np.array([0, 1], dtype=np.int64),
        np.array([number[HOLD]], dtype=np.int64),
    )


def _brake(
    classes: ClassTable,
    number: dict[str, int],
    at: int,
    turn: str,
    climb: tuple[str, float],
    is_beginning: bool,
) -> int:
    """The movement that brakes: by half where it turns, else with all there is; -1 for none."""
    name, sign = climb
    wanted = (name,) if is_beginning and sign else ("",)
    # A climb begins and ends by way of level flight.
    ways_up = (*wanted, "") if is_beginning else ("",)
    brakes = ("Brake-Half",) if turn else ("Brake", "Brake-Half", "Keep")
    for brake, up in product(brakes, ways_up):
        for turned in (turn, "") if turn else ("",):
            full = "-".join(part for part in (brake, turned, up) if part)
            movement = number.get(full, -1)
            if movement >= 0 and classes.following[at, movement] >= 0:
                return movement
    return number["Brake-Half"] if classes.following[at, number["Brake-Half"]] >= 0 else -1


@lru_cache(maxsize=2)
def stopping_ways(classes: ClassTable) -> FloatArray:
    """Return level ways to brake from every class: straight on, and in turns.

    Returns
    -------
    array [classes, ways, samples, 3]
        Metres, level axes along the heading at the start; the straight one first. Those that end
        sooner stay where they end.
    """
    number = {name: n for n, name in enumerate(classes.names)}
    turns = [("", 0), *((side, count) for count in STOPS_TURNING for side in ("Left", "Right"))]
    ways = [
        [_stopping_way(classes, number, at, turn, count) for turn, count in turns]
        for at in range(len(classes.classes))
    ]
    longest = max(len(way) for each in ways for way in each)
    result = np.zeros((len(ways), len(turns), longest, 3))
    for at, each in enumerate(ways):
        for n, way in enumerate(each):
            result[at, n, : len(way)] = way
            result[at, n, len(way) :] = way[-1]
    return result


def _stopping_way(
    classes: ClassTable, number: dict[str, int], at: int, turn: str, turning: int
) -> FloatArray:
    """[samples, 3] of one chain."""
    pose, places = np.zeros(4), [np.zeros(3)]
    flown, half = 0, classes.paths.shape[2] // 2
    while at != classes.first and flown < LONGEST_STOP:
        movement = _brake(classes, number, at, turn if flown < turning else "", ("", 0.0), False)
        if movement < 0:
            break
        path = classes.paths[at, movement]
        places += [pose_on(pose, path[half - 1])[:3], pose_on(pose, path[-1])[:3]]
        pose = pose_on(pose, path[-1])
        at, flown = int(classes.following[at, movement]), flown + 1
    return np.array(places[1:] or places)


def measure_reach(ways: Ways, legs: Legs) -> float:
    """How far (m) any of them leads from where it begins."""
    poses: list[FloatArray] = []
    farthest = 0.0
    for parent, movement in zip(ways.parent.tolist(), ways.movement.tolist(), strict=True):
        if parent < 0:
            poses.append(np.zeros(4))
            continue
        at = int(ways.attitude[parent])
        poses.append(pose_on(poses[parent], legs.path[at, movement, -1]))
        farthest = max(farthest, float(np.linalg.norm(poses[-1][:3])))
    return farthest
