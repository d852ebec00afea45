"""What ratings of cells came to: the table that makes the calibrated rating of the total one.

`python -m tools.reliability --fit` makes it of flights whose truth is known: docs/calibration.md.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray

CLASSES = ("clear", "near", "hidden", "traffic")
"""Of cells: seen, with nothing near; within the margin of evidence; mostly hidden; on the way of an
intruder. The last that is true of a cell counts."""
HIDDEN_BELOW = 0.5
"""Visibility of a cell that is mostly hidden."""
Knots = Mapping[str, tuple[tuple[float, float], ...]]
"""By class: a total rating, ascending, and the share of passages rated so that kept the margin."""


def classes_of(coated: BoolArray, visibility: FloatArray, intruder: FloatArray) -> IntArray:
    """[cells] number of each cell's class in `CLASSES`, from evidence [cells]."""
    number = np.where(coated, 1, 0)
    number = np.where(visibility < HIDDEN_BELOW, 2, number)
    return np.where(intruder > 0.0, 3, number)


@dataclass(frozen=True, slots=True)
class Calibration:
    """From a rating and a class of cell to what comes of it.

    Never falls as the rating rises, and stays within [0, 1]. Raises InputError for knots that would
    not.
    """

    knots: Knots

    def __post_init__(self) -> None:
        problems = []
        for name in CLASSES:
            table = np.array(self.knots.get(name, ()), dtype=np.float64)
            if table.ndim != 2 or table.shape[1:] != (2,) or not len(table):
                problems.append(f"{name}: must be pairs of a rating and a share")
            elif not (np.diff(table[:, 0]) > 0.0).all() or not (np.diff(table[:, 1]) >= 0.0).all():
                problems.append(f"{name}: ratings must rise, and shares must not fall")
            elif not (table >= 0.0).all() or not (table <= 1.0).all():
                problems.append(f"{name}: must be within 0 and 1")
        if problems:
            raise InputError("calibration", problems)

    def __call__(self, rating: FloatArray, classes: IntArray) -> FloatArray:
        """[cells] share of passages that keep the margin, in cells rated so; straight between
        knots."""
        came = np.empty_like(rating)
        for number, name in enumerate(CLASSES):
            of = classes == number
            if of.any():
                rated, share = zip(*self.knots[name], strict=True)
                came[of] = np.interp(rating[of], rated, share)
        return came


@cache
def calibration() -> Calibration:
    """The one that comes with clearway."""
    path = resources.files("clearway.avoidance.rate") / "calibration.json"
    told = json.loads(path.read_text(encoding="utf-8"))["knots"]
    return Calibration({name: tuple((x, y) for x, y in table) for name, table in told.items()})
