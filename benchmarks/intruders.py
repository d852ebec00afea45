"""Speed of the intruder models, 32 intruders at once, and of bands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.sensors import GRID
from benchmarks.table import Benchmark, Row
from benchmarks.timing import timed
from clearway.avoidance.long_range.bands import bands
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.studies.encounters.flights import planner_at
from clearway.traffic import Intruder, assess_intruders, radial_vehicle_times
from clearway.traffic.volumes import VOLUME_SETS
from clearway.vehicle.performance import PERFORMANCES

COUNT = 32


def paper_intruders() -> list[Intruder]:
    """The intruder of 6.3, so many times: it crosses the whole grid."""
    spread = np.array([np.pi / 12, np.pi / 16])
    return [
        Intruder(
            np.array([6.0, 8.0, 0.0]), np.array([0.0, -1.0, 0.0]), spread_rad=spread, radius_m=2.0
        )
    ] * COUNT


def random_intruders() -> list[Intruder]:
    return at_random(COUNT)


def at_random(count: int) -> list[Intruder]:
    """On all kinds of paths through the grid."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(count):
        through = rng.uniform([1, -3, -2], [9, 3, 2])
        velocity = rng.normal(size=3)
        spread = rng.uniform(0.05, 0.4, 2)
        found.append(Intruder(through - 6.0 * velocity, velocity, spread_rad=spread, radius_m=1.0))
    return found


def leaving_intruders() -> list[Intruder]:
    """Half a kilometre away and on their way out: none can come near."""
    away, spread = np.array([20.0, 0.0, 0.0]), np.array([0.2, 0.2])
    return [
        Intruder(np.array([500.0, 20.0 * number, 3.0]), away, spread_rad=spread, radius_m=1.0)
        for number in range(COUNT)
    ]


def assessed(
    make: Callable[[], Sequence[Intruder]],
    where: str,
    models: tuple[str, ...],
    target_s: float | None = None,
) -> Callable[[bool], Row]:
    """Cells met by the intruders after some models, all intruders combined."""

    def measure(quick: bool) -> Row:
        intruders = make()
        return timed(lambda: assess_intruders(GRID, intruders, models), quick).row(
            f"{COUNT} intruders {where}, 350 cells: {' and '.join(models)}", target_s=target_s
        )

    return measure


def at_the_vehicle_s_time(quick: bool) -> Row:
    intruders, times = paper_intruders(), radial_vehicle_times(GRID, 1.0)
    return timed(
        lambda: assess_intruders(GRID, intruders, ("line", "spread"), True, times), quick
    ).row(f"{COUNT} intruders across the grid, line and spread, at the vehicle's time (5.5)")


def decision(
    make: Callable[[], Sequence[Intruder]], where: str, escape: str, target_s: float | None
) -> Callable[[bool], Row]:
    """A whole decision among intruders, from their reports to its explanation."""

    def measure(quick: bool) -> Row:
        start = State(np.zeros(3))
        mission = Mission("benchmark", start, waypoints_m=np.array([[100.0, 0.0, 0.0]]))
        planner = planner_at(1.0)
        planner = planner.with_values(escape=escape)
        system = AvoidanceSystem(planner, mission)
        system.update(start)
        for number, each in enumerate(make()):
            system.update(replace(each, name=f"i{number}"))
        # Half a second after the reports, so that all of them have to be predicted.
        system.update(replace(start, time_s=0.5))
        return timed(lambda: system.decide(0.5), quick).row(
            f"a decision with {COUNT} intruders {where}, line and spread, from reports to the "
            f"explained decision, escape {escape}",
            target_s=target_s,
        )

    return measure


def banded(apart_m: float, where: str) -> Callable[[bool], Row]:
    """Bands of heading, climb and speed about four intruders that come from all sides."""

    def measure(quick: bool) -> Row:
        kept, able = VOLUME_SETS["f3442"], PERFORMANCES["wing"]
        sides = np.radians([0.0, 80.0, 170.0, -100.0])
        towards = np.stack([np.cos(sides), np.sin(sides), np.zeros(4)], axis=1)
        coming = [Intruder(apart_m * one, -40.0 * one, name="x") for one in towards]
        own = np.array([25.0, 0.0, 0.0])
        found = bands(kept, able, np.zeros(3), own, coming, 0.0)
        return timed(lambda: bands(kept, able, np.zeros(3), own, coming, 0.0), quick).row(
            f"bands about four intruders {where}"
            f"{', with recovery bands' if found.saturated else ''}",
            target_s=0.5e-3,
        )

    return measure


ACROSS, AT_RANDOM = (paper_intruders, "across the grid"), (random_intruders, "on random paths")
LEAVING = (leaving_intruders, "500 m away and leaving")

BENCHMARKS = (
    Benchmark("intruders, line", assessed(*ACROSS, ("line",), COUNT * 5e-6)),
    Benchmark("intruders, spread", assessed(*ACROSS, ("spread",), COUNT * 100e-6)),
    Benchmark("intruders, body", assessed(*ACROSS, ("body",), COUNT * 300e-6)),
    Benchmark("intruders, line and spread", assessed(*ACROSS, ("line", "spread"), 5e-3)),
    Benchmark("intruders, random paths", assessed(*AT_RANDOM, ("line", "spread"), 5e-3)),
    Benchmark("intruders, timed", at_the_vehicle_s_time),
    Benchmark("intruders, leaving", assessed(*LEAVING, ("line", "spread"))),
    Benchmark("bands, four intruders", banded(4000.0, "4 km off")),
    Benchmark("bands, four intruders near", banded(700.0, "700 m off")),
    *(
        Benchmark(
            f"decision, 32 intruders{name}{'' if escape == 'strict' else ', escape off'}",
            decision(*among, escape, target_s if escape == "off" else None),
            headline=escape == "off",
        )
        for name, among, target_s in (
            ("", AT_RANDOM, 5e-3),
            (" across", ACROSS, 2.5e-3),
            (" leaving", LEAVING, 0.5e-3),
        )
        for escape in ("strict", "off")
    ),
)
