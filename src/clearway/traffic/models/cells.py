"""What an intersection model says of every cell, for many intruders at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from clearway.base.arrays import Floats2
from clearway.base.brief import brief
from clearway.base.frames import FloatArray

Accuracy = Literal["fast", "fine", "reference"]
"""Fast in flight, fine where a moment is looked at, or a slow reference that both are held to."""


class ModelArrays(NamedTuple):
    """One model for n intruders as compiled loops fill it; all arrays are [n, cells]."""

    probability: Floats2
    entry_s: Floats2
    leave_s: Floats2
    dwell_s: Floats2


@dataclass(frozen=True, slots=True, eq=False)
class ModelCells:
    """One model for n intruders; arrays are [n, cells], or [cells] after `of`.

    Times count from the decision time. A cell that is not met has probability 0, dwell 0 and NaN
    for entry and leave.
    """

    probability: FloatArray
    """Base probability P_T of meeting the intruder in the cell, whatever the time."""
    entry_s: FloatArray
    """First time in the cell, i_e."""
    leave_s: FloatArray
    """Last time in the cell, i_l; inf where the intruder stands still."""
    dwell_s: FloatArray
    """Time in the cell, less than leave - entry where it is left and entered again; of a spread
    the expected time."""
    indicator: FloatArray | None = None
    """Body alone: 1 where the body touches the cell at any time (5.13)."""
    meeting: FloatArray | None = None
    """Spread alone: Q, the probability that the intruder's ray meets the cell at any time."""
    timed: FloatArray | None = None
    """Probability by the timed rule; None without vehicle times."""

    __repr__ = brief

    def of(self, intruder: int) -> ModelCells:
        """The same of one intruder."""
        return ModelCells(
            self.probability[intruder],
            self.entry_s[intruder],
            self.leave_s[intruder],
            self.dwell_s[intruder],
            None if self.indicator is None else self.indicator[intruder],
            None if self.meeting is None else self.meeting[intruder],
            None if self.timed is None else self.timed[intruder],
        )


def empty_arrays(intruders: int, cells: int) -> ModelArrays:
    """No cell met."""
    shape = (intruders, cells)
    return ModelArrays(
        np.zeros(shape), np.full(shape, np.nan), np.full(shape, np.nan), np.zeros(shape)
    )
