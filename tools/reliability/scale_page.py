"""Ratings by scale and sensor, from the flights that clearances are judged by."""

from __future__ import annotations

from typing import Any

import numpy as np

from clearway.avoidance.rate.calibration import CLASSES
from clearway.base.frames import FloatArray
from clearway.studies.reliability.bins import (
    BINS,
    Reliability,
    bin_ratings,
    calibration_error,
    reliability,
    stack_bins,
)
from clearway.studies.reliability.fit import fit_knots
from clearway.studies.reliability.record import CELLS, FITTED, PASSAGES, TRAJECTORIES
from tools.reliability.flights import counts_of
from tools.reliability.kept_flights import SCALES, SENSORS

KINDS = (CELLS, PASSAGES, TRAJECTORIES)
RATINGS = (FITTED, "calibrated")
DRAWS = 200
"""Of flights, for an interval."""
Row = dict[str, Any]


def rating_table(rows: list[Row]) -> str:
    """Return the table of ratings by scale and sensor, and of passages by a fit of their own."""
    lines = [
        f"{sum(row['rated'] for row in rows):,} decisions of {len(rows)} held-out flights, the "
        "first of every six. Intervals (95 %) draw flights anew.",
        "",
        "| scale | sensor | rating | decisions | true | mean rating | off by | Brier score |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    cells = [(scale, sensor) for scale in SCALES for sensor in SENSORS]
    groups = [[row for row in rows if (row["scale"], row["sensor"]) == cell] for cell in cells]
    for (scale, sensor), these in zip([*cells, ("all", "all")], [*groups, rows], strict=True):
        if these:
            lines += [f"| {scale} | {sensor} | {line} |" for line in _lines(these)]
    return "\n".join(lines)


def _lines(rows: list[Row]) -> list[str]:
    """Of one scale and sensor: kind, rating, decisions and figures."""
    decisions = sum(row["rated"] for row in rows)
    rated = {
        f"{kind}, `{name}`": stack_bins([counts_of(row, kind, name) for row in rows])
        for kind in KINDS
        for name in RATINGS
    }
    anew = _rated_anew(rows)
    if anew:
        rated[f"{PASSAGES}, fitted to other flights"] = stack_bins(anew)
    return [f"{label} | {decisions:,} | {_figures(counts)}" for label, counts in rated.items()]


def _figures(counts: FloatArray) -> str:
    found = reliability(counts)
    low, high = _error_interval(counts)
    brier_low, brier_high = found.interval
    return (
        f"{100 * found.came:.1f} % | {100 * _mean(found):.1f} % | {100 * found.error:.1f} % "
        f"({100 * low:.1f} to {100 * high:.1f}) | {found.brier:.4f} "
        f"({max(brier_low, 0.0):.4f} to {brier_high:.4f})"
    )


def _mean(found: Reliability) -> float:
    return float(sum(point.said * point.number for point in found.points) / found.number)


def _error_interval(counts: FloatArray) -> tuple[float, float]:
    """Of the expected calibration error, from counts [flights, BINS, 5]."""
    rng = np.random.default_rng(0)
    drawn = [
        calibration_error(counts[rng.integers(len(counts), size=len(counts))]) for _ in range(DRAWS)
    ]
    low, high = np.quantile(drawn, [0.025, 0.975])
    return float(low), float(high)


def _rated_anew(rows: list[Row]) -> list[FloatArray]:
    """Counts of passages as a table would rate them that the other half of the flights made."""
    found = []
    for half in (0, 1):
        others = [_by_class(row) for row in rows[1 - half :: 2]]
        if not others:
            return []
        total = sum(others, np.zeros((len(CLASSES), BINS, 5)))
        maps = [fit_knots(counts) if counts[:, 0].sum() else None for counts in total]
        for row in rows[half::2]:
            found.append(_rerated(_by_class(row), maps))
    return found


def _by_class(row: Row) -> FloatArray:
    """[classes, BINS, 5] passages of a flight by the rating that tables are functions of."""
    return np.stack([counts_of(row, name, FITTED) for name in CLASSES])


def _rerated(by_class: FloatArray, maps: list[FloatArray | None]) -> FloatArray:
    """[BINS, 5] of the passages, each bin rated as its class says at its mean rating."""
    out = np.zeros((BINS, 5))
    for counts, knots in zip(by_class, maps, strict=True):
        there = counts[:, 0] > 0
        number, good, said = counts[there, 0], counts[there, 1], counts[there, 2]
        rating = said / number
        if knots is not None:
            rating = np.interp(rating, knots[:, 0], knots[:, 1])
        sums = np.stack([number, good, rating * number, rating**2 * number, rating * good], axis=1)
        np.add.at(out, bin_ratings(rating), sums)
    return out
