"""How the time of a decision grows with what is around: returns, balls, shapes, intruders, nodes.

Each row takes one thing in four sizes and leaves the rest as it is; it tells the power by which
time grows over the three largest: 1 is linear.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.decisions import seen_from, standing, static_mission
from benchmarks.intruders import at_random
from benchmarks.scenes import mixed_shapes, street
from benchmarks.table import Benchmark, Row, Target
from benchmarks.timing import in_words, timed
from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton

LINEAR = 1.15
"""Power up to which growth counts as linear: small parts of the work do not grow at all."""
BEAMS = {9_800: (20, 14), 29_400: (30, 28), 100_800: (80, 36), 294_000: (140, 60)}
"""Azimuths and elevations per column of cells, by beams in all."""
SPREADS = (1.0, 2.0, 4.0, 8.0)
"""Trajectories that the chaotic method keeps in a cell."""
HERE, AHEAD_M = State(np.zeros(3)), np.array([100.0, 0.0, 0.0])
Decide = Callable[[], object]


def grown(
    things: str, sizes: Sequence[int], make: Callable[[int], tuple[int, Decide]]
) -> Callable[[bool], Row]:
    """make: of a size, how many of the things there are and what decides among them."""

    def measure(quick: bool) -> Row:
        made = [make(size) for size in sizes]
        times = [timed(run, quick, seconds=0.8) for _, run in made]
        counts = [count for count, _ in made]
        medians_s = [each.median_s for each in times]
        power = float(np.polyfit(np.log(counts[-3:]), np.log(medians_s[-3:]), 1)[0])
        told = ", ".join(f"{count:,}" for count in counts)
        return Row(
            f"a decision with {told} {things}, escape off",
            ", ".join(in_words(each.median_s) for each in times),
            f"grows by the power {power:.2f}",
            Target("no more than linear", power <= LINEAR),
            measured=power,
            cpu=", ".join(in_words(each.cpu_s or 0.0) for each in times),
        )

    return measure


def by_returns(size: int) -> tuple[int, Decide]:
    """Of a street, seen to 100 m."""
    setup = static_mission(beams_per_cell=BEAMS[size], escape="off")
    (lidar,) = setup.lidars
    far = replace(lidar, dropout=0.0, pattern=replace(lidar.pattern, max_range_m=100.0))
    return far.pattern.beams, standing(setup, far, seen_from(far, street(), HERE), HERE)


def by_balls(size: int) -> tuple[int, Decide]:
    """Remembered on the wall of a tube of 6 m."""
    rng = np.random.default_rng(0)
    along, angle = rng.uniform(-5.0, 15.0, size), rng.uniform(-np.pi, np.pi, size)
    place = np.stack([along, 3.0 * np.cos(angle), 3.0 * np.sin(angle)], axis=1)
    balls = PointHazards(place, np.full(size, 0.05))
    return size, lambda: decide(_planner(), Situation(HERE, AHEAD_M, remembered=balls))


def by_shapes(size: int) -> tuple[int, Decide]:
    """Balls, rods and boxes of a map, all in view."""
    known = ObstacleMap(mixed_shapes(size))
    return size, lambda: decide(_planner(), Situation(HERE, AHEAD_M, obstacle_map=known))


def by_intruders(size: int) -> tuple[int, Decide]:
    """On all kinds of paths through the grid."""
    intruders = at_random(size)
    return size, lambda: decide(_planner(), Situation(HERE, AHEAD_M, intruders=intruders))


def by_nodes(size: int) -> tuple[int, Decide]:
    """Of reach sets, the more in a cell the more there are; a ball stands ahead."""
    automaton, grid = MovementAutomaton.plane(), AvoidanceGrid.uniform()
    library = ReachLibrary.build(
        automaton, grid, method="chaotic", tuning={"spread": SPREADS[size]}
    )
    planner = Planner.of(library, AvoidanceSettings(escape="off"))
    ball = PointHazards(np.array([[6.0, 0.5, 0.0]]), np.array([1.5]))
    nodes = library.nearest(0.0).nodes
    return nodes, lambda: decide(planner, Situation(HERE, AHEAD_M, remembered=ball))


def _planner() -> Planner:
    return static_mission(escape="off").planner


BENCHMARKS = (
    Benchmark("growth, returns", grown("returns of a street", tuple(BEAMS), by_returns)),
    Benchmark("growth, balls", grown("balls of a tube", (1_000, 3_000, 10_000, 30_000), by_balls)),
    Benchmark("growth, shapes", grown("shapes of a map", (30, 100, 300, 1_000), by_shapes)),
    Benchmark("growth, intruders", grown("intruders", (2, 8, 32, 128), by_intruders)),
    Benchmark("growth, nodes", grown("nodes", range(len(SPREADS)), by_nodes)),
)
