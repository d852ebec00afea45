"""The compiled look at candidates, as tests call it: by hazards, with whatever is left out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.hazards import Hazards
from clearway.avoidance.clear.loiter import NO_LOITER, LoiterCircles
from clearway.avoidance.clear.verify import Paths, Verification, first_clear_of
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray


class RoomPrice(NamedTuple):
    """What it costs candidates to have no room to circle early on their way."""

    cost_m: FloatArray
    """[candidates] their cost otherwise, ascending."""
    price_m: FloatArray
    """[candidates] the price; 0 for those that need no room."""


def first_clear(
    paths: Paths,
    candidates: IntArray,
    hazards: Hazards,
    margin_m: float,
    loiter: LoiterCircles = NO_LOITER,
    room_price: RoomPrice | None = None,
    known: FloatArray | None = None,
) -> Verification:
    """`verify.first_clear_of`, without a price and with nothing known where none is given."""
    price = room_price or RoomPrice(np.zeros(len(candidates)), np.zeros(len(candidates)))
    if known is None:
        known = np.full((len(paths.parent), 3), np.nan)
    return first_clear_of(
        paths,
        candidates,
        hazards.bins,
        hazards.shapes,
        hazards.moving,
        margin_m,
        loiter,
        price.cost_m,
        price.price_m,
        known,
    )
