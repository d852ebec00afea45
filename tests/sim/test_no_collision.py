"""The promise of `strict`: in a static world, no collision after the first way out in hand, ever.

An adversary sees the vehicle's plans and ways out, and puts balls across them wherever no beam has
been. Automata, ranges, fields and margins are drawn; distances are those of the test alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adversary import AdversaryWorld, least_distance_m
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
from clearway.sim import SimulationSettings, simulate
from clearway.sim.faults import Faults
from clearway.vehicle.automaton import MovementAutomaton

BODY_M = 0.1


class Drawn:
    """One flight against the adversary."""

    def __init__(
        self,
        seed: int,
        *,
        usual: bool,
        faults: Faults | None = None,
        wind_share: float = 0.0,
        dropout: float = 0.05,
        **simulated: float,
    ) -> None:
        rng = np.random.default_rng(seed)
        scale = 1.0 if usual else float(10.0 ** rng.uniform(-0.5, 1.5))
        turn_deg = 15.0 if usual else float(rng.choice([10.0, 12.0, 15.0, 18.0, 20.0]))
        radius = scale / np.radians(turn_deg)
        range_m = 10.0 if usual else float(rng.uniform(2.7, 4.5)) * radius
        azimuth = 45.0 if usual else float(rng.uniform(40.0, 170.0))
        elevation = 30.0 if usual else float(rng.uniform(28.0, 50.0))
        if usual and (wind_share or simulated):
            range_m = 15.0
        margin = 0.6 if usual else float(rng.uniform(0.3, 0.9)) * scale
        grid = AvoidanceGrid.uniform(
            range_m, 10, azimuth_deg=azimuth, columns=7, elevation_deg=elevation
        )
        automaton = MovementAutomaton.plane(scale, turn_deg)
        blows = float(np.random.default_rng([seed, 9]).uniform(-np.pi, np.pi))
        wind = (wind_share * scale * np.cos(blows), wind_share * scale * np.sin(blows), 0.0)
        settings = AvoidanceSettings(
            safety_margin_m=margin,
            body_radius_m=BODY_M * scale,
            own_drift_mps=0.05 * scale,
            wind_mps=wind,
        )
        planner = Planner.of(ReachLibrary.build(automaton, grid), settings)
        pattern = BeamPattern.per_cell(grid, 20, elevations_per_cell=10, max_range_m=range_m)
        lidar = Lidar("lidar", pattern, sigma_m=0.01 * scale, dropout=dropout)
        there = np.array([[12.0 * radius, 0.0, 0.0]])
        mission = Mission(
            "opposed", State(np.zeros(3)), waypoints_m=there, reach_radius_m=0.4 * radius
        )
        few = rng.uniform(-1.0, 1.0, (6, 3)) * [4.0, 2.0, 1.0] * radius + [6.0 * radius, 0.0, 0.0]
        self.scale = scale
        self.world = AdversaryWorld(
            few, rng.uniform(0.4, 2.0, 6) * scale, range_m, clear_m=1.5 * scale, unit_m=scale
        )
        self.system = AvoidanceSystem(planner, mission, lidars=(lidar,))
        self.held_from_s = np.inf
        self.without = 0
        self._rng, self._track = rng, [np.zeros(3)]
        simulation = SimulationSettings(seed=seed, time_limit_s=60.0, wind_mps=wind, **simulated)
        if faults is not None:
            simulation = replace(simulation, faults=faults)
        self.run = simulate(
            self.system, self.world, lidars=(lidar,), settings=simulation, on_decision=self._oppose
        )

    def _oppose(self, entry, _progress) -> None:
        decision = entry.flight.decision
        now_s, way = entry.flight.time_s, decision.way_out
        certain = way is not None and way.certain
        if certain:
            self.held_from_s = min(self.held_from_s, now_s)
        self.without += not certain and now_s > self.held_from_s
        self._track.append(decision.state.position_m)
        if self._rng.random() < 0.7:
            plans = [decision.path_m] + ([way.path_m] if way is not None else [])
            self.world.oppose(plans, np.array(self._track), self._rng)

    @property
    def least_m(self) -> float:
        """Least distance from anything after the first way out was in hand."""
        after = self.run.time_s >= self.held_from_s - 1e-9
        track = self.run.states[after, :3]
        return least_distance_m(track, self.world.centers_m, self.world.radii_m)


def held(drawn: Drawn) -> None:
    assert drawn.system.escape.flown == "strict", str(drawn.system.escape)
    if np.isfinite(drawn.held_from_s):
        assert drawn.least_m >= BODY_M * drawn.scale - 1e-6
        assert drawn.without == 0


@pytest.mark.parametrize("seed", range(4))
def test_whatever_is_put_where_nobody_looked_is_not_hit(seed: int) -> None:
    drawn = Drawn(seed, usual=True)
    held(drawn)
    assert np.isfinite(drawn.held_from_s)
    assert len(drawn.world.radii_m) > 6, "the adversary found places"


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(1000, 1100))
def test_nor_with_other_vehicles_ranges_fields_and_margins(seed: int) -> None:
    drawn = Drawn(seed, usual=False)
    if drawn.system.escape.flown != "strict":
        pytest.skip(f"cannot hold: {drawn.system.escape.why}")
    held(drawn)


@pytest.mark.parametrize("faults", [Faults(dead_from_s=12.0), Faults(late_from_s=10.0, late_s=3.0)])
def test_nor_when_a_sensor_dies_or_a_decision_comes_late(faults: Faults) -> None:
    drawn = Drawn(7, usual=True, faults=faults)
    assert drawn.least_m >= BODY_M


@pytest.mark.parametrize("seed", [0])
def test_nor_in_a_wind_that_is_declared(seed: int) -> None:
    held(Drawn(seed, usual=True, wind_share=0.2))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(40))
def test_nor_in_wind_from_any_side(seed: int) -> None:
    held(Drawn(seed, usual=True, wind_share=0.2))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("what", ["dead", "late"])
def test_nor_then_at_any_time(seed: int, what: str) -> None:
    at_s = float(np.random.default_rng(seed).uniform(3.0, 40.0))
    dead = Faults(dead_from_s=at_s)
    drawn = Drawn(
        seed, usual=True, faults=dead if what == "dead" else Faults(late_from_s=at_s, late_s=3.0)
    )
    assert drawn.least_m >= BODY_M
