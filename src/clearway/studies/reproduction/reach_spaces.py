"""Figs. 6.3, 6.5, ..., 6.13 in words and numbers: what is left of the reach set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from clearway.base.frames import FloatArray
from clearway.studies.reproduction.intruder_cases import (
    MIDDLE_ROW,
    REACHABLE,
    Assessed,
    assess_intruder_alone,
    ends_left,
    model_cells,
)
from clearway.studies.reproduction.target import Findings, Measure

TOP_FIRST = (4, 3, 2, 1, 0)
UPPER = slice(4, None)
LOWER = slice(None, 3)
"""Columns of the paper's upper and lower part: left and right of the middle one."""


def measure_left_over(assessed: Assessed) -> tuple[Measure, ...]:
    """What the figure shows in numbers."""
    lost, passed = assessed.count_lost()
    return (
        Measure("cells of the middle layer with a trajectory", passed),
        Measure(f"of them with reachability below {REACHABLE:g}", lost),
        Measure("trajectories", len(assessed.rated)),
        Measure(
            f"of them rated {REACHABLE:g} or more",
            int(np.count_nonzero(assessed.rated >= REACHABLE)),
        ),
    )


def _least(values: FloatArray) -> float:
    """Of cells with a trajectory."""
    return float(np.nanmin(values))


def _last_layer(assessed: Assessed) -> Measure:
    return Measure(
        "least reachability in the middle layer from 9 to 10 m",
        _least(assessed.row_reachability()[-1]),
        1.0,
        "paper",
        1e-8,
    )


def _static_line(assessed: Assessed) -> Findings:
    lost, passed = assessed.count_lost()
    ahead = assessed.row_reachability()[-1]
    return Findings(
        claim="Red cells cannot be reached, green ones can. The green cells in front are "
        "reachable, because at least one trajectory leads there through unoccupied space.",
        ours=f"{lost} of {passed} cells of the middle layer with a trajectory are blocked, the "
        f"line's own and those behind it; {np.count_nonzero(ahead == 1.0)} cells in front, "
        "from 9 to 10 m, are free, reached above and below the line.",
        difference="",
        measures=(*measure_left_over(assessed), _last_layer(assessed)),
    )


def _time_line(assessed: Assessed) -> Findings:
    lost, passed = assessed.count_lost()
    return Findings(
        claim="Some cells of the middle layer have a lowered reachability in [0, 1]; the last "
        "layer is fully reachable, and the intruder can be avoided through the other layers.",
        ours=f"{lost} of {passed} cells of the middle layer are blocked: the one of fig. 6.4 and "
        "one behind it. From 9 to 10 m, and in all other layers, everything is reachable.",
        difference="Reachability is 0 or 1 and nothing between, as no cell of fig. 6.4 is pink.",
        measures=(*measure_left_over(assessed), _last_layer(assessed)),
    )


def _future_line(assessed: Assessed) -> Findings:
    before = assess_intruder_alone(model_cells("line", True)[0])
    left, right = ends_left(assessed)
    free = [
        tuple(float(np.mean(one.rated[side] == 1.0)) for side in (left, right))
        for one in (before, assessed)
    ]
    (left_before, right_before), (left_now, right_now) = free
    return Findings(
        claim="It is almost certain that the vehicle avoids the intruder from behind.",
        ours="Of the trajectories that end on the left, where the intruder comes from, "
        f"{left_now:.1%} are wholly free ({left_before:.1%} in fig. 6.5); of those on the right, "
        f"where it goes, {right_now:.1%} ({right_before:.1%}).",
        difference="Passing ahead costs more, and is not impossible: the rule turns the preference "
        f"to behind the intruder, but {right_now:.0%} of the trajectories ahead, above and below "
        "its line, cost nothing more.",
        measures=(
            *measure_left_over(assessed),
            Measure("share of free trajectories on the left", left_now),
            Measure("share of free trajectories on the right", right_now),
        ),
    )


def _time_body(assessed: Assessed) -> Findings:
    _, model = model_cells("body")
    assert model.indicator is not None
    whole = assess_intruder_alone(model.indicator)
    least = [_least(assessed.row_reachability(row)) for row in TOP_FIRST]
    lost, passed = assessed.count_lost()
    lost_little, _ = assessed.count_lost(MIDDLE_ROW + 1)
    lost_middle, _ = whole.count_lost()
    lost_beside, passed_beside = whole.count_lost(MIDDLE_ROW + 1)
    return Findings(
        claim="Layers 1 and 5 are completely reachable, parts of layers 2 and 4 are not, and the "
        "middle layer is almost completely unreachable.",
        ours=f"Least reachability by layer from the top: {_list(least)}; {lost} of {passed} "
        f"cells of the middle layer are below {REACHABLE:g}.",
        difference="Timed shares of volume, (5.5) with (6.10), cost much less than the text says: "
        f"layers 2 and 4 lose {lost_little or 'no'} cells, and {passed - lost} of {passed} in the "
        "middle layer stay reachable. The text fits the untimed indicator (5.13) better, which "
        "blocks "
        f"{lost_middle} of {passed} cells of the middle layer and {lost_beside} of {passed_beside} "
        "of layers 2 and 4 each.",
        measures=(
            *measure_left_over(assessed),
            Measure("least reachability in layer 1", least[0], 1.0, "paper", 1e-8),
            Measure("least reachability in layer 5", least[4], 1.0, "paper", 1e-8),
        ),
    )


def _spread_measures(assessed: Assessed) -> tuple[Measure, ...]:
    return (
        *measure_left_over(assessed),
        *(
            Measure(
                f"least reachability in layer {5 - row}", _least(assessed.row_reachability(row))
            )
            for row in TOP_FIRST
        ),
    )


def _static_spread(assessed: Assessed) -> Findings:
    least = [_least(assessed.row_reachability(row)) for row in TOP_FIRST]
    layer_2 = assessed.row_reachability(3)
    upper, lower = layer_2[:, UPPER], layer_2[:, LOWER]
    return Findings(
        claim="Reachability is lowered in the lower parts of layers 1 and 5 and significantly so "
        "in those of layers 2 and 4; their upper parts are safe. Layer 3 reflects fig. 6.10.",
        ours=f"Least reachability by layer from the top: {_list(least)}. Layer 2 has "
        f"{np.nanmean(lower):.3f} on average and {_least(lower):.3f} at least in its lower part, "
        f"{np.nanmean(upper):.3f} and {_least(upper):.3f} in its upper one.",
        difference="The two parts differ less than the text says: above and below the line the "
        "cone is thin on the left, where the intruder comes from, but many trajectories to there "
        "pass through the denser middle layer.",
        measures=_spread_measures(assessed),
    )


def _time_spread(assessed: Assessed) -> Findings:
    least = [_least(assessed.row_reachability(row)) for row in TOP_FIRST]
    return Findings(
        claim="As fig. 6.11, with the time taken into account.",
        ours=f"Least reachability by layer from the top: {_list(least)}; every trajectory "
        f"is rated {assessed.rated.min():.2f} or more.",
        difference="The printed caption says static uncertainty spread; the text of 6.3.6 says "
        "timed, as here.",
        measures=_spread_measures(assessed),
    )


def _list(values: list[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


REACH_SPACES: Mapping[str, Callable[[Assessed], Findings]] = MappingProxyType(
    {
        "6.3": _static_line,
        "6.5": _time_line,
        "6.7": _future_line,
        "6.9": _time_body,
        "6.11": _static_spread,
        "6.13": _time_spread,
    }
)
"""By the number of the figure."""
