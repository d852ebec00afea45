"""How far own positions scatter, told by what each takes back of the one before.

An error of a place is taken back by the next one, so steps that follow each other turn against it.
What wind, gusts or a vehicle that lags add stays, and turns against nothing.
"""

from __future__ import annotations

import math

from clearway.base.frames import FloatArray, measure_length

MEMORY = 60.0
"""Steps over which it is averaged, about."""
FEWEST = 20
"""Steps before anything is reported: of as many, chance alone looks like a third of what varies."""


class OwnScatter:
    """Estimates the standard deviation of own positions, per axis.

    Parameters
    ----------
    most_m
        What lies farther off what was flown has jumped, which happens once.
    """

    def __init__(self, most_m: float = math.inf) -> None:
        self._most_m = most_m
        self._before: FloatArray | None = None
        self._steps, self._even, self._taken_back = 0, 0.0, 0.0
        self._drift: FloatArray | None = None

    def take(self, off_m: FloatArray | None) -> None:
        """Take how far [3] an own position lies off what was flown since the one before.

        None where that is not known: the next place is not checked against this one either.
        """
        if off_m is None or measure_length(off_m) > self._most_m:
            self._before = None
            return
        share = max(1.0 / MEMORY, 1.0 / (self._steps + 2))
        self._drift = off_m if self._drift is None else self._drift + share * (off_m - self._drift)
        beyond = off_m - self._drift
        if self._before is not None:
            self._steps += 1
            self._taken_back += share * (-float(beyond @ self._before) / 3.0 - self._taken_back)
        self._before = beyond

    @property
    def std_m(self) -> float:
        """Standard deviation in metres; 0 before enough places came."""
        return math.sqrt(max(self._taken_back, 0.0)) if self._steps >= FEWEST else 0.0
