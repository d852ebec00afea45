"""What truly moves in the simulator: plants, the air that they fly in, and their loops."""

from clearway.sim.plants.air import Air
from clearway.sim.plants.plant import Plant, PlantKind
from clearway.sim.plants.registry import PLANTS

__all__ = ["PLANTS", "Air", "Plant", "PlantKind"]
