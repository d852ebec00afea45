"""The promise with a sensor of one level plane, where obstacles are declared to be columns.

As in test_no_collision.py an adversary sees plans and escapes, and puts columns across them
wherever no beam has been.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from adversary import AdversaryWorld, least_distance_m
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.live.preflight.escape_plan import escape_plan
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
from clearway.sim import SimulationSettings, simulate
from clearway.vehicle.automaton import MovementAutomaton

Array = npt.NDArray[np.float64]
LEVEL = np.array([1.0, 1.0, 0.0])
BODY_M, RANGE_M = 0.3, 10.0
SPAN_M = (0.0, 12.0)


def planner(kind: str, **settings: Any) -> Planner:
    made: Any = getattr(MovementAutomaton, kind)
    level = made(1.0, steepest_deg=0.0) if kind == "inertialess" else made(1.0, pitch_limit_deg=0.0)
    library = ReachLibrary.load_or_build(level, AvoidanceGrid.uniform(RANGE_M))
    declared = {"body_radius_m": BODY_M, "obstacles_span_m": SPAN_M} | settings
    return Planner.of(library, AvoidanceSettings(**declared))


def ring() -> Lidar:
    """72 sectors of 5 degrees, each of five beams."""
    azimuth = np.radians(np.arange(-179.5, 180.0))
    return Lidar("ring", BeamPattern.from_angles(azimuth, [0.0], max_range_m=RANGE_M))


class Columns(AdversaryWorld):
    """Columns without an end, as balls of a world that is looked at from above."""

    def distance_m(self, points_m: npt.ArrayLike) -> Array:
        return super().distance_m(np.atleast_2d(np.asarray(points_m, dtype=float)) * LEVEL)

    def cast(self, origin_m: npt.ArrayLike, directions: npt.ArrayLike, max_range_m: float) -> Array:
        return super().cast(np.asarray(origin_m, dtype=float) * LEVEL, directions, max_range_m)

    def oppose(self, plans_m: Any, track_m: Array, rng: np.random.Generator) -> bool:
        stood = len(self.radii_m)
        found = super().oppose([plan * LEVEL for plan in plans_m], track_m * LEVEL, rng)
        self.centers_m[stood:] *= LEVEL  # Put beside a plan, above or below, it stands under it.
        if found and not self._fits(track_m * LEVEL):
            self.centers_m, self.radii_m = self.centers_m[:stood], self.radii_m[:stood]
            return False
        return found

    def _fits(self, track_m: Array) -> bool:
        center, radius = self.centers_m[-1], self.radii_m[-1]
        clear = np.linalg.norm(track_m - center, axis=1).min() - radius > 0.1
        clear &= np.linalg.norm(center) - radius > self.clear_m
        return bool(clear) and self._never_looked_at(center, radius)


@pytest.mark.parametrize("kind", ["inertialess", "plane"])
@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(n, marks=pytest.mark.nightly) for n in range(1000, 1100))]
)
def test_no_column_is_hit_that_is_put_where_no_beam_was(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    height = float(rng.uniform(SPAN_M[0] + 2.0, SPAN_M[1] - 2.0))
    start = State(np.array([0.0, 0.0, height]), np.array([0.0, 0.0, rng.uniform(-3.1, 3.1)]))
    mission = Mission(
        "opposed",
        start,
        waypoints_m=np.array([[40.0, 0.0, rng.uniform(2.0, 10.0)]]),
        reach_radius_m=1.5,
    )
    few = np.column_stack([rng.uniform(5.0, 35.0, 6), rng.uniform(-6.0, 6.0, 6), np.zeros(6)])
    world = Columns(few, rng.uniform(0.2, 1.0, 6), RANGE_M, clear_m=2.5, unit_m=1.0)
    system = AvoidanceSystem(planner(kind), mission, lidars=(ring(),))
    track, certain = [start.position_m], []

    def oppose(entry: Any, _progress: Any) -> None:
        decision = entry.flight.decision
        way = decision.way_out
        certain.append(way is not None and way.certain)
        track.append(decision.state.position_m)
        if rng.random() < 0.7:
            plans = [decision.path_m] + ([way.path_m] if way is not None else [])
            world.oppose(plans, np.array(track), rng)

    run = simulate(
        system,
        world,
        lidars=(ring(),),
        settings=SimulationSettings(time_limit_s=60.0),
        on_decision=oppose,
    )
    assert system.escape.flown == "strict", str(system.escape)
    # All round and as far as plans lead, only what others hide was never looked at.
    assert len(world.radii_m) > 6 or seed > 1, "the adversary found places"
    assert certain.index(True) <= 2
    assert all(certain[certain.index(True) :])
    least_m = least_distance_m(run.states[:, :3] * LEVEL, world.centers_m, world.radii_m)
    assert least_m >= BODY_M - 1e-6


# --- before take-off ----------------------------------------------------------------------------


def plan_at(height_m: float, **settings: Any) -> Any:
    start = State(np.array([0.0, 0.0, height_m]))
    return escape_plan(planner("inertialess", **settings), (ring(),), start=start)


def test_undeclared_a_level_plane_promises_nothing_and_says_what_to_declare() -> None:
    plan = plan_at(5.0, obstacles_span_m=None)
    assert plan.flown == "known"
    assert "one level plane" in plan.why
    assert "set safety.obstacles_span_m = [lowest, highest]" in plan.why


def test_declared_it_promises_what_holds_under_the_declaration_and_says_so() -> None:
    plan = plan_at(5.0)
    assert (plan.flown, plan.within) == ("strict", 0)
    assert "whatever stands between 0 and 12 m reaches through all heights between" in plan.why


@pytest.mark.parametrize("height_m", [-3.0, 0.1, 11.9, 20.0])
def test_a_start_outside_of_what_is_declared_promises_nothing_and_that_is_said(
    height_m: float,
) -> None:
    plan = plan_at(height_m)
    assert plan.flown == "known"
    assert "does not lie within obstacles_span_m" in plan.why
