"""When the positions of an aircraft were true, where their age is known to a second only.

A report tells where the aircraft was some time before it came: up to a second more than it says.
Of an aircraft that flies straight on at the speed it tells, every position says when it was at all
the others, so the one that came soonest dates them all: as with clocks, the least delay counts.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from clearway.base.frames import FloatArray

AGE_STEP_S = 1.0
"""Ages are told in whole seconds: what is told may be so much too young."""
KEPT_S = 15.0
"""How long reports date each other."""
MOST = 20
"""Reports that date each other, at most."""
ASIDE_SHARE = 0.15
"""Reports off the straight way by more than this share of the way between date nothing."""
SLOWEST_MPS = 2.0
"""What is slower is dated by each report alone: an age does not move it."""


class ReportTimes:
    """The reports of one aircraft."""

    def __init__(self) -> None:
        self._heard: deque[tuple[float, FloatArray]] = deque(maxlen=MOST)

    def take(
        self, told_s: float, place_m: FloatArray, velocity_mps: FloatArray
    ) -> tuple[float, float]:
        """When a position was true, and by how much that may be off, either way.

        told_s: at the latest, by the age that is told.
        """
        speed = float(np.linalg.norm(velocity_mps))
        while self._heard and told_s - self._heard[0][0] > KEPT_S:
            self._heard.popleft()
        if speed < SLOWEST_MPS:
            self._heard.clear()
            self._heard.append((told_s, place_m))
            return told_s, 0.0
        along = velocity_mps / speed
        dated = [told_s]
        kept = []
        for when_s, where in self._heard:
            way = place_m - where
            straight = float(way @ along)
            aside = float(np.linalg.norm(way - straight * along))
            later_s = straight / speed
            fits = -AGE_STEP_S <= told_s - when_s - later_s <= AGE_STEP_S
            if straight >= 0.0 and aside <= ASIDE_SHARE * straight + 1.0 and fits:
                dated.append(when_s + later_s)
                kept.append((when_s, where))
        if len(kept) < len(self._heard):
            # It has turned, or changed its speed: older reports say nothing of it any more.
            self._heard = deque(kept[-1:] if len(kept) < 2 else kept, maxlen=MOST)
        self._heard.append((told_s, place_m))
        # The soonest of n that are each late by up to 1 s: by 1 / (n + 1) on the average.
        late_s = AGE_STEP_S if len(dated) == 1 else 2.0 * AGE_STEP_S / (len(dated) + 1)
        return min(dated) - 0.5 * late_s, 0.5 * late_s
