"""Decisions in flight: the static mission, from sensor arrays in hand to the explained decision."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.scenes import AS_FLOWN, SHAPES, chamber, mixed_shapes, scattered, street
from benchmarks.table import Benchmark, Row
from benchmarks.timing import Times, timed
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import FlightSetup, prepare
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import World
from clearway.sensors import Lidar, Scan, simulate_scan
from clearway.traffic import Intruder

MISSION = "static-obstacles"
MANY_BEAMS = (80, 36)
"""Azimuths and elevations through every column of cells: 100,800 beams in all."""


@cache
def static_mission(
    rating: str = "total",
    beams_per_cell: tuple[int, int] | None = None,
    escape: str = "strict",
) -> FlightSetup:
    """Section 6.4, with another rating, scanner or escape if so wished."""
    file = read_mission_file(MISSION).with_values("rating", name=rating)
    file = file.with_values("safety", escape=escape)
    if beams_per_cell is not None:
        (lidar,) = file.lidar
        other = lidar.model_copy(update={"beams_per_cell": beams_per_cell})
        file = file.model_copy(update={"lidar": (other,)})
    return prepare(file)


def with_seed(setup: FlightSetup, seed: int) -> FlightSetup:
    return replace(setup, simulation=replace(setup.simulation, seed=seed))


def in_flight(
    beams_per_cell: tuple[int, int] | None,
    target_s: float | None,
    target_p99_s: float | None,
    escape: str = "strict",
) -> Callable[[bool], Row]:
    """All decisions of several whole flights."""

    def measure(quick: bool) -> Row:
        setup = static_mission(beams_per_cell=beams_per_cell, escape=escape)
        flights = 2 if quick else 6
        decisions = [
            entry for seed in range(flights) for entry in with_seed(setup, seed).fly().decisions
        ]
        times = Times(np.array([entry.elapsed_s for entry in decisions]))
        (lidar,) = setup.lidars
        return times.row(
            f"a decision of the static mission, {lidar.pattern.beams:,} beams, "
            f"from sensor arrays to the decision, escape {escape}; "
            f"{len(decisions)} decisions of {flights} flights",
            target_s=target_s,
            target_p99_s=target_p99_s,
        )

    return measure


def repeated(escape: str, target_s: float | None = None) -> Callable[[bool], Row]:
    """Decisions at places along the way, each again and again with the same readings."""

    def measure(quick: bool) -> Row:
        setup = static_mission(escape=escape)
        (lidar,) = setup.lidars
        places = [
            State(np.array([x, y, z]), np.radians([0.0, pitch_deg, yaw_deg]))
            for x, y, z, pitch_deg, yaw_deg in AS_FLOWN
        ]
        each = [
            timed(
                standing(setup, lidar, seen_from(lidar, setup.world, place), place),
                quick,
                0.5,
                warm_up=20,
            ).each_s
            for place in places
        ]
        return Times(np.concatenate(each)).row(
            f"a decision of the static mission, {lidar.pattern.beams:,} beams, at {len(places)} "
            f"places of its way again and again, escape {escape}",
            target_s=target_s,
        )

    return measure


def seen_from(lidar: Lidar, world: World, state: State) -> Scan:
    return simulate_scan(lidar, world, state, np.random.default_rng(0))


def standing(
    setup: FlightSetup,
    lidar: Lidar,
    scan: Scan,
    state: State,
    obstacle_map: ObstacleMap | None = None,
    intruders: Sequence[Intruder] = (),
) -> Callable[[], None]:
    """A decision of who stands somewhere, a second after the one before, by the same readings."""
    # It stands still for the benchmark's sake: no detour for want of progress.
    planner = setup.planner.with_values(patience_turns=1e9)
    system = AvoidanceSystem(planner, setup.mission, lidars=(lidar,), obstacle_map=obstacle_map)
    system.followed = False  # Nor is what holds it any wind.
    clock = count()

    def run() -> None:
        now = float(next(clock))
        system.update(replace(state, time_s=now))
        system.update(replace(scan, time_s=now))
        for each in intruders:
            system.update(replace(each, time_s=now))
        system.decide(now)

    return run


def many_returns(
    make: Callable[[], ObstacleMap], where: str, escape: str, target_s: float
) -> Callable[[bool], Row]:
    """Standing somewhere while scans with a return of every beam come in."""

    def measure(quick: bool) -> Row:
        setup, far = seeing_far(escape)
        start = setup.mission.start
        run = standing(setup, far, seen_from(far, make(), start), start)
        return timed(run, quick).row(
            f"a decision {where}, {far.pattern.beams:,} returns, escape {escape}",
            target_s=target_s,
        )

    return measure


def seeing_far(escape: str) -> tuple[FlightSetup, Lidar]:
    """The static mission with a scanner of many beams, none of which are lost."""
    setup = static_mission(beams_per_cell=MANY_BEAMS, escape=escape)
    (lidar,) = setup.lidars
    return setup, replace(lidar, dropout=0.0, pattern=replace(lidar.pattern, max_range_m=100.0))


def leaves(quick: bool) -> Row:
    """Returns in no order of nothing whole: remembered each apart, as far as there is room."""
    setup, far = seeing_far("off")
    scan = Scan(scattered(100_000), sensor=far.name)
    return timed(standing(setup, far, scan, setup.mission.start), quick).row(
        f"a decision among leaves within 10 m, {len(scan.points_m):,} returns, escape off",
        target_s=8e-3,
    )


def many_shapes(quick: bool) -> Row:
    """A thousand shapes of a map in view, told before take-off."""
    setup = static_mission(escape="off")
    shapes = mixed_shapes(SHAPES)
    system = AvoidanceSystem(setup.planner, setup.mission, obstacle_map=ObstacleMap(shapes))
    system.update(setup.mission.start)
    return timed(lambda: system.decide(0.0), quick).row(
        f"a decision with {SHAPES:,} mixed shapes of a map in view, escape off", target_s=3e-3
    )


def mission_flown(quick: bool) -> Row:
    setup = static_mission()
    seconds = setup.fly().metrics.time_s
    return timed(setup.fly, quick, seconds=6.0, warm_up=1).row(
        f"the static mission simulated, {seconds:.0f} s of flight", target_s=3.0
    )


def command(*arguments: str) -> Callable[[], None]:
    """The command line in a process of its own, as a user runs it: modules are compiled to
    bytecode once, whatever the environment of the benchmark says."""
    environment = {key: at for key, at in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}

    def run() -> None:
        with TemporaryDirectory() as folder:
            subprocess.run(
                [sys.executable, "-m", "clearway", *arguments],
                cwd=Path(folder),
                env=environment,
                check=True,
                capture_output=True,
            )

    return run


def fly_command(quick: bool) -> Row:
    words = ("fly", MISSION, "--no-plots", "--json")
    return timed(command(*words), quick, seconds=15.0, warm_up=1).row(
        f"clearway {' '.join(words)}, the whole process", target_s=1.2
    )


FIRST = """
import time
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.sensors import simulate_scan

setup = prepare(read_mission_file("static-obstacles").with_values("safety", escape={escape!r}))
(lidar,), start = setup.lidars, setup.mission.start
scan = simulate_scan(lidar, setup.world, start, 0)
system = setup.system()
began = time.perf_counter()
system.update(start)
system.update(scan)
system.decide(start.time_s)
print(time.perf_counter() - began)
"""


def first(escape: str) -> Callable[[bool], Row]:
    """The first decision of a process, by a system that was just made."""

    def measure(quick: bool) -> Row:
        command = [sys.executable, "-c", FIRST.format(escape=escape)]
        taken = [
            float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
            for _ in range(3 if quick else 9)
        ]
        return Times(np.array(taken)).row(
            f"the first decision of a process, escape {escape}",
            target_s=20e-3,
        )

    return measure


def help_command(quick: bool) -> Row:
    return timed(command("--help"), quick, seconds=4.0, warm_up=1).row(
        "clearway --help, the whole process", target_s=0.5
    )


BENCHMARKS = (
    Benchmark(
        "decision, 7,000 beams", in_flight(None, 1.5e-3, None), headline=True, first_page=True
    ),
    Benchmark("decision, 100,800 beams", in_flight(MANY_BEAMS, None, None), headline=True),
    Benchmark(
        "decision, 7,000 beams, escape off",
        in_flight(None, 1e-3, 3e-3, "off"),
        headline=True,
        first_page=True,
    ),
    Benchmark("decision, repeated", repeated("strict", 1.5e-3), headline=True),
    Benchmark(
        "decision, repeated, escape off", repeated("off", 350e-6), headline=True, first_page=True
    ),
    Benchmark(
        "decision, 100,000 returns",
        many_returns(street, "in a street to 100 m, 10 m of it rated", "strict", 10e-3),
        headline=True,
        first_page=True,
    ),
    Benchmark(
        "decision, 100,000 returns, escape off",
        many_returns(street, "in a street to 100 m, 10 m of it rated", "off", 3e-3),
        first_page=True,
    ),
    Benchmark(
        "decision, 100,000 returns in reach, escape off",
        many_returns(chamber, "between walls within 10 m", "off", 8e-3),
    ),
    Benchmark("decision, 100,000 returns of leaves, escape off", leaves),
    Benchmark("decision, 1,000 shapes", many_shapes, first_page=True),
    Benchmark("mission, simulated", mission_flown, headline=True),
    Benchmark("mission, command", fly_command, headline=True, first_page=True),
    Benchmark("decision, first", first("strict")),
    Benchmark("decision, first, escape off", first("off")),
    Benchmark("help, command", help_command),
)
