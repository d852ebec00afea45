"""A goal to which the route planner knows no way: after a while the vehicle stays, and says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.live.mission import Progress

FLIES_ON_S = 10.0
"""Time without a known way for which the goal is flown to all the same: more comes into view."""
STAYS_S = 30.0
"""Time for which it stays then, before it flies on once more; each time twice as long."""


def note_whether_closed(progress: Progress, now_s: float, *, is_known: bool) -> Progress:
    """Return the progress with whether no way leads to the goal.

    Parameters
    ----------
    progress
    now_s
    is_known
        Whether a way is known now.
    """
    if is_known:
        if progress.closed_s == -np.inf:
            return progress
        return replace(progress, closed=False, closed_s=-np.inf, tried=0)
    if progress.closed_s == -np.inf:
        return replace(progress, closed_s=now_s)
    since_s = now_s - progress.closed_s
    if progress.closed and since_s > STAYS_S * 2.0**progress.tried:
        return replace(progress, closed=False, closed_s=now_s, tried=progress.tried + 1)
    if not progress.closed and since_s > FLIES_ON_S:
        return replace(progress, closed=True, closed_s=now_s)
    return progress
