"""What a plan asks of the vehicle at a time: where to be, how fast, and how that changes.

An autopilot, or a plant of a simulation, follows a plan closely only if it is given velocity and
acceleration beside the position.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.inertialess import InertialessModel
from clearway.vehicle.model import PlaneModel
from clearway.vehicle.movement import Movement

NODES, WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(6))
"""Gauss's quadrature on an interval of length 1 about 0: exact to rounding for turns of 100
degrees."""
STEPS = 8
"""Parts of a movement over which differences are taken, where no model says more."""


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Position, velocity, acceleration, yaw and yaw rate; world frame, z up.

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> from clearway.vehicle.reference import Reference
    >>> copter = cw.MovementAutomaton.multirotor(speed_mps=6.0, acceleration_mps2=3.0)
    >>> asked = Reference.of(copter, np.zeros(6), copter["Accelerate"], 0.2)
    >>> asked.velocity_mps.round(3).tolist(), asked.acceleration_mps2.round(3).tolist()
    ([0.6, 0.0, 0.0], [3.0, 0.0, 0.0])
    """

    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray
    """[3]"""
    acceleration_mps2: FloatArray
    """[3]"""
    yaw_rad: float
    """Left positive from x."""
    yaw_rate_rps: float

    __repr__ = brief

    @classmethod
    def of(
        cls, automaton: MovementAutomaton, state: npt.ArrayLike, movement: Movement, into_s: float
    ) -> Reference:
        """Return what a movement asks at a time after its start.

        Parameters
        ----------
        automaton
            Of the vehicle.
        state
            [6] at the movement's start, as `MovementAutomaton.predict` takes it: a roll says the
            class of motion, where there are classes.
        movement
            One of the automaton.
        into_s
            Time since the movement's start; its start or end where it lies outside.

        Notes
        -----
        Of classes that are speeds, speed, rate of climb and course change evenly with time: exact.
        Of the plane model and the inertialess one, (4.3) and its derivative: exact. Of all others,
        differences over an eighth of the movement.
        """
        start = np.asarray(state, dtype=np.float64)
        into_s = min(max(float(into_s), 0.0), movement.duration_s)
        if automaton.classes is not None and automaton.classes.has_speeds:
            return cls(*_of_speeds(automaton.classes, start, movement, into_s))
        if automaton.table is None and type(automaton.vehicle) in (PlaneModel, InertialessModel):
            return cls(*_of_inputs(automaton, start, movement, into_s))
        return cls(*_of_differences(automaton, start, movement, into_s))


_Parts = tuple[FloatArray, FloatArray, FloatArray, float, float]


def _of_speeds(classes: ClassTable, start: FloatArray, movement: Movement, into_s: float) -> _Parts:
    at, index = classes.class_at(float(start[3])), classes.names.index(movement.name)
    end, lasts_s = classes.after(at, index), movement.duration_s
    speed, climb = float(classes.speed_mps[at]), float(classes.climb_mps[at])
    ahead_mps2 = (float(classes.speed_mps[end]) - speed) / lasts_s
    up_mps2 = (float(classes.climb_mps[end]) - climb) / lasts_s
    rate = float(classes.paths[at, index, -1, 3]) / lasts_s
    times = into_s * (0.5 + NODES)
    flown = (speed + ahead_mps2 * times) * WEIGHTS * into_s
    course = start[5] + rate * times
    way = (
        float(flown @ np.cos(course)),
        float(flown @ np.sin(course)),
        (climb + 0.5 * up_mps2 * into_s) * into_s,
    )
    now = speed + ahead_mps2 * into_s
    yaw = float(start[5]) + rate * into_s
    cosine, sine = float(np.cos(yaw)), float(np.sin(yaw))
    lateral_mps2 = now * rate
    return (
        start[:3] + way,
        np.array([now * cosine, now * sine, climb + up_mps2 * into_s]),
        np.array(
            [
                ahead_mps2 * cosine - lateral_mps2 * sine,
                ahead_mps2 * sine + lateral_mps2 * cosine,
                up_mps2,
            ]
        ),
        yaw,
        rate,
    )


def _of_inputs(
    automaton: MovementAutomaton, start: FloatArray, movement: Movement, into_s: float
) -> _Parts:
    there = automaton.predict(start, movement, into_s)
    level = type(automaton.vehicle) is InertialessModel
    pitch, yaw = (0.0 if level else float(there[4])), float(there[5])
    pitch_rate = 0.0 if level else movement.pitch_rate_rps
    sine_p, cosine_p = float(np.sin(pitch)), float(np.cos(pitch))
    sine_y, cosine_y = float(np.sin(yaw)), float(np.cos(yaw))
    speed, rate = movement.speed_mps, movement.yaw_rate_rps
    nose = np.array([cosine_p * cosine_y, cosine_p * sine_y, -sine_p])
    pitching = pitch_rate * np.array([-sine_p * cosine_y, -sine_p * sine_y, -cosine_p])
    turning = rate * np.array([-cosine_p * sine_y, cosine_p * cosine_y, 0.0])
    velocity = speed * nose + [0.0, 0.0, movement.climb_mps or 0.0]
    return there[:3], velocity, speed * (pitching + turning), yaw, rate


def _of_differences(
    automaton: MovementAutomaton, start: FloatArray, movement: Movement, into_s: float
) -> _Parts:
    step_s = movement.duration_s / STEPS
    middle_s = min(max(into_s, step_s), movement.duration_s - step_s)
    times = [middle_s - step_s, middle_s, middle_s + step_s]
    before, middle, after = automaton.predict_each(start, movement, times)
    acceleration = (after[:3] - 2.0 * middle[:3] + before[:3]) / step_s**2
    velocity = (after[:3] - before[:3]) / (2.0 * step_s) + acceleration * (into_s - middle_s)
    there = automaton.predict(start, movement, into_s)
    rate = float(after[5] - before[5]) / (2.0 * step_s)
    return there[:3], velocity, acceleration, float(there[5]), rate
