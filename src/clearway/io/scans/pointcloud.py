"""Point clouds from files: one value for all formats, checked at the edge, metres from here on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import BoolArray, FloatArray
from clearway.base.brief import brief
from clearway.base.errors import InputError

if TYPE_CHECKING:
    from clearway.sensors import BeamPattern

SCAN_LIMIT_M = 5_000.0
"""No LiDAR of a vehicle sees as far: a wider scan is in another unit than metres."""
SURVEY_LIMIT_M = 100_000.0
"""Aerial tiles are a few kilometres wide."""
NOT_FINITE = "not finite"
NO_RETURN = "at the sensor's origin, no return"
UNWANTED = "class not wanted"


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Finite points of one file, and what was left out of it on the way."""

    points_m: FloatArray
    """[n, 3] in the frame of the file: the sensor's for a scan, the survey's for an aerial tile."""
    classes: npt.NDArray[np.uint8] | None
    """[n] ASPRS classes where the file has them."""
    crs: str | None
    """Name of the coordinate reference system where the file states one."""
    unit: str
    """Unit of the file, already converted."""
    source: str
    survey: bool = False
    """True for an aerial survey, False for the scan of one sensor."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Points left out, by reason."""
    notes: tuple[str, ...] = ()
    """What was assumed where the file is silent; to be shown."""
    pattern: BeamPattern | None = None
    """Beams of the sensor where the file says which it is."""
    complete: bool = True
    """False where parts of the sweep were lost; `pattern` has only the beams that came."""

    __repr__ = brief


def clean_cloud(cloud: PointCloud, without_classes: Sequence[int] = ()) -> PointCloud:
    """Only finite points, and no wider than the unit can be right; of a scan, none at its origin.

    without_classes: left out first, since it is noise that strays; InputError without classes.

    Drivers write 0, 0, 0 where a beam has no return.
    """
    if without_classes:
        if cloud.classes is None:
            raise InputError(cloud.source, "leave_out_classes: the file has no classes")
        cloud = _without(cloud, np.isin(cloud.classes, without_classes), UNWANTED)
    # Extremes of numbers that are not finite are not finite either, and quicker than asking each.
    if not np.all(np.isfinite(_extent(cloud.points_m))):
        finite = np.logical_and.reduce(np.isfinite(cloud.points_m), axis=1)
        cloud = _without(cloud, ~finite, NOT_FINITE)
    if not cloud.survey:
        zero = cloud.points_m == 0.0
        cloud = _without(cloud, zero[:, 0] & zero[:, 1] & zero[:, 2], NO_RETURN)
    if len(cloud.points_m):
        _check_extent(cloud)
    return cloud


def _without(cloud: PointCloud, dropped: BoolArray, reason: str) -> PointCloud:
    """The cloud without some points, counted by reason."""
    number = int(np.count_nonzero(dropped))
    if not number:
        return cloud
    kept = ~dropped
    return replace(
        cloud,
        points_m=np.ascontiguousarray(cloud.points_m[kept]),
        classes=None if cloud.classes is None else cloud.classes[kept],
        counts={**cloud.counts, reason: number},
    )


def with_points(cloud: PointCloud) -> PointCloud:
    """The cloud; InputError if it has no point."""
    if len(cloud.points_m) == 0:
        left_out = ", ".join(f"{count} {reason}" for reason, count in cloud.counts.items())
        raise InputError(
            cloud.source, "no usable point in it" + (f" (left out: {left_out})" if left_out else "")
        )
    return cloud


def _extent(points: FloatArray) -> FloatArray:
    """[3] length along each axis; column by column, which is faster in NumPy."""
    if not len(points):
        return np.zeros(3)
    with np.errstate(invalid="ignore"):  # inf less inf
        return np.array([column.max() - column.min() for column in points.T])


def _check_extent(cloud: PointCloud) -> None:
    extent = _extent(cloud.points_m)
    widest = float(extent.max())
    limit = SURVEY_LIMIT_M if cloud.survey else SCAN_LIMIT_M
    if widest <= limit:
        return
    kind = "an aerial tile" if cloud.survey else "a scan"
    across = " x ".join(f"{length:,.0f}" if length < 1e9 else f"{length:.3g}" for length in extent)
    raise InputError(
        cloud.source,
        f"points extend {across} m (x, y, z) if the file is in {cloud.unit}: more than {kind} can "
        f"({limit:,.0f} m). {_likely_unit(widest)} Valid: coordinates in metres"
        + (", or in the unit that the file's CRS states" if cloud.survey else ""),
    )


def _likely_unit(widest_m: float) -> str:
    for unit, per_metre in (("centimetres", 100.0), ("millimetres", 1000.0)):
        if widest_m / per_metre <= 500.0:
            return (
                f"Likely the file is in {unit} (then {widest_m / per_metre:,.0f} m wide): "
                f"divide by {per_metre:,.0f}."
            )
    return "Likely another unit, or points far from the rest (leave_out_classes leaves noise out)."
