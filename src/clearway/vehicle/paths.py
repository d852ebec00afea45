"""Where all movements of an automaton lead from one attitude, quickly enough for every decision."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats3
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray, world_from_body
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.model import PlaneModel, plane_advance

MovementPaths = Callable[[float, float], FloatArray]
"""(roll, pitch) -> [movements, samples, 6] states along each movement at equal times, the last at
its end, from the origin at yaw 0; what `MovementAutomaton.predict` says of them."""


def movement_paths(automaton: MovementAutomaton, samples: int) -> MovementPaths:
    """The quickest way to ask an automaton's predictor about every movement at once."""
    if automaton.classes is not None:
        return _by_classes(automaton.classes, samples)
    if automaton.table is not None:
        return _by_table(automaton, samples)
    if type(automaton.vehicle) is PlaneModel:
        return _by_plane_model(automaton, samples)
    return _by_prediction(automaton, samples)


def motion_depends_on_roll(automaton: MovementAutomaton) -> bool:
    """Whether roll may change where a movement leads; of the plane model (4.4) it does not."""
    if automaton.keeps_attitude:
        return False
    return automaton.table is not None or type(automaton.vehicle) is not PlaneModel


def _by_plane_model(automaton: MovementAutomaton, samples: int) -> MovementPaths:
    inputs = np.array([movement.inputs for movement in automaton.movements])
    durations = np.array([movement.duration_s for movement in automaton.movements])

    def paths(roll_rad: float, pitch_rad: float) -> FloatArray:
        return _plane_paths(inputs, durations, samples, float(roll_rad), float(pitch_rad))

    return paths


def _by_table(automaton: MovementAutomaton, samples: int) -> MovementPaths:
    level = _by_prediction(automaton, samples)(0.0, 0.0)

    def paths(roll_rad: float, pitch_rad: float) -> FloatArray:
        states = level.copy()
        states[..., :3] = level[..., :3] @ world_from_body([roll_rad, pitch_rad, 0.0]).T  # (4.14)
        states[..., 3:5] += [roll_rad, pitch_rad]  # (4.15)
        return states

    return paths


def _by_classes(classes: ClassTable, samples: int) -> MovementPaths:
    shares = np.arange(1, samples + 1) / samples
    along = classes.along_each(shares)
    known: dict[int, FloatArray] = {}

    def begin_in(at: int) -> FloatArray:
        states = np.zeros((len(classes.names), samples, 6))
        states[:, :, [0, 1, 2, 5]] = along[at]
        for m in range(len(classes.names)):
            states[m, :, 3] = classes.label_of(classes.after(at, m))
        return states

    def paths(roll_rad: float, pitch_rad: float) -> FloatArray:
        del pitch_rad
        at = classes.class_at(roll_rad)
        if at not in known:
            known[at] = begin_in(at)
        return known[at]

    return paths


def _by_prediction(automaton: MovementAutomaton, samples: int) -> MovementPaths:
    shares = np.arange(1, samples + 1) / samples

    def paths(roll_rad: float, pitch_rad: float) -> FloatArray:
        start = np.array([0.0, 0.0, 0.0, roll_rad, pitch_rad, 0.0])
        return np.array(
            [
                [automaton.predict(start, m, float(m.duration_s * share)) for share in shares]
                for m in automaton.movements
            ]
        )

    return paths


@compiled
def _plane_paths(
    inputs: Floats2, durations: Floats, samples: int, roll: float, pitch: float
) -> Floats3:
    states = np.empty((len(durations), samples, 6))
    start = (0.0, 0.0, 0.0, roll, pitch, 0.0)
    for m in range(len(durations)):
        held = (inputs[m, 0], inputs[m, 1], inputs[m, 2], inputs[m, 3])
        for s in range(samples):
            end = plane_advance(start, held, durations[m] * (s + 1) / samples)
            for axis in range(6):
                states[m, s, axis] = end[axis]
    return states
