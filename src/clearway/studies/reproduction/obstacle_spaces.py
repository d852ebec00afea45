"""Figs. 6.2, 6.4, ..., 6.12 in words and numbers: which cells the intruder may be met in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from clearway.base.frames import FloatArray
from clearway.studies.reproduction.intruder_cases import (
    Assessed,
    meet_at,
    model_cells,
    reach_set_of_6_3,
)
from clearway.studies.reproduction.target import Findings, Measure
from clearway.traffic import reach_set_vehicle_times

OUTER_ROWS = (4, 0)
RADIUS_OF_6_3_M = 2.0

Known = tuple[float | None, float | None, float | None]
"""Reference values of cells met, sum and largest."""

UNKNOWN: Known = (None, None, None)


def sum_measures(
    probability: FloatArray, known: Known = UNKNOWN, suffix: str = "", tolerance: float = 1e-8
) -> tuple[Measure, ...]:
    """How many cells are met, the sum of their probabilities, and the largest."""
    return (
        Measure(f"cells met{suffix}", int(np.count_nonzero(probability)), known[0]),
        Measure(f"sum{suffix}", float(probability.sum()), known[1], tolerance=tolerance),
        Measure(f"largest{suffix}", float(probability.max()), known[2], tolerance=tolerance),
    )


def _by_row(assessed: Assessed) -> list[FloatArray]:
    """[layers, columns] of each row, top first."""
    return [assessed.row(assessed.probability, row) for row in (4, 3, 2, 1, 0)]


def _static_line(assessed: Assessed) -> Findings:
    rated = assessed.rated
    middle = int(np.count_nonzero(assessed.row(assessed.probability)))
    return Findings(
        claim="The cells on the intruder's line are red, with probability 1, and so are the "
        "parts of trajectories in them. The line starts at the top of the grid.",
        ours=f"{middle} cells, all in the middle layer, each with probability 1; "
        f"{np.count_nonzero(rated == 0.0)} of {len(rated)} trajectories pass one of them.",
        difference="Only the start differs: [6, 8, 0] is outside the grid, at an azimuth of "
        "53 degrees where the field of view ends at 45, so the line enters the grid 2 s later.",
        measures=sum_measures(assessed.probability, (11, 11.0, 1.0)),
    )


def _time_line(assessed: Assessed) -> Findings:
    probability = assessed.probability
    own_times = reach_set_vehicle_times(reach_set_of_6_3())
    by_reach_set, _ = meet_at("line", True, 0.0, own_times)
    partly = int(np.count_nonzero((probability > 0.0) & (probability < 1.0)))
    i, j, k = np.unravel_index(int(probability.argmax()), assessed.reach_set.grid.shape)
    return Findings(
        claim="Not every probability is 1: for the times in the cells some are slightly lower "
        "(pink cells).",
        ours=f"{np.count_nonzero(probability)} cell is met, ({i}, {j}, {k}), with probability "
        f"{probability.max():g}: the intruder is in it all the while that the vehicle is that far "
        f"out, from {i} to {i + 1} s.",
        difference=f"{partly or 'No'} cells are pink. With the times of the reach set's own "
        "trajectories, (5.3) and (5.4), it is the same cell alone; pink ones need times of the "
        "vehicle that the paper does not state.",
        measures=(
            *sum_measures(probability, (1, 1.0, 1.0)),
            Measure("cells with a probability between 0 and 1", partly),
            Measure("cells met at the reach set's times", int(np.count_nonzero(by_reach_set))),
        ),
    )


def _future_line(assessed: Assessed) -> Findings:
    probability = assessed.probability
    printed, _ = model_cells("line", "future-printed")
    halves = int(np.count_nonzero(probability == 0.5))
    return Findings(
        claim="Against fig. 6.4, cells of future movement are new at the bottom of the "
        "intruder's line, so that it is avoided from behind.",
        ours=f"The cell of fig. 6.4 keeps its probability of 1, and {halves} cells below it, "
        "where the vehicle would come before the intruder is gone, get 0.5.",
        difference="(6.8) as printed cannot do this: its first branch is always 0, because who "
        "comes after the intruder has left does not meet it, and its second one halves real "
        f"conflicts too (sum {printed.sum():.3g}, largest {printed.max():.3g}). Read here as the "
        "larger of the timed probability and, where the vehicle comes first, half the untimed "
        "one.",
        measures=(
            *sum_measures(probability, (7, 4.0, 1.0)),
            *sum_measures(printed, (7, 3.5, 0.5), ", (6.8) as printed"),
        ),
    )


def _time_body(assessed: Assessed) -> Findings:
    probability = assessed.probability
    static, _ = model_cells("body")
    wide, _ = model_cells("body", True, RADIUS_OF_6_3_M)
    wide_static, _ = model_cells("body", False, RADIUS_OF_6_3_M)
    counts = [int(np.count_nonzero(row)) for row in _by_row(assessed)]
    outer = wide.reshape(assessed.reach_set.grid.shape)[:, :, OUTER_ROWS]
    return Findings(
        claim="Three balls of radius 1 m, one after another: nothing in layers 1 and 5, their "
        "tops and bottoms in layers 2 and 4, their middles in layer 3.",
        ours=f"{sum(counts)} cells, by layer from the top {', '.join(map(str, counts))}; the "
        f"fullest is filled to {probability.max():.3f}.",
        difference="Section 6.3 gives the body a radius of 2 m; with that, "
        f"{np.count_nonzero(outer)} cells of layers 1 and 5 would be met and "
        f"{np.count_nonzero(wide)} in all (sum {wide.sum():.3g}). The figure fits the 1 m of its "
        "own text only.",
        measures=(
            *sum_measures(probability, (18, 4.11593, 0.94709), tolerance=1e-3),
            *sum_measures(static, (71, 15.0028, 0.98659), ", untimed (6.10)", 1e-3),
            *sum_measures(wide_static, (137, 68.435, None), ", untimed, radius 2 m", 1e-3),
        ),
    )


def _static_spread(assessed: Assessed) -> Findings:
    probability = assessed.probability
    _, model = model_cells("spread")
    assert model.meeting is not None
    sums = [float(row.sum()) for row in _by_row(assessed)]
    outer = [assessed.row(probability, row)[:, 3:] for row in OUTER_ROWS]
    at = tuple(
        int(n) for n in np.unravel_index(probability.argmax(), assessed.reach_set.grid.shape)
    )
    return Findings(
        claim="The probability is concentrated where the intruder was detected, at the top, and "
        "thins out with the way flown; layers 2 and 4 have some at the bottom, layers 1 and 5 "
        "only a residue there.",
        ours=f"{np.count_nonzero(probability)} cells, the largest with {probability.max():.4g} in "
        f"the leftmost column, {at}; sums by layer from the top "
        f"{', '.join(f'{value:.3g}' for value in sums)}; cells of layers 1 and 5 outside the three "
        f"columns at the bottom: {sum(int(np.count_nonzero(row)) for row in outer)}.",
        difference="The shape is that of the paper. (5.31) is a mean over the time in which a cell "
        "can be met, and a cell that is only grazed gets that of its own instant: as the "
        "probability that the intruder's path meets the cell at all, the same cells sum to "
        f"{model.meeting.sum():.4g}.",
        measures=(
            *sum_measures(probability, (131, 6.58589, 0.542653), tolerance=1e-4),
            *sum_measures(model.meeting, (131, 11.9268, None), ", probability of meeting Q", 1e-3),
        ),
    )


def _time_spread(assessed: Assessed) -> Findings:
    probability = assessed.probability
    counts = [int(np.count_nonzero(row)) for row in _by_row(assessed)]
    return Findings(
        claim="As fig. 6.10, with the time taken into account, which reduces the obstacle space "
        "significantly.",
        ours=f"{sum(counts)} cells, by layer from the top {', '.join(map(str, counts))}, the "
        f"largest with {probability.max():.4g}.",
        difference="The printed caption says static uncertainty spread; the text of 6.3.6 and "
        "its flag tau = 1 say timed, as here.",
        measures=sum_measures(probability, (22, 0.78209, 0.193617), tolerance=1e-4),
    )


OBSTACLE_SPACES: Mapping[str, Callable[[Assessed], Findings]] = MappingProxyType(
    {
        "6.2": _static_line,
        "6.4": _time_line,
        "6.6": _future_line,
        "6.8": _time_body,
        "6.10": _static_spread,
        "6.12": _time_spread,
    }
)
"""By the number of the figure."""
