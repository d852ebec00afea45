"""What a map may say of a place on Earth: whatever format a feature comes from, it passes here."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clearway.base.errors import InputError
from clearway.io.maps.map_features import Disc, MapFeature, ParsedMap

LOWEST_GROUND_M = -500.0
HIGHEST_GROUND_M = 9_000.0
"""Of the ground, above sea level: the shore of the Dead Sea lies at -430 m, Everest at 8,849 m.
Many rasters write -9999, -32768 or 3.4e38 for no ground, unsaid."""
DEEPEST_M = -1_000.0
TOP_M = 100_000.0
"""Feet and tops of features, above whatever they are above: fill values such as -9999 and numbers
in a wrong unit lie outside, cellars and unlimited zones inside."""
LARGEST_RADIUS_M = 1e6
LARGEST_POINT_RADIUS_M = 1e5
"""Of what a mere point stands for, to which accuracies of its place are added."""
MOST_NAMED_FEATURES = 10
"""Features that an error names one by one."""


def feature_problem(feature: MapFeature, *, stands: bool = True) -> str | None:
    """Why a feature cannot be of this Earth; comparisons hold for NaN and infinities too.

    stands: on the ground, unlike a zone of the air. One that begins above all ground would hang in
    the air, out of the way of aircraft there.
    """
    for end, height in (("foot", feature.low), ("top", feature.high)):
        if not DEEPEST_M <= height.value_m <= TOP_M:
            return (
                f"{end} {height.value_m:g} m above {height.above} is not within "
                f"{DEEPEST_M:g} to {TOP_M:g} m"
            )
    if stands and feature.low.above != "ground" and feature.low.value_m > HIGHEST_GROUND_M:
        return (
            f"foot {feature.low.value_m:g} m above {feature.low.above} is higher than any ground, "
            f"{HIGHEST_GROUND_M:g} m"
        )
    outline = feature.outline
    if isinstance(outline, Disc):
        if not 0.0 < outline.radius_m <= LARGEST_RADIUS_M:
            return f"radius {outline.radius_m:g} m is not above 0 and at most {LARGEST_RADIUS_M:g}"
        places = np.array([[outline.latitude_deg, outline.longitude_deg]])
    else:
        places = np.concatenate(outline.rings)
    for name, values, limit in (
        ("latitude", places[:, 0], 90.0),
        ("longitude", places[:, 1], 360.0),
    ):
        if not np.all(np.abs(values) <= limit):
            worst = values[~(np.abs(values) <= limit)][0]
            return f"{name} {worst:g} is not within +-{limit:g} degrees"
    return None


def refuse_impossible(path: Path, parsed: ParsedMap) -> None:
    """Raise InputError naming the features of a file that cannot be of this Earth."""
    zones = (one for zone in parsed.zones for one in zone.features)
    problems = [
        f"{feature.name[:60] or 'a feature without a name'}: {problem}"
        for features, stands in ((parsed.features, True), (zones, False))
        for feature in features
        if (problem := feature_problem(feature, stands=stands)) is not None
    ]
    if problems:
        more = len(problems) - MOST_NAMED_FEATURES
        rest = [f"and {more} more"] if more > 0 else []
        raise InputError(str(path), [*problems[:MOST_NAMED_FEATURES], *rest])
