"""The plant that does what the automaton predicts, disturbed within bounds (3.20)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.sim.plants.air import Air
from clearway.sim.plants.led import Asked, LedGains, LedWay, PointMass, fly_point_mass
from clearway.sim.settings import SimulationSettings
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.prediction import correct_movement, needs_correction, prediction_error

MASS = PointMass()
LED = LedGains(drag_per_s=MASS.drag_per_s)
LEAD_S = (MASS.lag_s, MASS.lag_s)
INNER_S = 0.005


class KinematicPlant:
    """Turns at once, and corrects its attitude where a movement begins (4.2.2).

    Bounded disturbances act on the state's rates (w) and on the inputs (v) of (3.20); margin_m is
    what prediction errors may take their share of.
    """

    def __init__(
        self,
        automaton: MovementAutomaton,
        start: State,
        settings: SimulationSettings,
        noise: np.random.Generator,
        margin_m: float,
    ) -> None:
        self.state: FloatArray = start.vector
        self.outputs: Mapping[str, float] = {}
        self.corrections = 0
        """Movements flown with corrected turn rates."""
        self._automaton = automaton
        self._settings = settings
        self._noise = noise
        self._margin_m = margin_m
        self._air = Air(settings.wind_mps, settings.gusts_mps, settings.seed)
        self._turn_rate = max(m.turn_rate_rps for m in automaton.movements)
        self._predicted = start.vector
        self._movement = automaton.movements[0]
        self._origin, self._steps = self.state, 0
        self._way: FloatArray = np.zeros((0, 6))
        """[steps, 6] states of the present movement, where nothing disturbs it."""
        self._led: LedWay | None = None
        self._mass = np.concatenate([start.position_m, np.zeros(6)])
        self._sum_mps2 = np.zeros(3)
        self._disturbed = (
            settings.state_noise_mps > 0.0
            or settings.input_noise > 0.0
            or settings.gusts_mps > 0.0
            or bool(np.any(settings.wind_mps))
        )

    def begin(self, movement: Movement) -> None:
        """Hold a movement, corrected if need be."""
        self._origin, self._steps = self.state, 0
        self._movement = self._correct(movement)
        self._way = np.zeros((0, 6))

    @property
    def lag_s(self) -> float:
        return max(LEAD_S) if self._disturbed else 0.0

    def follow(self, asked: Asked) -> None:
        """Be where a reference says: exactly, or, disturbed, as a mass that lags and has drag."""
        self._led = LedWay(asked, LEAD_S if self._disturbed else (0.0, 0.0))

    def step(self, duration_s: float) -> None:
        """Move on; steps of one movement are of one length."""
        if self._led is not None:
            self._follow(self._led, duration_s)
            return
        self._steps += 1
        if self._disturbed:
            self.state = self._carry(self.state, self._movement, duration_s)
            return
        if self._steps > len(self._way):
            steps = max(self._steps, round(self._movement.duration_s / duration_s))
            times = duration_s * np.arange(1, steps + 1)
            self._way = self._automaton.predict_each(self._origin, self._movement, times)
        self.state = self._way[self._steps - 1]

    def _follow(self, way: LedWay, duration_s: float) -> None:
        before, after = way.step(duration_s)
        place = after[:3]
        if self._disturbed:
            air = self._air.step(
                duration_s, float(np.linalg.norm(before[3:6])), self.state[2], self.state[5]
            )
            steps = max(1, round(duration_s / INNER_S))
            self._mass, self._sum_mps2 = fly_point_mass(
                self._mass,
                self._sum_mps2,
                before,
                after,
                air,
                MASS,
                LED,
                steps,
                duration_s / steps,
            )
            v = self._noise.uniform(-1.0, 1.0, 3) * self._settings.input_noise
            w = self._noise.uniform(-1.0, 1.0, 3) * self._settings.state_noise_mps
            self._mass[:3] += (w + v * np.linalg.norm(before[3:6])) * duration_s
            place = self._mass[:3]
        self.state = np.array([*place, 0.0, 0.0, after[9]])

    def _correct(self, movement: Movement) -> Movement:
        """The movement that brings the attitude back to what the chain of movements predicts.

        Attitude is predicted along the whole chain, position from where the movement begins: the
        next decision starts from the true position anyway.
        """
        state, predicted = self.state, self._predicted
        anchored = np.concatenate([state[:3], predicted[3:]])
        self._predicted = self._automaton.predict(anchored, movement)
        if state.tolist() == predicted.tolist():
            return movement
        radius = self._automaton.turning_radius_m
        error = prediction_error(state, predicted, radius if np.isfinite(radius) else 0.0)
        if not needs_correction(error, self._margin_m):
            return movement
        self.corrections += 1
        return correct_movement(self._automaton, movement, state, anchored)

    def _carry(self, state: FloatArray, movement: Movement, step: float) -> FloatArray:
        """The state [6] a step on."""
        v = self._noise.uniform(-1.0, 1.0, 3) * self._settings.input_noise
        inputs = movement.inputs
        noise = [v[0] * inputs[0], 0.0, v[1] * self._turn_rate, v[2] * self._turn_rate]
        # A rate of climb is held as well as the speed is.
        inputs = inputs + np.array([*noise, *(v[0] * inputs[4:])])
        moved = self._automaton.vehicle.advance(state, inputs, step)
        w = self._noise.uniform(-1.0, 1.0, 3) * self._settings.state_noise_mps
        air = self._air.step(step, movement.pace_mps, float(state[2]), float(state[5]))
        moved[:3] += (w + air) * step
        return moved
