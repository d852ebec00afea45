"""Blobs of gradient noise (Perlin, 1985): caves and floating islands, as maps of mockamap are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.peer_worlds.cells import boxes_of, ground_under
from clearway.sim.world_parts import MadeWorld, leg

BOX_M = (30.0, 20.0, 3.6)
"""Extent: ahead of the start, centred on the way across, and up from the ground."""
CELL_M = 0.4
WAVE_M = 2.5
"""From one random gradient to the next: 0.04 of a cell of 0.1 m, as mockamap sets it."""
FILL = 0.12
"""Share of the box that is filled."""
ROOM_M = 1.6
"""About start and goal, where nothing stands."""
FLOWN_M = (0.7, 2.9)
SIDE_M = 3.0
"""How far outside of the box start and goal lie."""


def perlin(seed: int, fill: float = FILL) -> MadeWorld:
    """Blobs of gradient noise in cells of 0.4 m that fill a share of a box."""
    rng = np.random.default_rng([seed, 66])
    shape = tuple(round(extent / CELL_M) for extent in BOX_M)
    axes = [CELL_M * np.arange(0.5, count) for count in shape]
    values = gradient_noise(rng, axes, WAVE_M)
    filled = values > np.quantile(values, 1.0 - fill)
    length, width, _ = BOX_M
    height = 0.5 * sum(FLOWN_M)
    start, goal = (-SIDE_M, 0.0, height), (length + SIDE_M, 0.0, height)
    parts = boxes_of(filled, (0.0, -0.5 * width, 0.0), CELL_M)
    parts.append(ground_under((0.0, -0.5 * width), (length, 0.5 * width)))
    mission = leg(f"perlin-{seed}", start, goal)
    corridor = 0.5 * width - ROOM_M
    return MadeWorld(ObstacleMap(parts), mission, FLOWN_M, corridor, smallest_object_m=CELL_M)


def gradient_noise(
    rng: np.random.Generator, axes: Sequence[FloatArray], wave_m: float
) -> FloatArray:
    """Return gradient noise [x, y, z] at the places of three axes: at each corner of a grid of
    `wave_m` a random gradient, and between corners what smooth weights make of them."""
    counts = [int(np.floor(axis[-1] / wave_m)) + 2 for axis in axes]
    gradients = rng.normal(size=(*counts, 3))
    gradients /= np.linalg.norm(gradients, axis=-1, keepdims=True)
    places = np.stack(np.meshgrid(*(axis / wave_m for axis in axes), indexing="ij"), axis=-1)
    corner = np.floor(places).astype(np.int64)
    within = places - corner
    # The weight 6 t^5 - 15 t^4 + 10 t^3 has no slope and no curvature at the corners.
    weight = within**3 * (within * (6.0 * within - 15.0) + 10.0)
    total = np.zeros(places.shape[:-1])
    for step in np.ndindex(2, 2, 2):
        at = corner + step
        gradient = gradients[at[..., 0], at[..., 1], at[..., 2]]
        share = np.prod(np.where(np.array(step) == 1, weight, 1.0 - weight), axis=-1)
        total += share * np.sum(gradient * (within - step), axis=-1)
    return total
