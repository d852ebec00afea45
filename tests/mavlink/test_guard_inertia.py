"""The guardian of a copter with inertia: towards a mast, and where an aircraft crosses."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.scripted import ScriptedIntruder
from companion_missions import mission
from guarded_inertia import GuardedCopter

MAST_M = np.array([18.0, 0.0, 7.0])
THICK_M = 3.0
"""Level distances 5 degrees apart show no thinner thing from afar: nothing thinner stands here."""
MARGIN_M, WIDE_M, AIRCRAFT_M = 1.5, 5.5, 2.0


def guarded(
    speed_mps: float, kind: str, height_m: float, margin_m: float, *, sees: bool
) -> tuple[MissionFile, FlightSetup]:
    return mission(
        mission={"name": "g", "waypoints_m": [[200, 0, height_m]], "reach_radius_m": 2},
        vehicle={"kind": kind, "position_m": [0, 0, height_m], "speed_mps": speed_mps},
        grid={"range_m": 30, "layers": 10},
        safety={"margin_m": margin_m, "smallest_object_m": THICK_M},
        lidar=[{"max_range_m": 30.0}] if sees else [],
    )


def towards_the_mast(speed_mps: float, _time_s: float, place_m: np.ndarray) -> np.ndarray:
    way = (MAST_M - place_m) * [1.0, 1.0, 0.0]
    return np.asarray(speed_mps * way / max(float(np.linalg.norm(way)), 1e-6))


def at_a_mast(speed_mps: float, kind: str, until_s: float) -> GuardedCopter:
    file, setup = guarded(speed_mps, kind, 7.0, MARGIN_M, sees=True)
    mast = Obstacle.line_between([18.0, 0.0, 0.0], [18.0, 0.0, 20.0], radius_m=0.5 * THICK_M)
    setup = replace(setup, world=ObstacleMap([mast]))
    flight = GuardedCopter(file, setup, partial(towards_the_mast, speed_mps))
    flight.run(until_s)
    return flight


@pytest.mark.parametrize(
    "speed_mps", [*(pytest.param(one, marks=pytest.mark.nightly) for one in (2.0, 3.0)), 5.0]
)
def test_it_stops_before_a_mast_and_does_not_creep(speed_mps: float) -> None:
    flight = at_a_mast(speed_mps, "multirotor", 8.0 + 20.0 / speed_mps)
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M
    assert flight.autopilot.fastest_mps >= 0.9 * speed_mps
    assert np.linalg.norm(flight.track[-1] - flight.track[-60]) < 0.05
    assert flight.session.core.tally["replaced"] > 0


@pytest.mark.parametrize("speed_mps", [pytest.param(3.0, marks=pytest.mark.nightly), 5.0])
def test_braking_that_nobody_declares_is_assumed_and_said(speed_mps: float) -> None:
    flight = at_a_mast(speed_mps, "inertialess", 8.0 + 20.0 / speed_mps)
    assert flight.guardian.acceleration_mps2 == pytest.approx(3.0)
    assert "3 m/s2 is assumed, 0.3 s late" in flight.guardian.braking
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M


@pytest.mark.parametrize(
    ("wished_mps", "bearing_deg"),
    [(5.0, 90.0), pytest.param(5.0, 150.0, marks=pytest.mark.nightly), (0.0, 90.0)],
)
def test_a_wish_waits_until_an_aircraft_has_passed(wished_mps: float, bearing_deg: float) -> None:
    """One at 20 m/s that would hit in 13 s, also while nothing moves."""
    file, setup = guarded(5.0, "multirotor", 40.0, WIDE_M, sees=False)
    angle = math.radians(bearing_deg)
    velocity = 20.0 * np.array([math.cos(angle), math.sin(angle), 0.0])
    meets = np.array([14.0 * wished_mps, 0.0, 40.0])
    start = meets - 13.0 * velocity
    who = ScriptedIntruder("FAST", 1.0, start, velocity, radius_m=AIRCRAFT_M, spawn="world")
    wish = np.array([wished_mps, 0.0, 0.0])
    flight = GuardedCopter(file, replace(setup, script=(who,)), lambda _time, _place: wish)
    flight.run(25.0)
    assert flight.autopilot.nearest_intruder_m >= WIDE_M
    assert flight.outcomes[-1].guarded is not None
    assert flight.outcomes[-1].guarded.passed  # It is gone.
    evading = [o.guarded for o in flight.outcomes if o.guarded is not None and o.guarded.evades]
    assert evading
    assert "before it has passed" in evading[0].why
