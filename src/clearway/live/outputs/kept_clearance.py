"""The clearance that a decision keeps until the next one, as a bound that holds with 95 %."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from clearway.avoidance.decision import Decision
from clearway.base.conformal import MISSES, SHARE, level_after, quantile_at
from clearway.live.outputs.kept_stretch import Predicted, measure_clearance, predict_clearance
from clearway.sensors import LidarSensor, RangeSensor

TABLE = Path(__file__).with_name("kept_clearance.json")
LEAST_SCALE_M = 0.005
"""What sampling of a path and of the truth takes."""
SEPARATOR = ", "
"""In names of groups."""
BEHIND_RAD = 0.75 * np.pi
"""A sensor looks all round whose beams go farther round than this, to either side."""
FLAT_RAD = np.radians(10.0)
"""Beams within a smaller angle of elevation are a ring: what is above or below is not seen."""


class SensorView(StrEnum):
    """How far round the sensors of a vehicle look."""

    ALL_ROUND = "all round"
    LEVEL = "level"
    """All round, but in one plane."""
    AHEAD = "ahead"


class ErrorShares(NamedTuple):
    """How far off predictions are, beside noise."""

    gap: float
    """Of half a beam spacing: a surface between two beams may be nearer than where they meet it."""
    stretch: float
    """Of the length flown: a vehicle strays from its plan, and paths from their chords."""


EDGES = ErrorShares(gap=0.4, stretch=0.02)
"""Edges between beams and hidden parts count more than noise, at any scale of beams."""
SHARES = {
    SensorView.ALL_ROUND: EDGES,
    SensorView.LEVEL: EDGES,
    # What lies beside it is missed however fine its beams.
    SensorView.AHEAD: ErrorShares(gap=0.1, stretch=0.005),
}


class KeptScores(NamedTuple):
    """Quantiles of scores, at `conformal.LEVELS`: the predicted clearance was too great by so many
    times its scale."""

    true: tuple[float, ...]
    """Beside the clearance that was truly kept."""
    measured: tuple[float, ...]
    """Beside the one that later scans showed: they do not see what was never seen."""


@cache
def read_scores(group: str) -> KeptScores:
    """What flights of the study showed: `python -m tools.reliability --of clearances --fit`."""
    told = json.loads(TABLE.read_text(encoding="utf-8"))["quantiles"][group]
    # Nothing bounds what too few scores tell of.
    true, measured = (
        tuple(math.inf if one is None else float(one) for one in told[name])
        for name in KeptScores._fields
    )
    return KeptScores(true, measured)


def group_of(view: SensorView, *, has_inertia: bool) -> str:
    """Name of the decisions that are calibrated together."""
    return f"{'inertia' if has_inertia else 'inertialess'}{SEPARATOR}{view}"


@dataclass(frozen=True, slots=True)
class KeptClearance:
    """A lower bound of the distance between body and obstacles until the next decision.

    >>> kept = KeptClearance(1.0, 0.02, 3.0, group_of(SensorView.ALL_ROUND, has_inertia=True))
    >>> 0.9 < kept.bound_m < kept.predicted_m
    True
    """

    predicted_m: float
    """As far as is known, up to `most_m`; unobserved space counts as free."""
    scale_m: float
    """How far off such predictions are, by what is declared of the sensor."""
    most_m: float
    """Clearances are told up to here."""
    group: str
    """Of decisions that are calibrated together."""
    level: float = MISSES
    """At which quantiles are taken: 1 - `SHARE`, or lower as the flight has learned."""

    @classmethod
    def of(
        cls, predicted: Predicted, range_sigma_m: float, group: str, level: float = MISSES
    ) -> KeptClearance:
        """Return the bound of a prediction, by sensors of this noise."""
        shares = SHARES[SensorView(group.split(SEPARATOR)[1])]
        by_sensor_m = range_sigma_m + shares.gap * predicted.gap_m
        scale_m = max(by_sensor_m + shares.stretch * predicted.stretch_m, LEAST_SCALE_M)
        return cls(predicted.clearance_m, scale_m, predicted.most_m, group, level)

    @property
    def bound_m(self) -> float:
        """The clearance that is kept with `SHARE`; 0 where nothing can be said."""
        return max(self._lower_m(read_scores(self.group).true), 0.0)

    def level_after(self, measured_m: float | None) -> float:
        """Return the level of the next bound, once later scans show what this one kept, if any."""
        if measured_m is None:
            return self.level
        expected_m = self._lower_m(read_scores(self.group).measured)
        return level_after(self.level, missed=expected_m > 0.0 and measured_m < expected_m)

    def _lower_m(self, quantiles: tuple[float, ...]) -> float:
        """The predicted clearance less a quantile, up to `most_m`."""
        lower_m = self.predicted_m - quantile_at(quantiles, self.level) * self.scale_m
        return min(lower_m, self.most_m)

    @property
    def in_words(self) -> str:
        """One line for the log and for people."""
        before = "before the next decision"
        if not self.bound_m:
            return f"no clearance is sure {before}"
        return f"nothing comes within {self.bound_m:.2f} m {before} ({100.0 * SHARE:.0f} % sure)"


def bound_clearance(
    now: Decision, view: SensorView, before: Decision | None, kept: KeptClearance | None
) -> KeptClearance:
    """Return the bound of a decision, at the level that the flight has learned up to it.

    before: the decision that was flown up to this one, if any; kept: the last bound of the flight.
    """
    found = now.found_again
    group = group_of(view, has_inertia=found.planner.automaton.has_inertia)
    level = MISSES
    if kept is not None:
        level = kept.level_after(None if before is None else measure_clearance(before, now))
    return KeptClearance.of(predict_clearance(now), found.situation.range_sigma_m, group, level)


def view_of(sensors: Iterable[RangeSensor]) -> SensorView:
    """Return how far round sensors look, by the one that looks farthest.

    A sensor of one's own that looks all round says so by an attribute `all_round`.
    """
    views = {_view(sensor) for sensor in sensors}
    return next(
        (view for view in (SensorView.ALL_ROUND, SensorView.LEVEL) if view in views),
        SensorView.AHEAD,
    )


def _view(sensor: RangeSensor) -> SensorView:
    if not isinstance(sensor, LidarSensor):
        return SensorView.ALL_ROUND if getattr(sensor, "all_round", False) else SensorView.AHEAD
    pattern = sensor.lidar.pattern
    if pattern.azimuth_rad.max() <= BEHIND_RAD or pattern.azimuth_rad.min() >= -BEHIND_RAD:
        return SensorView.AHEAD
    return SensorView.ALL_ROUND if np.ptp(pattern.elevation_rad) > FLAT_RAD else SensorView.LEVEL
