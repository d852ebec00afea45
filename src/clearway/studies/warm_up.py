"""All that clearway compiles, compiled ahead: short pieces of work that between them need it all.

Pieces that have little in common come first, so that processes side by side compile different
loops; where two need the same one, the second waits for the first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from clearway.base.grid import AvoidanceGrid
from clearway.base.kernels.news import NEWS, told_to
from clearway.base.state import State
from clearway.missions.assess import assess
from clearway.missions.mission_file import built_in_missions
from clearway.missions.world_file import read_mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import METHODS, ReachLibrary, build_reach_set
from clearway.reach.escapes import EscapeLibrary
from clearway.sensors import Scan
from clearway.sim.baselines import PLANNERS
from clearway.sim.worlds import FAMILIES
from clearway.studies.processes import in_processes
from clearway.studies.warm_up_pieces import (
    FLOWN_S,
    MET_S,
    compare_reach_sets,
    fly_by_rules,
    fly_encounters_of_each_kind,
    fly_for,
    fly_round_the_first,
    measure_a_quadrotor,
    read_samples,
    study_risk,
    tell_of_a_flight,
)
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton

SMALL = AvoidanceGrid.uniform(range_m=4.0, layers=4)


class WarmedUp(NamedTuple):
    """What one piece of work took from the disk, and what it compiled."""

    piece: str
    loaded: int
    compiled: int


def pieces() -> dict[str, Callable[[], object]]:
    """All there is to do, by name."""
    automaton = MovementAutomaton.plane(speed_mps=1.0)
    missions = sorted(built_in_missions())
    return {
        "ways out": partial(EscapeLibrary.of, automaton),
        "a scan": _assess_scan,
        "reach sets": partial(ReachLibrary.build, automaton, SMALL),
        "a map": _assess_map,
        "traffic": _assess_traffic,
        "no ways out": _fly_without_ways_out,
        **{f"mission {name}": partial(_fly, name) for name in missions},
        "a multirotor": _fly_multirotor,
        "volumes": _fly_clear_of_volumes,
        "another rating": _fly_by_another_rating,
        "rules": fly_by_rules,
        "longer flights": fly_round_the_first,
        "a recording": tell_of_a_flight,
        "a plant": measure_a_quadrotor,
        "reach sets compared": compare_reach_sets,
        "encounters": fly_encounters_of_each_kind,
        "risk": study_risk,
        "samples": read_samples,
        **{f"world {name}": partial(_fly, f"{name}:0", seconds=MET_S) for name in FAMILIES},
        **{f"planner {name}": partial(_fly, missions[-1], name) for name in PLANNERS},
        **{
            f"method {name}": partial(build_reach_set, automaton, SMALL, method=name)
            for name in METHODS
        },
    }


def warm_up(workers: int) -> Iterator[WarmedUp]:
    """Do all pieces in processes side by side; yields each when it is done."""
    yield from in_processes(_done, tuple(pieces()), workers)


def _done(piece: str) -> WarmedUp:
    before = NEWS.loaded, NEWS.compiled
    with told_to(_nobody):
        pieces()[piece]()
    return WarmedUp(piece, NEWS.loaded - before[0], NEWS.compiled - before[1])


def _nobody(_loop: str) -> None:
    """Whoever waits sees the pieces."""


def _fly(mission: str, planner: str = "clearway", seconds: float = FLOWN_S) -> None:
    fly_for(read_mission(mission), seconds, planner)


def _fly_without_ways_out() -> None:
    """What is remembered and chosen, while a process beside this one compiles the ways out first,
    as flights do; two that began as flights do would wait for each other."""
    fly_for(read_mission("intruders").changed("safety", escape="off"), FLOWN_S)


def _fly_multirotor() -> None:
    fly_for(read_mission("static-obstacles").changed("vehicle", kind="multirotor"), FLOWN_S)


def _fly_clear_of_volumes() -> None:
    file = read_mission("intruders")
    fly_for(file.changed("traffic", volumes="f3442", keep_volumes=True), FLOWN_S)


def _fly_by_another_rating() -> None:
    """In steps, since it is none that one compiled call knows; it asks for the total one too."""
    fly_for(read_mission("mixed").changed("rating", name="calibrated"), FLOWN_S)


def _assess_scan() -> None:
    steps = np.linspace(-0.5, 0.5, 9)
    y, z = (each.ravel() for each in np.meshgrid(steps, steps))
    assess([Scan(6.0 * np.stack([np.ones(81), y, z], axis=1), 0.0)])


def _assess_map() -> None:
    shapes = [
        Obstacle.ball([6.0, 0.5, 0.0], 1.0),
        Obstacle.cuboid([7.0, -2.0, 0.0], (1.0, 1.0, 2.0)),
    ]
    assess([], obstacle_map=ObstacleMap(shapes))


def _assess_traffic() -> None:
    passing = Intruder(
        np.array([6.0, 2.0, 0.0]),
        np.array([0.0, -1.0, 0.0]),
        spread_rad=np.array([0.1, 0.1]),
        radius_m=0.6,
        name="one",
        time_s=0.0,
    )
    assess([], state=State(np.zeros(3)), intruders=[passing])
