"""Colours that stand for something stay apart for the colour-blind.

Seen through the matrices of Machado, Oliveira and Fernandes (2009, doi 10.1109/TVCG.2009.113) for
whole dichromacy, and held against each other in CIELAB (CIE 15), where 2.3 is just noticeable.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from clearway.base.frames import FloatArray
from clearway.view.plot.style import OTHERS, OWN, SERIES

APART = 15.0
SEEN_BY = {
    "all cones": np.eye(3),
    "protanopes": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopes": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopes": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
XYZ_FROM_RGB = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
WHITE = np.array([0.95047, 1.0, 1.08883])


def linear(colour: str) -> FloatArray:
    """Linear RGB of #rrggbb."""
    share = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def lab(rgb: FloatArray) -> FloatArray:
    """CIELAB of linear RGB."""
    xyz = XYZ_FROM_RGB @ np.clip(rgb, 0.0, 1.0) / WHITE
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16.0) / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def least_apart(colours: tuple[str, ...], seen_by: str) -> float:
    seen = [lab(SEEN_BY[seen_by] @ linear(colour)) for colour in colours]
    return min(float(np.linalg.norm(one - other)) for one, other in combinations(seen, 2))


def test_what_is_known_to_be_confused_is_told() -> None:
    green_and_orange = ("#2ca02c", "#e08a00")
    assert least_apart(green_and_orange, "all cones") > 80.0
    assert least_apart(green_and_orange, "protanopes") < 6.0
    assert least_apart(("#ffffff", "#000000"), "deuteranopes") == pytest.approx(100.0, abs=0.1)


@pytest.mark.parametrize("seen_by", SEEN_BY)
@pytest.mark.parametrize("colours", [(OWN, *OTHERS), SERIES], ids=["planners", "series"])
def test_colours_are_apart_for_everybody(colours: tuple[str, ...], seen_by: str) -> None:
    assert least_apart(colours, seen_by) > APART
