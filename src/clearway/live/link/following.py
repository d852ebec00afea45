"""Whether the vehicle does what it is told: by its own motion, and by what it says it flies to."""

from __future__ import annotations

from collections import deque

import numpy as np

from clearway.base.frames import FloatArray

WINDOW_S = 1.5
"""Of set-points that the motion is checked against."""
ANSWER_S = 0.5
"""What was told later than so long ago is not: a vehicle takes time to get going, and to turn."""
LEAST_ASKED = 0.5
"""Of the own speed, asked for on the whole."""
LEAST_GONE = 0.25
"""Of what was asked for, gone."""
KEPT_S = 3.0
"""Set-points are remembered for so long: what the vehicle says is late."""
ECHO_S = 1.0
"""Seconds at the own speed by which what it says it flies to may be off all set-points."""
STRANGE = 2
"""So many such in a row are no accident."""


class SetPointsFollowed:
    """Feed it with what is told and with where the vehicle is; ask `flaw`."""

    def __init__(self, speed_mps: float) -> None:
        self._speed_mps = speed_mps
        self._told: deque[tuple[float, FloatArray, FloatArray, FloatArray]] = deque()
        """Time, place and velocity reported, own position."""
        self._strange = 0

    def begin(self) -> None:
        """From now on: what was before says nothing."""
        self._told.clear()
        self._strange = 0

    def tell(
        self, time_s: float, place_m: FloatArray, velocity_mps: FloatArray, own_m: FloatArray
    ) -> None:
        """A set-point that was sent, and where the vehicle is."""
        self._told.append((time_s, place_m, velocity_mps, own_m))
        while self._told[0][0] < time_s - KEPT_S:
            self._told.popleft()

    def hear_target(self, place_m: FloatArray) -> None:
        """Where the vehicle says that it flies to."""
        if not self._told:
            return
        apart = min(float(np.linalg.norm(place_m - place)) for _, place, _, _ in self._told)
        self._strange = self._strange + 1 if apart > ECHO_S * self._speed_mps else 0

    @property
    def flaw(self) -> str | None:
        """Why it is not followed, as far as can be seen; None if all is well, or not known yet."""
        if self._strange >= STRANGE:
            return "the autopilot flies to another target"
        if not self._told:
            return None
        newest_s = self._told[-1][0]
        window = [told for told in self._told if told[0] >= newest_s - WINDOW_S - 1e-6]
        lasted = newest_s - window[0][0]
        if lasted < WINDOW_S - 0.25:
            return None
        times = np.minimum([time_s for time_s, *_ in window], newest_s - ANSWER_S)
        told = zip(np.diff(times), window, strict=False)
        asked = np.sum([s * velocity for s, (_, _, velocity, _) in told], axis=0)
        far = float(np.linalg.norm(asked))
        if far < LEAST_ASKED * self._speed_mps * lasted:
            return None
        gone = float((window[-1][3] - window[0][3]) @ asked) / far
        return None if gone >= LEAST_GONE * far else "the vehicle does not move as commanded"
