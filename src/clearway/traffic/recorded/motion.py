"""Heights and climbs of recorded aircraft at any second, from what they report and how they fly."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.traffic.recorded.aircraft import Aircraft, height_step_m

CLIMB_WINDOW_S = 20.0
"""A climb that is not reported is the mean over so long, for altitudes come in steps."""
MOST_CLIMB_ERROR_MPS = 1.0
"""Fine steps allow a shorter window: the shortest in which a step causes no larger error."""
SHORTEST_WINDOW_S = 5.0
CLEAR_CLIMB_M = 50.0
"""Of a window: less says nothing about whether reported rates are right."""
MOST_OFF = 0.75
"""Reported rates that miss the climbs flown by more than this share of them are not believed."""


def believe_climbs(one: Aircraft) -> FloatArray:
    """[n] climbs as reported, m/s, NaN where they are not; all NaN where heights belie them.

    Some recorders write 0 for "unknown", or mistake the sign or the unit.
    """
    rate = one.vertical_rate_mps
    height = one.altitude_m
    use = np.flatnonzero(~np.isnan(rate) & ~np.isnan(height))
    time_s, rate_mps, height_m = one.time_s[use], rate[use], height[use]
    if len(use) < 2:
        return rate
    pieces = 0.5 * (rate_mps[1:] + rate_mps[:-1]) * np.diff(time_s)
    climbed = np.append(0.0, np.cumsum(pieces))
    then = np.searchsorted(time_s, time_s - CLIMB_WINDOW_S)
    flown, told = height_m - height_m[then], climbed - climbed[then]
    # Where the height stays, a climb that is reported has to show.
    scale = np.where(np.abs(flown) > CLEAR_CLIMB_M, np.abs(flown), np.abs(told))
    clear = scale > CLEAR_CLIMB_M
    off = np.abs(told - flown)[clear] / scale[clear]
    belied = len(off) > 0 and float(np.median(off)) > MOST_OFF
    return np.full_like(rate, np.nan) if belied else rate


def interpolate_heights(
    time_s: FloatArray, height_m: FloatArray, rate_mps: FloatArray, at_s: FloatArray, coast_s: float
) -> FloatArray:
    """[m] heights at times, of reports [n] of which some tell none.

    Straight between two that do, on with the climb for `coast_s` after one, and NaN elsewhere.
    """
    use = np.flatnonzero(~np.isnan(height_m))
    if not len(use):
        return np.full(len(at_s), np.nan)
    known_s, known_m = time_s[use], height_m[use]
    last = np.searchsorted(known_s, at_s, side="right") - 1
    after = np.minimum(last + 1, len(use) - 1)
    silence = known_s[after] - known_s[last]
    share = np.clip((at_s - known_s[last]) / np.where(silence > 0.0, silence, 1.0), 0.0, 1.0)
    between = known_m[last] + share * (known_m[after] - known_m[last])
    onward = known_m[last] + np.nan_to_num(rate_mps[use][last]) * (at_s - known_s[last])
    joined = (silence > 0.0) & (silence <= coast_s)
    fresh = (last >= 0) & (at_s - known_s[last] <= coast_s)
    return np.where(fresh, np.where(joined, between, onward), np.nan)


def estimate_climbs(
    one: Aircraft, rate_mps: FloatArray, at_s: FloatArray, coast_s: float
) -> FloatArray:
    """[m] climbs at times: as reported up to `coast_s` ago, else the mean of the window before."""
    use = np.flatnonzero(~np.isnan(rate_mps))
    told = np.full(len(at_s), np.nan)
    if len(use):
        known_s, known_mps = one.time_s[use], rate_mps[use]
        last = np.searchsorted(known_s, at_s, side="right") - 1
        first = np.maximum(last, 0)
        after = np.minimum(last + 1, len(use) - 1)
        silence = known_s[after] - known_s[first]
        share = np.clip((at_s - known_s[first]) / np.where(silence > 0.0, silence, 1.0), 0.0, 1.0)
        share = np.where((silence > 0.0) & (silence <= coast_s), share, 0.0)
        between = (1.0 - share) * known_mps[first] + share * known_mps[after]
        fresh = (last >= 0) & (at_s - known_s[first] <= coast_s)
        told = np.where(fresh, between, np.nan)
    return np.where(np.isnan(told), _mean_climbs(one, at_s, coast_s), told)


def _mean_climbs(one: Aircraft, at_s: FloatArray, coast_s: float) -> FloatArray:
    """[m] climbs by the heights of a window before; 0 where there are not two of a kind."""
    found = np.zeros(len(at_s))
    for height_m in (one.geometric_m, one.barometric_m):
        use = np.flatnonzero(~np.isnan(height_m))
        if len(use) < 2:
            continue
        window_s = height_step_m(height_m) / MOST_CLIMB_ERROR_MPS
        window_s = min(max(window_s, SHORTEST_WINDOW_S), CLIMB_WINDOW_S)
        known_s, known_m = one.time_s[use], height_m[use]
        last = np.searchsorted(known_s, at_s, side="right")
        last = np.minimum(last, len(use) - 1)
        first = np.minimum(np.searchsorted(known_s, known_s[last] - window_s), last - 1)
        first = np.maximum(first, 0)
        elapsed = known_s[last] - known_s[first]
        usable = (elapsed > 0.0) & (elapsed <= coast_s)
        usable &= np.abs(at_s - known_s[last]) <= coast_s
        climb = (known_m[last] - known_m[first]) / np.where(elapsed > 0.0, elapsed, 1.0)
        found = np.where(usable, climb, found)
    return found
