"""The receding-horizon problem (4.6): a stage cost of movements and a terminal cost to go.

Both are in metres of flight, so that cost weights mean the same at any speed and scale. A user
replaces either by a function of the same type.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from clearway.avoidance.rate.goal import Arrival, Goal
from clearway.base.arrays import Bools, Floats, Floats2, Int32s, Ints
from clearway.base.brief import brief
from clearway.base.checks import collect_problems, number_problem, take_floats
from clearway.base.compiled import compiled
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton

STEEPEST_PITCH_RAD = np.radians(60.0)
"""Climb assumed by the cost to go of an automaton without a pitch limit."""
SAME_PACE = 0.95
"""Share of the pace of straight flight above which a movement costs its length, not its time."""
SLIGHTEST_PITCH_RAD = 1e-6
"""Climbs less steep than it count as so steep: what is higher costs much, but never infinitely."""
OPEN = ("coated", "no_room", "risk", "miss", "other_side", "other_plan", "vertical", "off_level")
"""Prices that may be left open."""


@dataclass(frozen=True, slots=True)
class Prices:
    """Small costs beside the length flown, in metres of flight.

    Raises InputError naming every weight that is not a number from 0 to 1e9.

    >>> import clearway as cw
    >>> cw.Prices(risk=1.0)
    Prices(risk=1)
    """

    turn: float = 0.2
    """Per movement that is not smooth, as a share of its length."""
    change: float = 0.1
    """Per movement unlike the one before it, as a share of its length."""
    _: KW_ONLY
    vertical: float | None = None
    """Per metre of height changed. None for 0.15, and for 0.25 where the vehicle can stop: it rises
    as easily as it turns, and would do so only to shift its track."""
    risk: float | None = None
    """Per unit of -log P_R, in movement lengths: a safer trajectory may win at a higher cost. None
    for 0.5, and for 0 where the vehicle has inertia: its cells are too coarse for gaps that it
    verifies."""
    coated: float | None = None
    """For passing cells that the safety margin around evidence reaches into, in movement lengths:
    cells are coarse, so a verified path may, but need not. None for 3, and for 0 where the vehicle
    can stop: it would turn on the spot again and again to where other cells are free."""
    miss: float | None = None
    """For grazing the reach radius of the goal, in movement lengths; little well inside it. None
    for 2, and for 0.2 where the vehicle has inertia."""
    other_side: float | None = None
    """For passing on another side than the one committed to, in movement lengths. None for 4, and
    for 0.3 where the vehicle has inertia: it sees what is ahead earlier."""
    other_plan: float | None = None
    """For a first movement other than the last plan's, in movement lengths. None for 0.1, and for
    0.36 where the vehicle has inertia."""
    no_room: float | None = None
    """For a way without room to circle within its first movements, in movement lengths: what is
    entered without room to turn round may be a dead end. Of a vehicle with inertia, for one that
    ends without room to brake. None for 6, and for 12 where escapes may
    lead through unobserved space: those promise nothing."""
    off_level: float | None = None
    """For leaving the field of view above or below at once, in movement lengths; less the farther
    off. What it costs from there is a guess that knows no movements. None for 0; for 1 where the
    vehicle can stop, and for 1.5 where the field is not as high above the horizon as below:
    what leaves it soonest, down or up, is flown on and on else."""
    ahead: float = 0.0
    """For crossing ahead of an intruder, in movement lengths: above 0 passes behind (6.8)."""
    closing: float = 0.5
    """Per metre by which a way leads nearer to where an intruder is that turns or changes its
    speed, beyond straight away from it: a pursuer is run away from."""

    def __post_init__(self) -> None:
        keys = [key for key in self.__slots__ if getattr(self, key) is not None or key not in OPEN]
        problems = collect_problems(number_problem(key, getattr(self, key)) for key in keys)
        if problems:
            raise InputError("prices", problems)
        take_floats(self, Prices)

    __repr__ = brief

    def suit_vehicle(
        self,
        *,
        can_stop: bool,
        has_inertia: bool = False,
        unseen_is_free: bool = False,
        lopsided: bool = False,
    ) -> Prices:
        """Fill in the cost weights that are not given, as they suit a vehicle.

        Parameters
        ----------
        can_stop
            Whether the vehicle can stay where it is.
        has_inertia
            Whether it accelerates and brakes.
        unseen_is_free
            Whether its escapes may lead through unobserved space.
        lopsided
            Whether its field of view is not as high above the horizon as below.

        Returns
        -------
        Prices
            With a number for each weight.
        """
        starts_at_once = can_stop and not has_inertia
        suits = {
            "vertical": 0.25 if starts_at_once else 0.15,
            "off_level": 1.0 if starts_at_once else 1.5 if lopsided and not has_inertia else 0.0,
            "coated": 0.0 if can_stop else 3.0,
            "no_room": 12.0 if unseen_is_free else 6.0,
            "risk": 0.0 if has_inertia else 0.5,
            "miss": 0.2 if has_inertia else 2.0,
            "other_side": 0.3 if has_inertia else 4.0,
            "other_plan": 0.36 if has_inertia else 0.1,
        }
        missing: dict[str, Any] = {k: v for k, v in suits.items() if getattr(self, k) is None}
        return replace(self, **missing)


def price_of(price: float | None) -> float:
    """A cost weight that is not left open, which a planner's weights are not."""
    assert price is not None
    return price


Climbing = tuple[float, float]
"""What a metre of height costs besides the way flown, and a radian of turns on the way."""
StageCost = Callable[[ReachSet, Prices], FloatArray]
"""Cost [nodes] of each movement of a reach set, in metres; evaluated once per reach set."""


TerminalCost = Callable[[ReachSet, IntArray, Goal, Arrival, MovementAutomaton], FloatArray]
"""Cost to go [n] in metres from the ends of some nodes [n] of a reach set."""


def length_and_prices(reach_set: ReachSet, prices: Prices) -> FloatArray:
    """Length flown plus costs of turns, changes and height; the default stage cost.

    What is slower than straight flight, or stands, costs the length that could have been flown.
    """
    parent = reach_set.parent
    inner = parent >= 0
    start_length = np.where(inner, reach_set.length_m[parent], 0.0)
    length = reach_set.length_m - start_length
    smooth = np.array(reach_set.movement_smooth, dtype=np.bool_)[reach_set.movement]
    took_s = reach_set.end_time_s - np.where(inner, reach_set.end_time_s[parent], 0.0)
    straight = smooth | ~smooth.any()
    usual_m = took_s * float((length / took_s)[straight].max(initial=0.0))
    length = np.where(length < SAME_PACE * usual_m, usual_m, length)
    changed = inner & (reach_set.movement != reach_set.movement[parent])
    level_z = _level_heights(reach_set)
    climbed = np.abs(level_z - np.where(inner, level_z[parent], 0.0))
    cost: FloatArray = length * (1.0 + prices.turn * ~smooth + prices.change * changed)
    cost += price_of(prices.vertical) * climbed
    return cost


def _level_heights(reach_set: ReachSet) -> FloatArray:
    """[nodes] height of the ends in the level frame: the grid is pitched with the vehicle."""
    pitch = reach_set.start_pitch_rad
    x, z = reach_set.states[:, 0], reach_set.states[:, 2]
    return np.asarray(-np.sin(pitch) * x + np.cos(pitch) * z, dtype=np.float64)


def turning_distance_to_go(
    reach_set: ReachSet,
    nodes: IntArray,
    goal: Goal,
    arrived: Arrival,
    automaton: MovementAutomaton,
    prices: Prices | None = None,
) -> FloatArray:
    """Shortest turn-then-straight length to the goal and on to the next; the default terminal cost.

    Turning circles count, so a waypoint behind or inside the turning circle is flown away from
    first; a waypoint steeper than the pitch limit costs the spiral up to it. A vehicle that stays
    level goes by level distance. What can turn on the spot may do so first.

    prices: where given, what it turns and climbs yet costs as much as it will. For a vehicle that
    climbs only on its way ahead what is too steep also costs the turns that lead away from it and
    back: else to wait below would cost less than to climb, at every decision anew.
    """
    return cost_to_go(
        reach_set.states,
        reach_set.parent,
        reach_set.length_m,
        nodes,
        reach_set.start_pitch_rad,
        arrived.reached,
        goal,
        turns_and_climbs(automaton, prices),
    )


class TurnsAndClimbs(NamedTuple):
    """What the default cost to go asks of a vehicle."""

    radius_m: float
    """Of its tightest turns in flight."""
    m_per_rad: float
    """What these cost: more than their length where they are slow."""
    fast_radius_m: float
    """Of its tightest turns at full speed."""
    fast_m_per_rad: float
    pitching_m: float
    """Likewise, for turns of pitch; 0 where they cost nothing."""
    spot_m_per_rad: float
    """What a turn on the spot costs; inf where there is none."""
    stays_level: bool
    steepest_rad: float
    climbing: Climbing
    ahead_only: bool
    """Whether it climbs only on its way ahead."""
    height_price: float
    """Per metre of height that it has to change yet."""


def turns_and_climbs(automaton: MovementAutomaton, prices: Prices | None) -> TurnsAndClimbs:
    """prices: as of `turning_distance_to_go`."""
    steepest = automaton.steepest_rad
    radius = automaton.turning_radius_m
    climbs_level = automaton.keeps_attitude or automaton.classes is not None
    pitches = np.isfinite(radius) and not climbs_level
    ahead_only = prices is not None and automaton.climbs_ahead
    priced = prices if automaton.can_stop and not automaton.climbs_ahead else None
    dearer = None if priced is None else 1.0 + priced.turn
    return TurnsAndClimbs(
        *_arcs(automaton, dearer),
        float(radius) if pitches else 0.0,
        (dearer or 1.0) * float(automaton.spot_turn_m_per_rad),
        automaton.stays_level,
        STEEPEST_PITCH_RAD if steepest is None else max(steepest, SLIGHTEST_PITCH_RAD),
        _climbing(automaton, prices) if prices is not None and ahead_only else (0.0, 0.0),
        ahead_only,
        0.0 if priced is None else price_of(priced.vertical),
    )


def _arcs(automaton: MovementAutomaton, dearer: float | None) -> tuple[float, float, float, float]:
    """The radius and the cost of a radian, of the tightest turns and of those at full speed; their
    length alone where `dearer` is None."""
    radius, fastest = float(automaton.turning_radius_m), automaton.fastest_mps
    arcs = [
        (movement.speed_mps / movement.turn_rate_rps, fastest / movement.turn_rate_rps)
        for movement in automaton.movements
        if movement.speed_mps > 0.0 and movement.pitch_rate_rps == 0.0 and movement.yaw_rate_rps
    ]
    if dearer is None or automaton.classes is not None or not arcs:
        return radius, radius, radius, radius
    tight, fast = min(arcs), min(arcs, key=lambda arc: (arc[1] - arc[0], arc[0]))
    return tight[0], dearer * tight[1], fast[0], dearer * fast[1]


def _climbing(automaton: MovementAutomaton, prices: Prices) -> Climbing:
    """What a metre of height costs besides its length, and a radian of turns below a steep goal."""
    steepest = max(automaton.steepest_rad or 0.0, SLIGHTEST_PITCH_RAD)
    radian_m = min(automaton.turning_radius_m, automaton.spot_turn_m_per_rad)
    turns_m = radian_m if np.isfinite(radian_m) else 0.0
    return price_of(prices.vertical) + prices.turn / float(np.sin(steepest)), turns_m


@compiled
def _turn_then_straight(
    x: float, y: float, radius: float, per_radian: float, reach_radius: float, spot: float
) -> float:
    """Cost to (x, y) from the origin heading along x: an arc to one side, then straight.

    A target inside a turning circle, farther from its rim than the reach radius, is not reachable
    by an arc to that side; the arc to the other side is then the way (the shorter way of two arcs
    is left out: it ends nose first in the same place and costs at most half a circle less).
    per_radian: what a radian of the arc costs. spot: what one turned on the spot costs, inf if
    that can't be. What can't turn at all costs the straight way.
    """
    if radius <= 0.0 or (np.isinf(radius) and np.isinf(spot)):
        return float(np.hypot(x, y))
    best = np.inf
    if not np.isinf(spot):
        best = spot * abs(np.arctan2(y, x)) + np.hypot(x, y)
    if np.isinf(radius):
        return float(best)
    nearer = 1.0 if y > 0.0 else -1.0
    for side in (nearer, -nearer):
        across = side * y - radius
        from_center = np.hypot(x, across)
        if from_center < radius - 0.8 * reach_radius:
            continue
        straight = np.sqrt(max(0.0, from_center * from_center - radius * radius))
        if straight >= best:
            continue  # Whatever the arc before it.
        angle = np.arctan2(across, x) + np.arctan2(radius, straight)
        angle = angle % (2.0 * np.pi)
        if angle > 2.0 * np.pi - 1e-9:
            angle = 0.0
        best = min(best, per_radian * angle + straight)
    return float(best)


@compiled
def _climb_cost(
    ahead: float, left: float, turn: float, rise: float, steepest: float, climbing: Climbing
) -> float:
    """What a way to (ahead, left, rise) costs to who climbs only as it goes ahead.

    turn: what it takes to turn towards it. Where the straight way is too short for the climb, two
    sides of a triangle are as long as it takes: straight on and back, or away and back.
    """
    metre, radian = climbing
    away, price = np.hypot(ahead, left), metre * abs(rise)
    needed = abs(rise) / np.tan(steepest)
    if needed <= away:
        return float(np.sqrt(away * away + rise * rise) + turn + price)
    wide = np.arccos(away / needed)
    turned = abs(abs(np.arctan2(left, ahead)) - wide) + 2.0 * wide
    on = 0.5 * (needed * needed - away * away) / (needed - ahead)
    turned = min(turned, abs(np.arctan2(left, ahead - on)))
    return float(abs(rise) / np.sin(steepest) + price + radian * turned)


@compiled
def cost_to_go(
    states: Floats2,
    parent: Int32s,
    length_m: Floats,
    nodes: Ints,
    start_pitch: float,
    reached: Bools,
    to: Goal,
    able: TurnsAndClimbs,
) -> Floats:
    """[n] `turning_distance_to_go` from the ends of nodes [n]."""
    result = np.empty(len(nodes))
    target, following, reach_radius = to.target_m, to.next_m, to.reach_radius_m
    radius, pitching, spot = able.radius_m, able.pitching_m, able.spot_m_per_rad
    stays_level, ahead_only = able.stays_level, able.ahead_only
    steepest, climbing = able.steepest_rad, able.climbing
    cos_start, sin_start = np.cos(start_pitch), np.sin(start_pitch)
    sin_steepest, tan_steepest = np.sin(steepest), np.tan(steepest)
    leg = np.sqrt(np.sum((following - target) ** 2))
    if ahead_only and not stays_level:
        along = np.hypot(following[0] - target[0], following[1] - target[1])
        leg = _climb_cost(along, 0.0, 0.0, following[2] - target[2], steepest, climbing)
    for at, end in enumerate(nodes):
        n, back = end, 0.0
        while True:
            x = cos_start * states[n, 0] + sin_start * states[n, 2]
            z = -sin_start * states[n, 0] + cos_start * states[n, 2]
            goal = following if reached[n] else target
            dx, dy = goal[0] - x, goal[1] - states[n, 1]
            dz = 0.0 if stays_level else goal[2] - z
            cos_yaw, sin_yaw = np.cos(states[n, 5]), np.sin(states[n, 5])
            ahead, left = cos_yaw * dx + sin_yaw * dy, -sin_yaw * dx + cos_yaw * dy
            pitched = np.cos(states[n, 4])
            level = _turn_then_straight(
                ahead, left, radius * pitched, able.m_per_rad * pitched, reach_radius, spot
            )
            if able.fast_radius_m > radius:
                fast, per_rad = able.fast_radius_m, able.fast_m_per_rad
                level = min(
                    level, _turn_then_straight(ahead, left, fast, per_rad, reach_radius, spot)
                )
            away = np.hypot(dx, dy)
            steep = abs(dz) > (away if ahead_only else level) * tan_steepest
            if ahead_only:
                length = _climb_cost(ahead, left, level - away, dz, steepest, climbing) - back
            elif steep:
                length = abs(dz) / sin_steepest
            else:
                length = np.sqrt(level * level + dz * dz)
            wanted_pitch = -min(steepest, max(-steepest, np.arctan2(dz, level)))
            off = wanted_pitch - states[n, 4]
            length += able.height_price * abs(dz)
            if n == end:
                result[at] = length + 0.5 * pitching * off * off
            elif steep:
                result[at] = min(result[at], length)
            if not ahead_only or steep or parent[n] < 0 or reached[parent[n]] != reached[end]:
                break
            # Who has climbed enough may turn back before: it need not fly on to the end.
            n = parent[n]
            back = length_m[end] - length_m[n]
        if not reached[end]:
            result[at] += leg
    return result
