"""The time of the questions: who asks tells what time it is, and readings are checked against it.

A clock may be set. The system keeps a time of its own, which never runs back: told times are
shifted onto it, so that what is known keeps its age when the clock jumps. How much time passed
meanwhile nobody knows, so the own position is in doubt until an own state estimate by the new clock
comes.
"""

from __future__ import annotations

from collections import deque
from statistics import median

import numpy as np

SET_BACK = "clock: set back"
LEAPT = "clock: leapt ahead"
LONGEST_SILENCE_S = 30.0
"""A longer leap is a clock's: nobody leaves a vehicle in flight unasked for longer."""
STRIDES = 8
"""Times between questions by which a leap is known."""
FEWEST_STRIDES = 3
JITTER_S = 0.02
"""Questions of several callers may cross by so much."""
LEAP_S = 0.25
LATE = 2.0
"""Questions are late, or the clock leapt, where so many of the longest strides pass, and a bit."""


class Clock:
    """Own time from told time, and how far the two may be apart.

    mixed_s: after a jump, readings by the old clock may still come for so long.
    """

    def __init__(self, mixed_s: float) -> None:
        self._mixed_s = mixed_s
        self._offset_s = 0.0
        self._asked_s = -np.inf  # Own time of the last question.
        self._strides: deque[float] = deque(maxlen=STRIDES)
        self._stepped_back_s = 0.0
        self._doubt_s = 0.0
        self._doubted_until_s = -np.inf

    @property
    def shifted(self) -> bool:
        """Whether own and told times differ."""
        return self._offset_s != 0.0

    def own(self, told_s: float) -> float:
        """A told time in own time."""
        return told_s + self._offset_s if self._offset_s else told_s

    def to_stated(self, own_s: float) -> float:
        """An own time as it is reported."""
        return own_s - self._offset_s if self._offset_s else own_s

    def ask(self, told_s: float) -> tuple[float, str | None]:
        """Own time of a question, and what the clock did if it jumped far."""
        now, before = self.own(told_s), self._asked_s
        if before == -np.inf:
            self._asked_s = now
            return now, None
        step = now - before
        self._stepped_back_s = max(self._stepped_back_s, -step)
        if step < -JITTER_S:
            return self._set_back(-step), SET_BACK
        longest = max(self._strides, default=np.inf)
        leapt = step > max(LONGEST_SILENCE_S, LATE * longest if self._strides else 0.0)
        late = len(self._strides) >= FEWEST_STRIDES and step > LATE * longest + LEAP_S
        if leapt:
            self._offset_s -= step - LONGEST_SILENCE_S
            now = before + LONGEST_SILENCE_S
        if leapt or late:
            usual = self._usual_s
            self._doubt(min(step, LONGEST_SILENCE_S) - usual, before + usual)
        elif step > 0.0:
            self._strides.append(step)
        self._asked_s = max(now, before)
        return self._asked_s, LEAPT if leapt else None

    def _set_back(self, back_s: float) -> float:
        """Go on as if the usual time had passed since the last question."""
        before, usual = self._asked_s, self._usual_s
        self._offset_s += back_s + usual
        mixed = back_s <= self._mixed_s
        self._doubt(usual + (back_s if mixed else self._mixed_s), before + (usual + back_s) * mixed)
        self._asked_s = before + usual
        return self._asked_s

    def _doubt(self, by_s: float, until_s: float) -> None:
        self._doubt_s = max(self._doubt_s, by_s)
        self._doubted_until_s = max(self._doubted_until_s, until_s)

    @property
    def _usual_s(self) -> float:
        return float(median(self._strides)) if self._strides else 0.0

    def settle(self, state_s: float) -> None:
        """An own state estimate of an own time ends the doubt if only the new clock can have told
        it."""
        if state_s > self._doubted_until_s:
            self._doubt_s, self._doubted_until_s, self._stepped_back_s = 0.0, -np.inf, 0.0

    @property
    def in_doubt(self) -> bool:
        """Whether the clock jumped, and no own state estimate has come by the new one."""
        return self._doubt_s > 0.0

    @property
    def doubt_s(self) -> float:
        """How far own time and that of the vehicle's movements may be apart."""
        return max(self._doubt_s, self._stepped_back_s)
