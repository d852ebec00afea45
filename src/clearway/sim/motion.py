"""How the simulated vehicle truly moves: movement by movement, in steps, disturbed (3.20)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.sim.settings import SimulationSettings
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.prediction import corrected_movement, needs_correction, prediction_error


class TrueMotion:
    """The track flown up to now.

    Bounded disturbances act on the state's rates (w) and on the inputs (v) of (3.20); margin_m is
    what prediction errors may take their share of (4.2.2).
    """

    def __init__(
        self,
        automaton: MovementAutomaton,
        start: State,
        settings: SimulationSettings,
        noise: np.random.Generator,
        margin_m: float,
    ) -> None:
        self.times = [start.time_s]
        self.states = [start.vector]
        """Each [6], world frame."""
        self.movements: list[str] = []
        self.corrections = 0
        """Movements flown with corrected turn rates."""
        self._automaton = automaton
        self._settings = settings
        self._noise = noise
        self._margin_m = margin_m
        self._wind_mps = np.array(settings.wind_mps)
        self._turn_rate = max(m.turn_rate_rps for m in automaton.movements)
        self._predicted = start.vector

    @property
    def now_s(self) -> float:
        return self.times[-1]

    @property
    def state(self) -> State:
        """Where the vehicle truly is."""
        return State(self.states[-1][:3], self.states[-1][3:], self.times[-1])

    def at(self, time_s: float) -> State:
        """Where it truly was at the first step from a time on."""
        n = min(int(np.searchsorted(self.times, time_s - 1e-9)), len(self.states) - 1)
        return State(self.states[n][:3], self.states[n][3:], self.times[n])

    def fly(self, movement: Movement) -> Iterator[None]:
        """Execute one movement, step by step; whoever iterates may stop it in the middle."""
        settings = self._settings
        steps = int(np.ceil(movement.duration_s / settings.step_s - 1e-9))
        step = movement.duration_s / steps
        self.movements.append(movement.name)
        start, origin = self.times[-1], self.states[-1]
        movement = self._corrected(movement)
        disturbed = (
            settings.state_noise_mps > 0.0 or settings.input_noise > 0.0 or self._wind_mps.any()
        )
        for number in range(1, steps + 1):
            if disturbed:
                state = self._disturbed(self.states[-1], movement, step)
            else:
                state = self._automaton.predict(origin, movement, number * step)
            self.states.append(state)
            self.times.append(start + number * step)
            yield

    def _corrected(self, movement: Movement) -> Movement:
        """The movement that brings the attitude back to what the chain of movements predicts.

        Attitude is predicted along the whole chain, position from where the movement begins: the
        next decision starts from the true position anyway.
        """
        state, predicted = self.states[-1], self._predicted
        anchored = np.concatenate([state[:3], predicted[3:]])
        self._predicted = self._automaton.predict(anchored, movement)
        radius = self._automaton.turning_radius_m
        error = prediction_error(state, predicted, radius if np.isfinite(radius) else 0.0)
        if not needs_correction(error, self._margin_m):
            return movement
        self.corrections += 1
        return corrected_movement(self._automaton, movement, state, anchored)

    def _disturbed(self, state: FloatArray, movement: Movement, step: float) -> FloatArray:
        """The state [6] a step on."""
        v = self._noise.uniform(-1.0, 1.0, 3) * self._settings.input_noise
        inputs = movement.inputs
        noise = [v[0] * inputs[0], 0.0, v[1] * self._turn_rate, v[2] * self._turn_rate]
        # A rate of climb is held as well as the speed is.
        inputs = inputs + np.array([*noise, *(v[0] * inputs[4:])])
        moved = self._automaton.vehicle.advance(state, inputs, step)
        w = self._noise.uniform(-1.0, 1.0, 3) * self._settings.state_noise_mps
        moved[:3] += (w + self._wind_mps) * step
        return moved
