"""Many intruders at once: what every decision works out for all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.traffic.intruder import Intruder


def seen_at(
    intruders: Sequence[Intruder], state: State, world_from_body: FloatArray
) -> list[Intruder]:
    """Each predicted to the time of a state (`Intruder.at`) and seen from it (`seen_from`).

    world_from_body: [3, 3] the state's rotation, worked out once.
    """
    if not intruders:
        return []
    velocity = np.array([i.velocity_mps for i in intruders])
    elapsed = np.array([state.time_s - i.time_s for i in intruders])
    place = np.array([i.position_m for i in intruders]) + velocity * elapsed[:, None]
    position = _turned(place - state.position_m, world_from_body)
    velocity = _turned(velocity, world_from_body)
    position.flags.writeable = velocity.flags.writeable = False
    std = np.hypot(
        [i.position_std_m for i in intruders],
        np.array([i.velocity_std_mps for i in intruders]) * elapsed,
    ).tolist()
    return [
        intruder.moved(position[n], velocity[n], std[n], state.time_s)
        for n, intruder in enumerate(intruders)
    ]


def _turned(vectors: FloatArray, world_from_body: FloatArray) -> FloatArray:
    """[n, 3] into the body frame; each alike, whatever other rows there are."""
    x, y, z = vectors[:, :1], vectors[:, 1:2], vectors[:, 2:]
    turned: FloatArray = x * world_from_body[0] + y * world_from_body[1] + z * world_from_body[2]
    return turned


def speeds_mps(intruders: Sequence[Intruder]) -> FloatArray:
    """[n]"""
    speeds: FloatArray = np.sqrt(np.square([i.velocity_mps for i in intruders]).sum(axis=1))
    return speeds


def spread_tangents(intruders: Sequence[Intruder]) -> FloatArray:
    """[n] of the wider spread: by tan, so that all of the stated spread is covered."""
    tangents: FloatArray = np.tan(np.array([i.spread_rad for i in intruders]).max(axis=1))
    return tangents


def deviations_m(
    intruders: Sequence[Intruder], elapsed_s: FloatArray, sigmas: float = 0.0
) -> FloatArray:
    """[n] how far from its straight path each may be after a while, [n] seconds of either sign.

    The wider of its spreads or what its acceleration bound allows, plus `sigmas` standard
    deviations of the predicted position.
    """
    elapsed = np.abs(elapsed_s)
    spread = spread_tangents(intruders) * speeds_mps(intruders) * elapsed
    bounds = np.array([max(i.acceleration_bound_mps2 or 0.0, i.manoeuvre_mps2) for i in intruders])
    velocity_std = np.array([i.velocity_std_mps for i in intruders])
    std = np.hypot([i.position_std_m for i in intruders], velocity_std * elapsed)
    deviations: FloatArray = np.maximum(spread, 0.5 * bounds * elapsed**2) + sigmas * std
    return deviations
