"""Clearances until the next decision: as stated, as measured by scans, and as they were."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from clearway.avoidance import Decision
from clearway.base.conformal import quantile_table
from clearway.live.mission import Progress
from clearway.live.outputs.kept_clearance import KeptClearance
from clearway.live.outputs.kept_stretch import TOLERANCE_S, measure_clearance, moves
from clearway.sim import LoggedDecision, Run
from clearway.studies.reliability.bins import share_by_flights

TIE = 0.25
"""Of the scale: what scans show to be nearer by less than that shows nothing."""


class Kept(NamedTuple):
    """What one decision stated, and what came of it."""

    stated: KeptClearance
    measured_m: float | None
    """By the next decision; None where there was none."""
    true_m: float
    """Between the body and the nearest surface, obstacle or intruder, until the next decision."""

    @property
    def held(self) -> bool:
        """Whether the bound was kept."""
        return self.stated.bound_m <= self.true_m


class KeptWatch:
    """Looks at every decision when it is taken, since past ones do not keep their returns."""

    def __init__(self) -> None:
        self._last: Decision | None = None
        self._stated: list[KeptClearance] = []
        self._measured: list[float | None] = []
        self._begins_s: list[float] = []
        self._moves: list[bool] = []

    def __call__(self, entry: LoggedDecision[Any], progress: Progress) -> None:
        """Take a decision: `on_decision` of a flight."""
        del progress
        decision, stated = entry.flight.decision, entry.flight.kept
        if self._last is not None:
            self._measured.append(measure_clearance(self._last, decision))
        self._stated.append(stated)
        self._begins_s.append(decision.state.time_s)
        self._moves.append(moves(decision))
        self._last = decision

    def list_kept(self, run: Run[Any]) -> list[Kept]:
        """All decisions of the flight that took effect and moved the vehicle, in order.

        One that stays repeats one error as often as it decides.
        """
        away_m = run.nearest_surface_m - run.body_radius_m
        ends_s = [*self._begins_s[1:], float(run.time_s[-1])]
        each = zip(
            self._stated, [*self._measured, None], self._begins_s, ends_s, self._moves, strict=True
        )
        rows = []
        for stated, measured_m, begins_s, end_s, moved in each:
            inside = (run.time_s >= begins_s - TOLERANCE_S) & (run.time_s <= end_s + TOLERANCE_S)
            if moved and end_s > begins_s + TOLERANCE_S and inside.any():
                rows.append(Kept(stated, measured_m, float(away_m[inside].min())))
        return rows


class HeldShare(NamedTuple):
    """How often bounds held; flights are independent, decisions of one are not."""

    share: float
    low: float
    """Of the 95 % interval."""
    high: float

    @classmethod
    def of(cls, flights: Iterable[Sequence[bool]]) -> HeldShare:
        """Of whether each bound of each flight held."""
        there = [each for each in flights if len(each)]
        if not there:
            return cls(float("nan"), 0.0, 1.0)
        counts = np.array([(sum(each), len(each)) for each in there], dtype=float)
        return cls(*share_by_flights(counts[:, 0], counts[:, 1]))


def fit_scores(decisions: Iterable[Kept]) -> dict[str, dict[str, tuple[float, ...]]]:
    """Quantiles of the scores of all decisions, by group, beside the truth and beside scans."""
    true, measured = defaultdict(list), defaultdict(list)
    for one in decisions:
        stated = one.stated
        true[stated.group].append((stated.predicted_m - one.true_m) / stated.scale_m)
        if one.measured_m is not None:
            measured[stated.group].append((stated.predicted_m - one.measured_m) / stated.scale_m)
    return {
        group: {
            "true": quantile_table(scores),
            "measured": tuple(max(one, TIE) for one in quantile_table(measured[group])),
        }
        for group, scores in sorted(true.items())
    }
