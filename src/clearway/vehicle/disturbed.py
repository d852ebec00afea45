"""Movements driven by disturbances (3.15), (3.20): inputs and drift that change while one is flown.

The automaton's movements are stationary: their inputs are constant. What really drives the vehicle
is the input function u: M x R -> R^4 of (3.15), and that of a disturbed flight changes with time:
the movement's inputs plus the input noise v(t), while the state is carried off by w(t).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import Trajectory
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.prediction import NoiseBounds


@dataclass(frozen=True)
class DisturbanceSample:
    """What disturbs at one time: v of (3.20) on the inputs, w as drift and error of attitude."""

    speed_mps: float = 0.0
    pitch_rate_rps: float = 0.0
    yaw_rate_rps: float = 0.0
    drift_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """World frame."""
    pitch_rad: float = 0.0
    """How far off the pitch is that the vehicle flies with."""
    yaw_rad: float = 0.0


Disturbance = Callable[[float], DisturbanceSample]
"""Time (s, of the buffer's clock) -> what disturbs then; the same for the same time."""
InputEvolution = Callable[[Movement, float], FloatArray]
"""u of (3.15): movement and time -> inputs (4.2), as many as the movement has."""


def stationary(movement: Movement, _time_s: float) -> FloatArray:
    """A stationary movement: its inputs at any time of it."""
    return movement.inputs


def disturb(disturbance: Disturbance) -> InputEvolution:
    """The input function (3.24) of movements under input noise: u + v(t), the speed not below 0."""

    def inputs(movement: Movement, time_s: float) -> FloatArray:
        v = disturbance(time_s)
        changed: FloatArray = movement.inputs
        changed[:4] += [v.speed_mps, 0.0, v.pitch_rate_rps, v.yaw_rate_rps]
        changed[0] = max(0.0, changed[0])
        return changed

    return inputs


def steady_wind(wind_mps: Sequence[float]) -> Disturbance:
    """Air that moves evenly; [3] m/s, world frame. Raises ClearwayError unless finite."""
    x, y, z = (float(part) for part in wind_mps)
    _finite("wind", x, y, z)
    sample = DisturbanceSample(drift_mps=(x, y, z))
    return lambda _time_s: sample


def gust(peak_mps: Sequence[float], start_s: float, duration_s: float) -> Disturbance:
    """The usual (1 - cos) gust: from nothing to its peak [3] and back within a duration.

    Raises ClearwayError for a duration that is not positive, or numbers that are not finite.
    """
    peak = np.array(peak_mps, dtype=np.float64)
    _finite("gust", *peak.tolist(), start_s, duration_s)
    if peak.shape != (3,) or not duration_s > 0.0:
        raise ClearwayError("gust: a peak of three numbers and a positive duration are needed")

    def at(time_s: float) -> DisturbanceSample:
        share = (time_s - start_s) / duration_s
        if not 0.0 < share < 1.0:
            return DisturbanceSample()
        x, y, z = (0.5 * (1.0 - np.cos(2.0 * np.pi * share)) * peak).tolist()
        return DisturbanceSample(drift_mps=(x, y, z))

    return at


def draw_bounded_noise(bounds: NoiseBounds, seed: int, hold_s: float = 0.1) -> Disturbance:
    """Noise within the bounds of (3.20), drawn anew every `hold_s`; a function of seed and time.

    Raises ClearwayError for a hold that is not positive.
    """
    if not (hold_s > 0.0 and np.isfinite(hold_s)):
        raise ClearwayError("bounded noise: a positive time to hold each draw is needed")

    def at(time_s: float) -> DisturbanceSample:
        number = int(np.floor(time_s / hold_s))
        rng = np.random.default_rng([seed, number & 0xFFFFFFFF, int(number < 0)])
        v = rng.uniform(-1.0, 1.0, 5)
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        x, y, z = (rng.uniform() * bounds.drift_mps * direction).tolist()
        return DisturbanceSample(
            speed_mps=float(v[0]) * bounds.speed_mps,
            pitch_rate_rps=float(v[1]) * bounds.pitch_rate_rps,
            yaw_rate_rps=float(v[2]) * bounds.yaw_rate_rps,
            drift_mps=(x, y, z),
            pitch_rad=float(v[3]) * bounds.pitch_rad,
            yaw_rad=float(v[4]) * bounds.yaw_rad,
        )

    return at


def add_disturbances(*disturbances: Disturbance) -> Disturbance:
    """Several disturbances at once: their sum."""

    def at(time_s: float) -> DisturbanceSample:
        samples = [disturbance(time_s) for disturbance in disturbances]
        x, y, z = (float(sum(sample.drift_mps[axis] for sample in samples)) for axis in range(3))
        return DisturbanceSample(
            speed_mps=sum(sample.speed_mps for sample in samples),
            pitch_rate_rps=sum(sample.pitch_rate_rps for sample in samples),
            yaw_rate_rps=sum(sample.yaw_rate_rps for sample in samples),
            drift_mps=(x, y, z),
            pitch_rad=sum(sample.pitch_rad for sample in samples),
            yaw_rad=sum(sample.yaw_rad for sample in samples),
        )

    return at


def fly_disturbed(
    automaton: MovementAutomaton,
    buffer: MovementBuffer,
    state: npt.ArrayLike,
    disturbance: Disturbance,
    step_s: float = 0.02,
) -> Trajectory:
    """The flight of a buffer under a disturbance, x' = g(x + w) + h(u + v): (3.20), (4.10).

    state: [6] at the buffer's start, world frame. What disturbs is held over steps of at most
    `step_s`, taken at their middle, and each step is flown exactly; without a disturbance this is
    the prediction (3.21). How far it may stray is `deviation_bound_m`. Raises ClearwayError for an
    automaton known by its table only, or a step that is not positive.
    """
    if automaton.table is not None:
        raise ClearwayError("a movement table tells nothing of other inputs: a model is needed")
    if not step_s > 0.0:
        raise ClearwayError("disturbed flight: the step must be positive")
    evolution = disturb(disturbance)
    at = np.array(state, dtype=np.float64)
    times, states = [buffer.start_s], [at]
    for entry in buffer.entries:
        steps = max(1, int(np.ceil(entry.duration_s / step_s * (1.0 - 1e-12))))
        step = entry.duration_s / steps
        for number in range(steps):
            middle = entry.start_s + (number + 0.5) * step
            now = disturbance(middle)
            off = np.array([0.0, 0.0, 0.0, 0.0, now.pitch_rad, now.yaw_rad])
            at = automaton.vehicle.advance(at + off, evolution(entry.movement, middle), step) - off
            at[:3] += np.array(now.drift_mps) * step
            times.append(entry.start_s + (number + 1) * step)
            states.append(at)
    return Trajectory(np.array(times), np.array(states), buffer.names)


def _finite(what: str, *numbers: float) -> None:
    if not np.all(np.isfinite(numbers)):
        raise ClearwayError(f"{what}: numbers must be finite")
