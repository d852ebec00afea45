"""Coordinates of a map's own reference system as latitude and longitude, through pyproj."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError, MissingExtraError
from clearway.base.frames import FloatArray


class Projection(NamedTuple):
    """A horizontal reference system; heights stay in the file's vertical datum."""

    name: str
    unit: str
    """Of x and y, as pyproj calls it: metre, foot, degree ..."""
    across_m: float | None
    """Metres of that unit; None where x and y are no plane: angles, or from the Earth's middle."""
    up_m: float | None
    """Metres of the unit of heights; None where the system has none."""
    ellipsoidal: bool
    """Whether heights are above the ellipsoid."""
    to_geographic: Any
    """pyproj's transformer from x, y to longitude, latitude."""

    def latitude_longitude(self, points: FloatArray) -> FloatArray:
        """[n, 2] latitude, longitude in degrees of points [n, 2 or more] x, y."""
        longitude, latitude = self.to_geographic.transform(points[:, 0], points[:, 1])
        return np.stack([latitude, longitude], axis=-1)


def projection(path: Path, stated: object) -> Projection:
    """The horizontal part of the system that a file states, to WGS 84.

    Raises InputError where it is none that pyproj knows, MissingExtraError without pyproj.
    """
    try:
        import pyproj
        from pyproj.exceptions import ProjError
    except ImportError as cause:
        raise MissingExtraError(f"placing {path}", "map") from cause
    try:
        crs = pyproj.CRS.from_user_input(stated)
        horizontal = crs.sub_crs_list[0] if crs.is_compound else crs
        transformer = pyproj.Transformer.from_crs(horizontal, "EPSG:4326", always_xy=True)
    except (ProjError, TypeError) as cause:
        raise InputError(
            str(path), f"its coordinate reference system {stated!r} is not known: {cause}"
        ) from cause
    axes = crs.axis_info
    angular = horizontal.is_geographic or horizontal.is_geocentric
    return Projection(
        str(crs.name),
        str(axes[0].unit_name),
        None if angular else float(axes[0].unit_conversion_factor),
        float(axes[2].unit_conversion_factor) if len(axes) > 2 else None,
        len(axes) > 2 and not crs.is_compound,
        transformer,
    )
