"""Spaces of 3.5 per cell: free, occupied, hidden, or partly each; and the accessible one (3.33)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray

WHOLE = 1.0 - 1e-9
"""A share from which on a cell counts as all of one kind."""


class SpaceClass(IntEnum):
    """What a cell is; the lower-case names are those of the machine-readable output."""

    FREE = 0
    OCCUPIED = 1
    HIDDEN = 2
    MIXED = 3


@dataclass(frozen=True, slots=True, eq=False)
class SpaceCells:
    """Shares of every cell, which add up to one, and the class that follows."""

    free: FloatArray
    """[cells] seen, and nothing there: the part of the accessible space S_A (3.33), def. 15."""
    occupied: FloatArray
    """[cells] where beams end, or what the map says of the part that no beam reaches."""
    hidden: FloatArray
    """[cells] behind occupied points or where no beam looks, and not on the map."""
    code: npt.NDArray[np.int8]
    """[cells] `SpaceClass`."""

    __repr__ = brief

    @property
    def accessible(self) -> BoolArray:
        """[cells] cells wholly in the accessible space: what reach sets may use."""
        return np.equal(self.code, SpaceClass.FREE)

    @property
    def names(self) -> list[str]:
        """[cells] "free", "occupied", "hidden" or "mixed"."""
        words = [kind.name.lower() for kind in SpaceClass]
        return [words[code] for code in self.code]


def classify_space(
    detected: FloatArray, visibility: FloatArray, map_base: FloatArray | None = None
) -> SpaceCells:
    """Space classes of cells from P_OD (5.38), P_V (5.47) and the map's share (5.53), [cells] each.

    Total probability: of the visible part, what returned is occupied and the rest is free; of the
    hidden part, what the map fills is occupied and the rest is unknown.
    """
    base = np.zeros_like(visibility) if map_base is None else map_base
    occupied_seen = np.minimum(detected, visibility)
    free = visibility - occupied_seen
    hidden = (1.0 - visibility) * (1.0 - base)
    occupied = occupied_seen + (1.0 - visibility) * base
    code = np.full(len(visibility), SpaceClass.MIXED, dtype=np.int8)
    for kind, share in (
        (SpaceClass.FREE, free),
        (SpaceClass.OCCUPIED, occupied),
        (SpaceClass.HIDDEN, hidden),
    ):
        code[share >= WHOLE] = kind
    return SpaceCells(free, occupied, hidden, code)
