"""Plants by name; those of users are `module:name`."""

from __future__ import annotations

from functools import partial

from clearway.base.frames import FloatArray
from clearway.base.variants import Variants
from clearway.sim.plants.air import Air
from clearway.sim.plants.movements import aeroplane_movements, quadrotor_movements
from clearway.sim.plants.plant import Plant, PlantKind, own_plant
from clearway.vehicle.copter import CopterLimits


def _quadrotor(state: FloatArray, speed_mps: float, air: Air) -> Plant:
    from clearway.sim.plants.quadrotor_plant import QuadrotorPlant

    return QuadrotorPlant(state, speed_mps, air)


def _c172x(state: FloatArray, speed_mps: float, air: Air) -> Plant:
    from clearway.sim.plants.c172 import C172Plant

    return C172Plant(state, speed_mps, air)


def _f450(state: FloatArray, speed_mps: float, air: Air) -> Plant:
    from clearway.sim.plants.f450 import F450Plant

    return F450Plant(state, speed_mps, air)


PLANTS: Variants[PlantKind] = Variants(
    "plant",
    {
        "quadrotor": PlantKind(
            "Six degrees of freedom, motor lag and drag, with the AscTec Hummingbird's data.",
            _quadrotor,
            quadrotor_movements,
            CopterLimits(10.0, 5.0),
        ),
        "c172x": PlantKind(
            "JSBSim's Cessna 172, held by loops of bank, climb, speed and slip (extra `plants`).",
            _c172x,
            aeroplane_movements,
        ),
        "F450": PlantKind(
            "JSBSim's F450 quadrotor; its rate loops led by velocity and tilt (extra `plants`).",
            _f450,
            partial(quadrotor_movements, speed_mps=3.0, duration_s=2.0),
            CopterLimits(5.0, 2.0, lag_s=0.25),
        ),
    },
    own_plant,
)
"""Plants by name; add one here."""
