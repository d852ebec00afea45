"""What a vehicle's program is told: readings, and what the caller alone knows.

Data that cannot be used are counted by reason in `counts`, never silently lost.
"""

from __future__ import annotations

import math
from typing import Any

from clearway.base.checks import LARGEST, number_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.live.inputs.readings import Reading
from clearway.live.knowledge import Knowledge


class Listener:
    """Takes readings for whatever decides on them."""

    def __init__(self, known: Knowledge) -> None:
        self._known = known
        self.counts = known.counts
        """Data left out, by reason."""

    @property
    def floor_m(self) -> float:
        """Height of the world that nothing leads below; the caller may set it, -inf for
        none. Raises ClearwayError for what is no height."""
        return self._known.floor_m

    @floor_m.setter
    def floor_m(self, height_m: float) -> None:
        self._known.floor_m = _height_or_none("floor_m", height_m)

    def receive(self, kind: type[Reading], *values: Any, **named: Any) -> bool:
        """Make a reading of raw values and take it, as `update` does.

        For values that are not checked yet: what a State, Scan or Intruder refuses to be made of
        is counted by what is wrong with it, where making it oneself would raise.

        Parameters
        ----------
        kind
            What to make: `State`, `Scan` or `Intruder`.
        *values
            Its arguments by place.
        **named
            Its arguments by name.

        Returns
        -------
        bool
            Whether the reading could be made.
        """
        return self._known.receive(kind, *values, **named)

    def update(self, reading: Reading) -> None:
        """Take one reading; what cannot be used is counted by reason.

        What no time makes right is counted at once, the rest when the next question tells the time.

        Parameters
        ----------
        reading
            Own state estimate, scan or intruder, as reported.

        Raises
        ------
        ClearwayError
            For what is no reading at all.
        """
        self._known.put(reading)

    def catch_up(self, now_s: float) -> None:
        """Take in what has come, checked against the time; every question does so itself.

        A caller with time before the next question saves that one the work of a scan.

        Parameters
        ----------
        now_s
            The present time, on the clock of the readings.

        Raises
        ------
        ClearwayError
            For what is no time.
        """
        self._known.catch_up(now_s)

    @property
    def trust(self) -> dict[str, float]:
        """Present trust by sensor; what is not believed at all is at 0."""
        return self._known.sensing.trust

    def begin_at(self, place_m: FloatArray) -> None:
        """Take a place for the start, where the vehicle is handed over elsewhere.

        The ball about it counts as seen to be free, as far as nothing was seen to stand in it.

        Parameters
        ----------
        place_m
            [3] world frame.

        Raises
        ------
        ClearwayError
            For what is no such place.
        """
        self._known.sensing.begin_at(place_m)

    def forget_free_space(self) -> None:
        """Count nothing as seen to be free any more: the own position has jumped."""
        self._known.sensing.forget_free_space()


def _height_or_none(name: str, height_m: float) -> float:
    """A height of the world, or -inf for none; raises ClearwayError for anything else."""
    if number_problem(name, height_m, -math.inf):
        raise ClearwayError(
            f"{name}: must be a number up to {LARGEST:g}, or -inf for none, got {height_m}"
        )
    return float(height_m)
