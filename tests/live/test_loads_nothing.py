"""In flight nothing is compiled or loaded from the disk: whatever comes, warming up has met it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from asked_in_flight import asked_apart, asked_in_flight, mission
from clearway.live import AvoidanceSystem
from clearway.sensors import Scan

TWO = [{"name": "a"}, {"name": "b", "attitude_deg": [0, 0, 15]}]


def falls_silent(scan: Scan) -> list[Scan]:
    return [scan] if scan.time_s < 2.0 else []


def sets_a_floor(system: AvoidanceSystem) -> None:
    system.floor_m = -2


CASES: dict[str, Callable[[], list[str]]] = {
    "deviations of 4 bytes": lambda: asked_in_flight(
        mission(),
        told=lambda state: replace(
            state, position_std_m=np.float32(0.1), attitude_std_rad=np.float32(0.01)
        ),
    ),
    "an attitude that nobody is sure about": lambda: asked_in_flight(
        mission(), told=lambda state: replace(state, attitude_std_rad=0.01 * (state.time_s > 1.0))
    ),
    "no deviation where one was told": lambda: asked_in_flight(
        mission(simulation={"attitude_sigma_deg": 0.5})
    ),
    "a scanner that falls silent": lambda: asked_in_flight(mission(), 8, seen=falls_silent),
    "two scanners": lambda: asked_in_flight(mission(lidar=TWO), 6),
    "two scanners, no ways out": lambda: asked_in_flight(
        mission(lidar=TWO, safety={"escape": "off"}), 6
    ),
    "another rule of detection": lambda: asked_in_flight(mission(rating={"detection": "surface"})),
    "a floor, set in flight": lambda: asked_in_flight(
        mission("intruders", traffic={"volumes": "f3442", "keep_volumes": True}),
        before=sets_a_floor,
    ),
}


def tell(name: str) -> None:
    print("asked", *CASES[name](), sep="\n")


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_asked_for_in_flight(name: str) -> None:
    assert asked_apart(CASES, name) == []
