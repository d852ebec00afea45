"""After `warm_up` nothing is compiled or loaded in flight, whatever only some missions ask for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from asked_in_flight import asked_apart, asked_in_flight, of_tables, told_to
from clearway.avoidance.evidence import in_reach
from clearway.avoidance.ways_out import WaysOut
from clearway.base.state import State
from clearway.live.readings import Reading
from clearway.missions.setup import prepare
from clearway.traffic import Intruder
from repository import REPOSITORY

BALL = {"shape": "ball", "position_m": [9, 0, 0], "radius_m": 2.0}
FAR_BALL = BALL | {"position_m": [14, 0, 0]}
WALL = {"shape": "cuboid", "position_m": [9, 0, 0], "size_m": [0.5, 14, 14]}
TURNING: dict[str, Any] = {"vehicle": {"kind": "multirotor"}}
MAPPED: dict[str, Any] = TURNING | {
    "safety": {"escape": "mapped", "margin_m": 0.6},
    "map": {"complete": True},
    "lidar": [],
}
ASIDE: dict[str, Any] = {
    "vehicle": {"plant": "quadrotor"},
    "rating": {"name": "evidence", "unknown": 0.5},
    "safety": {"escape": "known", "narrow": "allow", "smallest_object_m": 1.0},
    "lidar": [{"attitude_deg": [0, 0, 90]}],
    "obstacle": [BALL | {"position_m": [5.5, 7, 0]}],
}
MEASURED: dict[str, Any] = {
    "vehicle": {"automaton": str(REPOSITORY / "examples" / "automata" / "F450.toml")},
    "safety": {"escape": "off"},
    "lidar": [],
}
HEAD_ON = ([9.0, -0.2, 0.0], [-0.6, 0.0, 0.0])
FROM_RIGHT = ([6.0, -6.0, 0.0], [0.0, 1.0, 0.0])


def flown(
    seconds: int, met: tuple[list[float], list[float]] | None = None, **tables: Any
) -> list[str]:
    """What a mission of some sections asks for; met: place and velocity of an intruder."""

    def meets(state: State, _second: int) -> list[Reading]:
        if met is None:
            return []
        place, velocity = state.position_m + met[0], np.array(met[1])
        return [Intruder(place, velocity, radius_m=0.6, name="x", time_s=state.time_s)]

    return asked_in_flight(of_tables(**tables), seconds, more=meets)


def left_without_a_way_out() -> list[str]:
    """What a place without one is held against, which few flights come to."""
    system = prepare(of_tables(safety={"narrow": "allow"}, **TURNING)).system()
    system.warm_up()
    system.update(State(np.zeros(3)))
    system.decide(0.0)
    (situation, _), planner = system.situation(0.0), system.planner
    near = in_reach(planner, situation, planner.escape_reach_m, planner.horizon_s)
    assert planner.escapes is not None
    ways = WaysOut(planner, planner.escapes, situation, near)
    reach_set = planner.prepared_at(situation.state).reach_set
    asked: list[str] = []
    with told_to(asked):
        ways.saw(reach_set.samples_m[:1], reach_set.sagitta_m[:1])
    return asked


CASES: dict[str, Callable[[], list[str]]] = {
    "right of way, head on": lambda: flown(3, HEAD_ON, rules={"right_of_way": True}),
    "right of way, from the right": lambda: flown(3, FROM_RIGHT, rules={"right_of_way": True}),
    "keep-out far away": lambda: flown(8, keep_out=[FAR_BALL]),
    "keep-out later": lambda: flown(7, keep_out=[BALL | {"from_s": 4.0}]),
    "begins below the floor": lambda: flown(
        14, rules={"floor_m": 1.0}, mission={"waypoints_m": [[30, 0, 8]]}
    ),
    "stops before a wall": lambda: flown(8, obstacle=[WALL], **TURNING),
    "mapped": lambda: flown(8, obstacle=[FAR_BALL | {"known": "both"}], **MAPPED),
    "mapped, nothing there": lambda: flown(3, **MAPPED),
    "looks aside": lambda: flown(12, mission={"waypoints_m": [[0, 0, 0], [30, 30, 0]]}, **ASIDE),
    "measured": lambda: flown(4, **MEASURED),
    "no way out is left": left_without_a_way_out,
}


def tell(name: str) -> None:
    print("asked", *CASES[name](), sep="\n")


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_loaded_in_flight(name: str) -> None:
    assert asked_apart(CASES, name) == []
