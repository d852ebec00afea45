"""Costs of a vehicle with inertia: time flown and time to go, in metres at its greatest speed.

A trajectory that ends fast towards the goal has less time to go than one that ends slowly or
sideways: what its velocity lacks has to be made up for by the acceleration that there is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.costs import Prices
from clearway.avoidance.rate.goal import Arrival, Goal
from clearway.avoidance.rate.route_field import PlacedRoute, time_to_go
from clearway.base.arrays import Bools, Floats, Floats2, Int32s, Ints
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.class_table import ClassTable

ARRIVAL_MPS = 0.8
"""Speed at which a vehicle may still come to its last goal: it brakes within the reach radius."""
TOO_SLOW = 0.35
TOO_FAST = 0.7
"""How much speed counts that is lacking at an end, and that is too much, beside what it takes to
turn. Lacking speed counts for less than it takes to gain: else a plan waits to start at its end."""
EFFORT_S = 0.15
"""Time that a movement's effort counts as, times the cost weight of turns."""
CLIMBING = 0.7
CHANGES_CLIMB = 1.0
TURNS = 0.5
CHANGES = 0.3
"""Effort of a movement that climbs, that changes its rate of climb, of its widest turn, and of one
unlike the movement before it."""
STEEP = 0.36
STEEP_S = 0.3
"""Slope from which a movement leads out of what most sensors see, and the time that it counts as
longer: a copter that rises as it starts has nothing seen about it to brake in."""
HEIGHT = 0.6
"""Share of the time that a height takes to climb that counts beside the time of the level way:
both can be flown at once, but a climb that is put off comes at the end. Of ways round too: what is
above and below was seen less well than what is ahead."""
LATE = 0.5
"""Weight of the mean over the ends of a chain's movements beside that of its end: of two that end
alike, the one that gets on first is better. What is put off is put off at every decision."""
LOOK_M = 1.0
LOOKS = 6
"""Metres between the places at which the way on is looked at, and how many there are."""
NO_WAY_S = 1e2
"""Added where no way is known: somewhere else there may be one."""
BRIEF_M = 1e3
"""Cost of every movement that a trajectory has less than others: a plan that what is around cuts
short is taken only where no longer one is clear."""


class SpeedAbilities(NamedTuple):
    """What the time to go asks of a vehicle."""

    speed_mps: Floats
    """[classes]"""
    fastest_mps: float
    acceleration_mps2: float
    climb_mps: float
    sink_mps: float
    turn_rps: float
    """On the spot."""


def speed_abilities(automaton: MovementAutomaton) -> SpeedAbilities:
    """Of a vehicle with inertia; raises ClearwayError for any other."""
    classes = automaton.classes
    if classes is None or not classes.has_speeds:
        raise ClearwayError("time to go: the vehicle has no classes of speed")
    lasts_s = automaton.movements[0].duration_s
    gained = np.where(
        classes.following >= 0,
        np.abs(classes.speed_mps[np.maximum(classes.following, 0)] - classes.speed_mps[:, None]),
        0.0,
    )
    turns = np.abs(classes.paths[classes.first, :, -1, 3]).max()
    slowest = 1e-3 * float(classes.speed_mps.max())
    return SpeedAbilities(
        classes.speed_mps,
        float(classes.speed_mps.max()),
        float(gained.max()) / lasts_s,
        max(float(classes.climb_mps.max()), slowest),
        max(float(-classes.climb_mps.min()), slowest),
        float(turns) / lasts_s,
    )


def time_flown_m(
    reach_set: ReachSet, prices: Prices, *, automaton: MovementAutomaton
) -> FloatArray:
    """Cost [nodes] of each movement: its time, and a little for its effort, as metres."""
    classes = automaton.classes
    assert classes is not None  # A planner asks this of vehicles with inertia only.
    end = classes.classes_at(reach_set.states[:, 3])
    inner = reach_set.parent >= 0
    before = np.where(inner, end[reach_set.parent], _root_class(reach_set, classes))
    turned = reach_set.states[:, 5] - np.where(inner, reach_set.states[reach_set.parent, 5], 0.0)
    climbs = classes.climb_mps[end]
    effort = CHANGES_CLIMB * (climbs != classes.climb_mps[before]) + CLIMBING * (climbs != 0.0)
    effort = effort + TURNS * np.abs(turned) / max(float(np.abs(turned).max()), 1e-9)
    effort = effort + CHANGES * (
        inner & (reach_set.movement != reach_set.movement[reach_set.parent])
    )
    took_s = reach_set.end_time_s - np.where(inner, reach_set.end_time_s[reach_set.parent], 0.0)
    ahead = np.maximum(classes.speed_mps[end], classes.speed_mps[before])
    steep = np.abs(climbs) > STEEP * ahead
    cost: FloatArray = automaton.fastest_mps * (
        took_s + EFFORT_S * prices.turn * effort + STEEP_S * steep
    )
    return cost


def _root_class(reach_set: ReachSet, classes: ClassTable) -> int:
    """The class that a reach set begins in: all its first movements lead from there."""
    roots = np.flatnonzero(reach_set.parent < 0)
    ends = classes.classes_at(reach_set.states[roots, 3])
    fits = np.all(classes.following[:, reach_set.movement[roots]] == ends, axis=1)
    return int(np.argmax(fits))


def time_to_go_m(
    reach_set: ReachSet,
    nodes: IntArray,
    goal: Goal,
    arrived: Arrival,
    automaton: MovementAutomaton,
) -> FloatArray:
    """Time to go [n] from the ends of nodes [n], in metres at the greatest speed."""
    able = speed_abilities(automaton)
    classes = automaton.classes
    assert classes is not None
    every, states = np.arange(reach_set.nodes), reach_set.states
    at, route = classes.classes_at(states[:, 3]), arrived.route
    if route is None:
        left_s = _time_to_go(states, every, at, arrived.reached, goal, able)
    else:
        left_s = _time_by_route(states, every, at, arrived.reached, goal, able, route)
    to_go_s = left_s[nodes] + LATE * _lateness(
        reach_set.parent, reach_set.end_time_s + left_s, nodes
    )
    brief = (reach_set.depth.max() - reach_set.depth[nodes]).astype(np.float64)
    # What was planned a movement ago goes on, if nothing is better.
    brief[(nodes == arrived.planned) & (brief == 1.0)] = 0.0
    cost: FloatArray = able.fastest_mps * to_go_s + BRIEF_M * brief
    return cost


@compiled
def _lateness(parent: Int32s, total: Floats, nodes: Ints) -> Floats:
    """[n] by how much the whole time is longer by what is known at the ends of the movements on the
    way to a node [n] than at its end; total: [nodes] time flown and to go."""
    result = np.zeros(len(nodes))
    for n in range(len(nodes)):
        on, count, more = parent[nodes[n]], 0, 0.0
        while on >= 0:
            more += max(total[on] - total[nodes[n]], 0.0)
            count += 1
            on = parent[on]
        if count > 0:
            result[n] = more / count
    return result


@compiled
def _time_to_go(
    states: Floats2, nodes: Ints, at: Ints, reached: Bools, to: Goal, able: SpeedAbilities
) -> Floats:
    """[n] seconds; at: [n] classes."""
    result = np.empty(len(nodes))
    target, following, most = to.target_m, to.next_m, able.acceleration_mps2
    leg = np.hypot(following[0] - target[0], following[1] - target[1]) / able.fastest_mps
    for n in range(len(nodes)):
        node, speed = nodes[n], able.speed_mps[at[n]]
        goal = following if reached[node] else target
        dx, dy = goal[0] - states[node, 0], goal[1] - states[node, 1]
        dz = goal[2] - states[node, 2]
        away, yaw = np.hypot(dx, dy), states[node, 5]
        wanted = able.fastest_mps
        seconds = away / able.fastest_mps
        if to.final:
            wanted = min(wanted, np.sqrt(2.0 * most * away) + ARRIVAL_MPS)
            seconds = _time_to_brake(away, most, able.fastest_mps)
        bearing = np.arctan2(dy, dx) if away > 1e-6 else yaw
        off = (bearing - yaw + np.pi) % (2.0 * np.pi) - np.pi
        seconds += _time_to_turn(speed, off, wanted, able)
        climb = able.climb_mps if dz > 0.0 else able.sink_mps
        rise_s = abs(dz) / climb
        seconds += HEIGHT * rise_s + max(0.0, (1.0 - HEIGHT) * rise_s - seconds)
        if not reached[node]:
            seconds += leg
        result[n] = seconds
    return result


@compiled
def _time_to_turn(speed: float, off: float, wanted: float, able: SpeedAbilities) -> float:
    """What it costs to have a speed off the way on by an angle, where another speed is wanted."""
    most = able.acceleration_mps2
    ahead = speed * np.cos(off)
    lateral2 = speed * speed - ahead * ahead
    lacks = TOO_SLOW * (wanted - ahead) if wanted > ahead else TOO_FAST * (ahead - wanted)
    # Slowly, the nose turns no faster than on the spot.
    slow = max(0.0, 1.0 - speed * able.turn_rps / most)
    return float(
        (lacks * lacks + lateral2) / (2.0 * most * wanted) + slow * abs(off) / able.turn_rps
    )


@compiled
def _time_by_route(
    states: Floats2,
    nodes: Ints,
    at: Ints,
    reached: Bools,
    to: Goal,
    able: SpeedAbilities,
    route: PlacedRoute,
) -> Floats:
    """[n] as `_time_to_go`, round what is known."""
    result = _time_to_go(states, nodes, at, reached, to, able)
    target, following = to.target_m, to.next_m
    leg = np.hypot(following[0] - target[0], following[1] - target[1]) / able.fastest_mps
    cosine, sine = np.cos(route.yaw_rad), np.sin(route.yaw_rad)
    for n in range(len(nodes)):
        node = nodes[n]
        if reached[node]:
            continue
        x, y, z = states[node, 0], states[node, 1], states[node, 2]
        there = (
            route.origin_m[0] + cosine * x - sine * y,
            route.origin_m[1] + sine * x + cosine * y,
            route.origin_m[2] + z,
        )
        seconds, dx, dy, _, wanted = time_to_go(route.field, there[0], there[1], there[2])
        if seconds == np.inf:
            result[n] += NO_WAY_S
            continue
        away = np.hypot(target[0] - x, target[1] - y)
        wanted = max(_speed_ahead(route, there, (dx, dy), wanted, able), ARRIVAL_MPS)
        if to.final:
            wanted = min(wanted, np.sqrt(2.0 * able.acceleration_mps2 * away) + ARRIVAL_MPS)
        yaw = states[node, 5] + route.yaw_rad
        bearing = np.arctan2(dy, dx) if dx != 0.0 or dy != 0.0 else yaw
        off = (bearing - yaw + np.pi) % (2.0 * np.pi) - np.pi
        climb = able.climb_mps if target[2] > z else able.sink_mps
        seconds += HEIGHT * abs(target[2] - z) / climb
        result[n] = seconds + leg + _time_to_turn(able.speed_mps[at[n]], off, wanted, able)
    return result


@compiled
def _speed_ahead(
    route: PlacedRoute,
    at: tuple[float, float, float],
    along: tuple[float, float],
    wanted: float,
    able: SpeedAbilities,
) -> float:
    """The speed on the way on from a place, from which the vehicle can still be slow enough where
    the way is narrow."""
    x, y, most = at[0], at[1], able.acceleration_mps2
    dx, dy, flown, limit = along[0], along[1], 0.0, wanted
    step = LOOK_M
    while flown < LOOKS * LOOK_M and 2.0 * most * flown < wanted * wanted:
        x, y, flown = x + step * dx, y + step * dy, flown + step
        seconds, dx, dy, _, speed = time_to_go(route.field, x, y, at[2])
        if seconds == np.inf or (dx == 0.0 and dy == 0.0):
            break
        limit = min(limit, np.sqrt(speed * speed + 2.0 * most * flown))
    return float(limit)


@compiled
def _time_to_brake(away: float, most: float, fastest: float) -> float:
    """Time for a way at whose end the vehicle is slow.

    The speed at a distance s from the end is the square root of 2 a s, plus a slowest one.
    """
    slowest = ARRIVAL_MPS
    braking = max(0.0, fastest - slowest)
    near = min(away, braking * braking / (2.0 * most))
    gained = np.sqrt(2.0 * most * near)
    return float(
        (gained - slowest * np.log(1.0 + gained / slowest)) / most + (away - near) / fastest
    )
