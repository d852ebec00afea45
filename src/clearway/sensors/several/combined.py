"""What several sensors say of the cells, as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.sensors.cells.detection import Detection
from clearway.sensors.standing import combine_rule_named


@dataclass(frozen=True, slots=True, eq=False)
class SensedCells:
    """All sensors together."""

    detected: FloatArray
    """[cells] P_OD (5.38)."""
    visibility: FloatArray
    """[cells] P_V, the largest over the sensors."""
    seen: BoolArray
    """[cells] true where some beam of some sensor looks into the cell's column."""
    hits: IntArray
    """[cells] over all sensors."""


def combine_detections(detections: Sequence[Detection], rule: str = "conjunction") -> SensedCells:
    """Several sensors as one: P_OD by (5.38), or by another rule by name; see `COMBINE_RULES`.

    Raises ClearwayError without any detection, and for a rule that does not exist.
    """
    combine = combine_rule_named(rule)
    if not detections:
        raise ClearwayError("combine_detections: at least one detection is needed")
    if len(detections) == 1:
        (only,) = detections
        return SensedCells(only.probability, only.visibility, only.seen, only.hits)
    looks = np.stack([each.seen for each in detections])
    detected, visibility = combine(
        np.stack([each.probability for each in detections]),
        np.stack([each.visibility for each in detections]),
        looks,
        np.array([each.weight for each in detections]),
    )
    hits = np.sum([each.hits for each in detections], axis=0)
    return SensedCells(detected, visibility, np.any(looks, axis=0), np.asarray(hits))
