"""How far a place looks through space that was seen to be free, direction by direction."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.sensors.observed.seen_space import SeenSpace, is_free


@compiled
def measure_sight(
    seen: SeenSpace, place: Floats, azimuths: Floats, radius: float, step: float, farthest: float
) -> Floats:
    """Return how far (m) a ball can move level from a place and stay in space seen to be free.

    azimuths: [n] directions (rad), world frame. step: distance between the places looked up, in
    metres. Nothing beyond the first place that was not seen counts.
    """
    reach = np.empty(len(azimuths))
    for n in range(len(azimuths)):
        along, aside = np.cos(azimuths[n]), np.sin(azimuths[n])
        free = 0.0
        while free + step <= farthest:
            away = free + step
            x, y = place[0] + along * away, place[1] + aside * away
            if not is_free(seen, x, y, place[2], radius):
                break
            free = away
        reach[n] = free
    return reach
