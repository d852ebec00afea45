"""The simulated vehicle's motion: what the automaton predicts, unless it is disturbed."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.sim import SimulationSettings
from clearway.sim.motion import TrueMotion
from clearway.sim.plants.kinematic import KinematicPlant
from clearway.vehicle.automaton import MovementAutomaton

AUTOMATON = MovementAutomaton.plane()
NAMES = ("Left", "Up", "Straight", "Right")


def moved(seed: int = 0, steps: int | None = None, **settings: object) -> TrueMotion:
    """The motion after NAMES, or after some steps of the first one."""
    simulation = SimulationSettings(**settings)  # type: ignore[arg-type]
    start = State([1.0, 2.0, 3.0], [0.0, 0.0, 0.3], time_s=5.0)
    plant = KinematicPlant(AUTOMATON, start, simulation, np.random.default_rng(seed), 0.6)
    motion = TrueMotion(plant, start.time_s, simulation.step_s)
    for movement in AUTOMATON.chain(NAMES):
        for step, _ in enumerate(motion.fly(movement), start=1):
            if step == steps:
                return motion
    return motion


def test_undisturbed_motion_ends_each_movement_where_the_automaton_says():
    motion = moved(step_s=0.03)
    state = motion.states[0]
    for second, movement in enumerate(AUTOMATON.chain(NAMES), start=1):
        state = AUTOMATON.predict(state, movement)
        np.testing.assert_allclose(motion.at(5.0 + second).vector, state, atol=1e-12)
    assert motion.corrections == 0
    assert np.diff(motion.times).max() <= 0.03


def test_a_movement_can_be_stopped_in_the_middle():
    motion = moved(steps=4, step_s=0.05)
    assert motion.now_s == pytest.approx(5.2)
    assert motion.movements == ["Left"]
    assert len(motion.states) == 5


def test_wind_carries_and_noise_stays_within_its_bound():
    calm, windy = moved(), moved(wind_mps=(0.5, 0.0, -0.2))
    drift = windy.state.position_m - calm.state.position_m
    np.testing.assert_allclose(drift, [2.0, 0.0, -0.8], atol=1e-9)
    gusty = moved(seed=3, state_noise_mps=0.1)
    assert 0.0 < np.abs(gusty.state.position_m - calm.state.position_m).max() <= 4 * 0.1


def test_turns_that_come_out_wrong_are_corrected():
    assert moved(seed=1, input_noise=0.8).corrections > 0
