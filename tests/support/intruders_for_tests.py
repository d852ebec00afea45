"""Random intruders of every kind that intersection models find hard."""

from __future__ import annotations

import numpy as np

from clearway.traffic import Intruder

KINDS = ("oblique", "vertical", "very fast", "head-on", "level", "re-entering", "apex inside")
RANGE_M = 10.0


def random_intruder(kind: str, seed: int) -> Intruder:
    """One that flies through a place in the usual field of view; the same seed, the same one."""
    rng = np.random.default_rng([seed, 5])
    azimuth, elevation = rng.uniform(-0.7, 0.7), rng.uniform(-0.45, 0.45)
    level = np.cos(elevation)
    sight = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
    place = rng.uniform(0.2, 0.95) * RANGE_M * sight
    way = rng.normal(size=3)
    before_m, speed = rng.uniform(0.2, 1.5) * RANGE_M, rng.uniform(0.3, 3.0)
    if kind == "vertical":
        way = np.array([0.0, 0.0, rng.choice([-1.0, 1.0])])
    elif kind == "very fast":
        before_m, speed = 10.0 * before_m, 100.0 * speed
    elif kind == "head-on":
        way = -sight
    elif kind == "level":
        way[2] = 0.0
    elif kind == "re-entering":
        place = np.array([rng.uniform(0.3, 0.6) * RANGE_M, 0.0, rng.uniform(-0.5, 0.5)])
        way = np.array([0.0, -1.0, rng.uniform(-0.05, 0.05)])
    elif kind == "apex inside":
        before_m = 0.0
    way /= np.linalg.norm(way)
    widest = 1.4 if seed % 4 == 3 else 0.5
    return Intruder(
        place - before_m * way,
        speed * way,
        spread_rad=rng.uniform(0.01, widest, 2),
        radius_m=rng.uniform(0.05, 0.25) * RANGE_M,
    )
