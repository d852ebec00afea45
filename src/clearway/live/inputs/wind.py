"""The wind, told by own state estimates: how far off they lie from where what was flown would have
led.

Whatever carries the vehicle evenly off its predictions counts, air above all. For a vehicle whose
loops hold its way over the ground nothing is left over, and that is right: its movements lead where
they are stated to lead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.situation import CALM
from clearway.base.arrays import Floats2
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, measure_length
from clearway.base.state import State

WINDOW_S = 10.0
"""Wind is what carried the vehicle for so long, and for the fewest steps at least."""
LEAST_S = 2.5
"""Before so much has been flown, nothing is stated."""
SURE = 4.0
"""Deviations that a wind must have to count: noise alone is no wind."""
LEAST_OF_SPEED = 0.03
"""Share of the own speed below which there is no wind."""
SURELY_LESS = 0.999
"""Share of a limit below which rounding does not reach it."""
FEWEST_STEPS = 3
"""Of a vehicle whose movements last long, own state estimates may come seconds apart."""


class Steps(NamedTuple):
    """What own state estimates told, one after the other: columns of the same length."""

    duration_s: FloatArray
    """[n] since the state before."""
    carried_m: FloatArray
    """[n, 3] how far a state lies off what was flown since, world frame."""
    position_std_m: FloatArray
    """[n] of the state."""
    wandering_m2: FloatArray
    """[n] variance that the step adds, by the attitude that was flown from and not known."""
    fastest_mps: FloatArray
    """[n] how fast that carried it."""


class _LatestSteps:
    """Rows of steps, to be added at the end and dropped at the front without building any anew."""

    def __init__(self) -> None:
        self._rows, self._first, self._end = np.empty((64, 7)), 0, 0
        self.lasts_s, self.fastest_mps = 0.0, 0.0
        """Of all that is there."""

    def __len__(self) -> int:
        return self._end - self._first

    @property
    def rows(self) -> FloatArray:
        """[n, 7] what is there: later ones are written behind it, or elsewhere."""
        return self._rows[self._first : self._end]

    def add(self, step: Sequence[float], window_s: float) -> None:
        """Add a step, and drop the first ones until all last no longer than a window, or few are
        left."""
        if self._end == len(self._rows):
            kept = self._rows[self._first : self._end]
            self._rows = np.empty((max(64, 2 * len(kept)), 7))
            self._rows[: len(kept)] = kept
            self._first, self._end = 0, len(kept)
        self._rows[self._end] = step
        self._end += 1
        latest = _latest_of(self._rows, self._first, self._end, window_s)
        self._first, self.lasts_s, self.fastest_mps = latest

    def clear(self) -> None:
        self._first, self.lasts_s, self.fastest_mps = self._end, 0.0, 0.0


@compiled
def _latest_of(rows: Floats2, first: int, end: int, window_s: float) -> tuple[int, float, float]:
    """The first row from which on they last no longer than a window or are few, for how long these
    last, and the fastest of them."""
    while True:
        lasts_s = 0.0
        for n in range(first, end):
            lasts_s += rows[n, 0]
        if not lasts_s > window_s or end - first <= FEWEST_STEPS:
            break
        first += 1
    fastest = 0.0
    for n in range(first, end):
        fastest = max(fastest, rows[n, 6])
    return first, lasts_s, fastest


def _columns(rows: FloatArray) -> Steps:
    return Steps(rows[:, 0], rows[:, 1:4], rows[:, 4], rows[:, 5], rows[:, 6])


class WindEstimate:
    """Estimates a wind that changes little in ten seconds: a line through how far the vehicle was
    carried off, fitted by least squares. What was reported before take-off counts until then.

    told_mps: [3] world frame. Raises ClearwayError unless finite.
    """

    def __init__(self, speed_mps: float, told_mps: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        told = np.array(told_mps, dtype=np.float64)
        if told.shape != (3,) or not np.all(np.isfinite(told)):
            raise ClearwayError(f"wind_mps: must be three finite numbers, got {told_mps}")
        told.setflags(write=False)
        self._speed_mps = speed_mps
        self.wind_mps = told
        """[3] world frame; the way that air, or whatever it is, carries the vehicle."""
        self._sigma_mps = 0.0
        self._unfitted: FloatArray | None = None  # Steps whose deviation nobody has asked for yet.
        self._latest = _LatestSteps()
        self._last_mps = CALM
        self._leap: tuple[float, ...] | None = None
        """The latest step, if it was no wind as known; it is, if the next tells the same."""

    @property
    def sigma_mps(self) -> float:
        """Standard deviation of each axis, as far as the noise that states declare tells."""
        if self._unfitted is not None:
            _, self._sigma_mps = line_through(_columns(self._unfitted))
            self._unfitted = None
        return self._sigma_mps

    @property
    def steps(self) -> Steps:
        """Of the latest window."""
        return _columns(self._latest.rows)

    def measure_unexplained_m(self, before: State, after: State, flown_m: FloatArray) -> float:
        """How far off an own state estimate lies that no wind explains, neither the present one nor
        that of the last step; arguments as of `take`."""
        x, y, z = (after.position_m - flown_m).tolist()
        duration = after.time_s - before.time_s
        off_m = []
        for wind in (self.wind_mps, self._last_mps):
            by_x, by_y, by_z = wind.tolist()
            beyond = (x - by_x * duration, y - by_y * duration, z - by_z * duration)
            off_m.append(math.sqrt(sum(each * each for each in beyond)))
        return min(off_m)

    def take(
        self, before: State, after: State, flown_m: FloatArray, *, jumped: bool = False
    ) -> None:
        """Take two own state estimates, one after the other, between which all that was flown is
        known.

        flown_m: [3] where, without any wind, it would have led from the first one. jumped: what
        lies between the two is no wind, unless the next ones tell the same.
        """
        duration = after.time_s - before.time_s
        if not duration > 0.0:
            return
        length = measure_length(flown_m - before.position_m)
        wandering = (length * before.attitude_std_rad) ** 2
        carried = after.position_m - flown_m
        last_mps = carried / duration
        fastest = measure_length(last_mps)
        step = (duration, *carried.tolist(), after.position_std_m, wandering, fastest)
        if jumped:
            self.forget()
            self._last_mps, self._leap = last_mps, step
            return
        same_mps = measure_length(last_mps - self._last_mps)
        if self._leap is not None and same_mps < measure_length(last_mps - self.wind_mps):
            self._latest.add(self._leap, WINDOW_S + 1e-6)
        self._last_mps, self._leap = last_mps, None
        self._latest.add(step, WINDOW_S + 1e-6)
        self._fit()

    def forget(self) -> None:
        """What was flown is not known, or the own position jumped: steps no longer belong
        together."""
        self._latest.clear()
        self._last_mps, self._leap = CALM, None

    def _fit(self) -> None:
        if self._latest.lasts_s < LEAST_S or len(self._latest) < FEWEST_STEPS:
            return
        least = LEAST_OF_SPEED * self._speed_mps
        # The line is no steeper than the steepest step.
        if self._latest.fastest_mps < SURELY_LESS * least:
            self.wind_mps, self._unfitted = CALM, self._latest.rows
            return
        self._unfitted = None
        slope, self._sigma_mps = line_through(self.steps)
        least = max(SURE * self._sigma_mps, least)
        slope.setflags(write=False)
        self.wind_mps = slope if measure_length(slope) > least else CALM


def line_through(steps: Steps) -> tuple[FloatArray, float]:
    """Slope [3] of the line through how far steps were carried off, and its deviation."""
    times = np.concatenate([[0.0], np.cumsum(steps.duration_s)])
    carried = np.concatenate([np.zeros((1, 3)), np.cumsum(steps.carried_m, axis=0)])
    away = times - times.mean()
    weight = away / float(away @ away)
    slope = weight @ carried
    stated = float(steps.position_std_m.max())
    residual = carried - carried.mean(axis=0) - away[:, None] * slope
    spread = float(np.sqrt(np.square(residual).sum(axis=0).max() / (len(times) - 2)))
    noise = max(stated, spread)
    # Gusts wander: what a step adds stays in all places after it.
    steps_m = np.diff(residual, axis=0)
    gusts = max(0.0, float(np.square(steps_m).mean(axis=0).max()) - 2.0 * stated**2)
    after = np.cumsum(weight[::-1])[::-1][1:]
    wandering = float(after**2 @ (gusts + steps.wandering_m2))
    return slope, float(np.sqrt(noise**2 * float(weight @ weight) + wandering))
