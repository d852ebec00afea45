"""A copter with inertia: movements that accelerate, keep their speed and brake, as a lattice.

Its classes of motion are speeds ahead, equally far apart, each with a rate of climb: level, up or
down. A movement takes the copter from one class to a near one in a fixed time, and turns its course
meanwhile as far as the acceleration that is left allows. Speed, rate of climb and course are
continuous wherever one movement follows another. The nose points where the copter flies; at rest it
turns on the spot.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from clearway.base.checks import above_zero_problem, collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.movement import Movement

SHORTEST_S = 0.4
LONGEST_S = 1.0
"""Bounds of a movement's time."""
SPEEDS = 12
"""Steps from rest to the greatest speed, where the bounds of a movement's time allow so few."""
STEPS = 8
"""Positions kept of a movement."""
FINE = 20
"""Parts of each of them by which ways are integrated."""
WIDEST_TURN_RAD = np.radians(100.0)
"""Of one movement: more would leave the cells and the view that it was rated by."""
LEAST_LATERAL = 0.3
"""Share of the acceleration below which what is left of it turns nothing."""
SPEED_STEPS = {"Brake": -2, "Brake-Half": -1, "Keep": 0, "Accelerate-Half": 1, "Accelerate": 2}
"""Change of the speed in steps, by name: two steps take the whole acceleration."""
TURNS = {"": 0.0, "Left": 1.0, "Left-Half": 0.5, "Right-Half": -0.5, "Right": -1.0}
"""Share of the turn that the acceleration allows, by name."""
SLIGHT_TURNS = {"Left-Slight": 0.2, "Right-Slight": -0.2}
"""Of what turns on the spot, besides: a way between two trees asks for one course."""
SLIGHT = frozenset(SLIGHT_TURNS.values())
CLIMBS = {"Down": -1, "": 0, "Up": 1}
"""Rate of climb at the end of a movement, by name."""
CLIMB_SHARE = 0.8
"""Of the acceleration that begins or ends a climb within one movement: the rest changes speed and
course beside it."""
HOLD = "Hold"
TUBE_M = 0.03
"""Tube of a copter that is led by velocity and acceleration, at rest in still air."""
TUBE_PER_LAG = 1.4
"""Tube per acceleration times the square of the lag: what a tilt that takes time leaves."""
TUBE_PER_GUST_S = 0.07
"""Tube per m/s of gusts, at rest."""
TUBE_AT_SPEED_M = 0.1
TUBE_AT_SPEED_PER_GUST_S = 0.13
"""More of it at the greatest speed, in still air and per m/s of gusts: drag and lift that its loops
do not know."""
SLOW_MPS = 10.0
"""A copter that is slower than this has less drag at its greatest speed, and less more of it."""


@dataclass(frozen=True, slots=True)
class CopterLimits:
    """What a copter can do.

    Raises InputError naming every value that is out of range.

    >>> from clearway.vehicle.copter import CopterLimits
    >>> CopterLimits(speed_mps=10.0).acceleration_mps2
    3.0
    """

    speed_mps: float
    """Greatest speed ahead."""
    acceleration_mps2: float = 3.0
    """Greatest acceleration in any direction; braking takes no more."""
    climb_mps: float = 2.0
    sink_mps: float = 1.5
    yaw_rate_deg_s: float = 90.0
    lag_s: float = 0.1
    """How long an acceleration takes to come about, for the most part: a tilt."""
    gusts_mps: float = 1.0
    """Standard deviation of gusts in which it keeps within its tube."""

    def tube_m(self, speed_mps: FloatArray) -> FloatArray:
        """Within how far of its plan the copter is 99 % of the time, by its speeds [n]."""
        at_rest = TUBE_M + TUBE_PER_LAG * self.acceleration_mps2 * self.lag_s**2
        at_rest += TUBE_PER_GUST_S * self.gusts_mps
        more = TUBE_AT_SPEED_M + TUBE_AT_SPEED_PER_GUST_S * self.gusts_mps
        tube: FloatArray = at_rest + more * speed_mps / max(self.speed_mps, SLOW_MPS)
        return tube

    def __post_init__(self) -> None:
        positive = ("speed_mps", "acceleration_mps2", "yaw_rate_deg_s")
        zero = ("climb_mps", "sink_mps", "lag_s", "gusts_mps")
        problems = collect_problems(
            (
                *(above_zero_problem(key, getattr(self, key)) for key in positive),
                *(number_problem(key, getattr(self, key)) for key in zero),
            )
        )
        if problems:
            raise InputError("copter", problems)


class _Lattice:
    """Speeds, rates of climb and ways of a copter."""

    def __init__(self, limits: CopterLimits) -> None:
        self.limits = limits
        speed, most = limits.speed_mps, limits.acceleration_mps2
        self.lasts_s = float(np.clip(2.0 * speed / (SPEEDS * most), SHORTEST_S, LONGEST_S))
        count = max(2, int(np.ceil(2.0 * speed / (most * self.lasts_s) - 1e-9)))
        self.speeds = np.linspace(0.0, speed, count + 1)
        fastest = CLIMB_SHARE * most * self.lasts_s  # From level to a climb within one movement.
        up, down = min(limits.climb_mps, fastest), min(limits.sink_mps, fastest)
        self.climbs = np.array([-down, 0.0, up])

    @cached_property
    def asked(self) -> list[tuple[str, int, float, int]]:
        """(name, change of speed in steps, share of the turn, climb at the end) of movements."""
        listed = []
        for speed_name, steps in SPEED_STEPS.items():
            for turn_name, turn in TURNS.items():
                for climb_name, climb in CLIMBS.items():
                    name = "-".join(part for part in (speed_name, turn_name, climb_name) if part)
                    listed.append((name, steps, turn, climb))
        return listed + [(f"Keep-{name}", 0, turn, 0) for name, turn in SLIGHT_TURNS.items()]

    def class_of(self, speed: int, climb: int) -> int:
        """The class of a number of speed and a climb -1, 0 or 1."""
        return 3 * speed + climb % 3

    def lateral_mps2(self, begin: tuple[int, int], end: tuple[int, int]) -> float | None:
        """What is left of the acceleration between two (speed, climb) classes; None where they are
        too far apart."""
        ahead = float(self.speeds[end[0]] - self.speeds[begin[0]]) / self.lasts_s
        up = float(self.climbs[end[1] + 1] - self.climbs[begin[1] + 1]) / self.lasts_s
        left = self.limits.acceleration_mps2**2 - ahead**2 - up**2
        return float(np.sqrt(max(left, 0.0))) if left > -1e-9 else None

    def turn_rad(self, begin: int, end: int, share: float, lateral: float) -> float | None:
        """Turn of a movement between two speeds; None where none is possible."""
        if share == 0.0:
            return 0.0
        most, lasts_s = self.limits.acceleration_mps2, self.lasts_s
        by_yaw = float(np.radians(self.limits.yaw_rate_deg_s)) * lasts_s
        fastest = float(max(self.speeds[begin], self.speeds[end]))
        if fastest == 0.0:
            return share * float(min(by_yaw, WIDEST_TURN_RAD))
        if lateral < LEAST_LATERAL * most or begin == 0:
            return None  # Who starts looks where it flies.
        return share * float(min(lateral * lasts_s / fastest, by_yaw, WIDEST_TURN_RAD))

    def way(self, begin: tuple[int, int], end: tuple[int, int], turn_rad: float) -> FloatArray:
        """[STEPS, 4] between (speed, climb) classes: both change evenly with time, as the course
        does."""
        share = np.linspace(0.0, 1.0, STEPS * FINE + 1)
        time = self.lasts_s * share
        speed = self.speeds[begin[0]] + (self.speeds[end[0]] - self.speeds[begin[0]]) * share
        first, last = self.climbs[begin[1] + 1], self.climbs[end[1] + 1]
        z = first * time + 0.5 * (last - first) * time * share
        yaw = turn_rad * share
        x, y = (_integrate(speed * along, time) for along in (np.cos(yaw), np.sin(yaw)))
        return np.stack([x, y, z, yaw], axis=1)[FINE::FINE]

    def ways(self) -> Iterator[tuple[int, str, FloatArray, int]]:
        """(class, name, way, class at the end) of every movement from every class."""
        for begin in range(len(self.speeds)):
            for climb in CLIMBS.values():
                at = self.class_of(begin, climb)
                for name, steps, share, then in self.asked:
                    end = begin + steps
                    if not 0 <= end < len(self.speeds) or abs(then - climb) > 1:
                        continue
                    if begin > 0 and share in SLIGHT:
                        continue
                    lateral = self.lateral_mps2((begin, climb), (end, then))
                    if lateral is None:
                        continue
                    turn = self.turn_rad(begin, end, share, lateral)
                    if turn is None or (self.climbs[then + 1] == 0.0 and then != 0):
                        continue
                    way = self.way((begin, climb), (end, then), turn)
                    is_hold = at == self.class_of(end, then) and not way.any()
                    yield at, HOLD if is_hold else name, way, self.class_of(end, then)

    @property
    def class_names(self) -> tuple[str, ...]:
        climbs = {-1: " down", 0: "", 1: " up"}
        return tuple(
            f"{speed:.3g} m/s{climbs[climb]}" for speed in self.speeds for climb in (0, 1, -1)
        )


@lru_cache(maxsize=8)
def build_copter(limits: CopterLimits) -> tuple[tuple[Movement, ...], ClassTable]:
    """Movements of a copter with inertia, and what they do in every class of motion.

    Examples
    --------
    >>> from clearway.vehicle.copter import CopterLimits, build_copter
    >>> movements, classes = build_copter(CopterLimits(speed_mps=5.0))
    >>> len(movements), classes.speed_mps.max()
    (78, 5.0)
    """
    lattice = _Lattice(limits)
    names = (HOLD, *(name for name, *_ in lattice.asked))
    number = {name: n for n, name in enumerate(names)}
    classes = lattice.class_names
    paths = np.zeros((len(classes), len(names), STEPS, 4))
    following = np.full((len(classes), len(names)), -1, dtype=np.int64)
    for at, name, way, end in lattice.ways():
        paths[at, number[name]], following[at, number[name]] = way, end
    speeds = np.repeat(lattice.speeds, 3)
    table = ClassTable(
        names,
        classes,
        paths,
        following,
        lattice.class_of(0, 0),
        class_tube_m=limits.tube_m(speeds),
        speed_mps=speeds,
        climb_mps=np.tile(lattice.climbs[[1, 2, 0]], len(lattice.speeds)),
    )
    movements = tuple(_movement(lattice, name, table) for name in names)
    return movements, table


def _movement(lattice: _Lattice, name: str, table: ClassTable) -> Movement:
    """What a movement is called and how long it takes; what it does depends on the class."""
    turned = table.paths[table.first, table.names.index(name), -1, 3]
    return Movement(
        name,
        0.0 if name == HOLD else lattice.limits.speed_mps,
        yaw_rate_rps=float(turned) / lattice.lasts_s,
        duration_s=lattice.lasts_s,
        smooth=name in ("Keep", "Accelerate", "Brake"),
        climb_mps=0.0,
    )


def _integrate(values: FloatArray, time: FloatArray) -> FloatArray:
    """[n] integral from the start on, by trapezoids."""
    parts = 0.5 * (values[1:] + values[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(parts)])
