"""What a recorded scan says of its grid and of its own airframe, where a file leaves it open."""

from __future__ import annotations

from itertools import islice

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.io.scans.timed_scans import ScanSequence
from clearway.missions.scene_file import SceneFile
from clearway.missions.sections import GridSection
from clearway.sensors import Lidar
from clearway.sensors.estimate import RECOGNISED
from clearway.sensors.own_airframe import NEAR_M, own_airframe

LEVEL_RAD = np.radians(1.0)
"""A sensor tilted by more looks as high as its azimuth says: no grid follows that."""
THINNEST_DEG = 5.0
"""A field of view less high than this is that of a level scanner: the grid stays as it is."""
SCANS_LOOKED_AT = 5
MANY = 500
"""Points, of which a sensor sees some on either side."""


def fitted_to(
    file: SceneFile, lidar: Lidar, pattern_from: str
) -> tuple[SceneFile, tuple[str, ...]]:
    """The file with its grid no higher and no lower than the sensor looks, and a note if it was.

    Rows where no beam goes would tell of nothing. A file that states elevations keeps them; and
    where beams are estimated from returns of a sensor that nobody knows, it may look beyond them.
    """
    if pattern_from == "estimated" and RECOGNISED not in lidar.pattern.name:
        return file, ()
    grid = file.grid
    stated = {"elevation_deg", "elevation_edges_deg"} & grid.model_fields_set
    tilt = np.abs(lidar.mounting.attitude_rad[:2]).max()
    if stated or tilt > LEVEL_RAD or not lidar.pattern.beams:
        return file, ()
    half = float(np.degrees(lidar.pattern.spacing_rad)) / 2.0
    looks = np.degrees([lidar.pattern.elevation_rad.min(), lidar.pattern.elevation_rad.max()])
    widest = GridSection().elevation_deg
    assert isinstance(widest, float)
    low = max(-widest, float(np.floor(looks[0] - half)))
    high = min(widest, float(np.ceil(looks[1] + half)))
    if high - low < THINNEST_DEG or (low, high) == (-widest, widest):
        return file, ()
    note = (
        f"grid: elevations {low:g} to {high:g} deg, as the sensor looks, not {-widest:g} to "
        f"{widest:g}; state elevation_deg of [grid], or --elevation-deg, for others"
    )
    fitted = grid.model_copy(update={"elevation_deg": (low, high)})
    return file.model_copy(update={"grid": fitted}), (note,)


def airframe_notes(sequence: ScanSequence, lidar: Lidar, points_m: FloatArray) -> tuple[str, ...]:
    """A note where what is near stands still in the first scans of a recording.

    points_m: of the scan that was asked for: where nothing in it is near, no other is read.
    """
    squared = np.einsum("ij,ij->i", points_m, points_m)
    if not np.any(squared < NEAR_M**2):
        return ()
    try:
        clouds = [scan.read() for scan in islice(sequence, SCANS_LOOKED_AT)]
    except ClearwayError:  # told where that scan is asked for
        return ()
    scans = [cloud.points_m for cloud in clouds if cloud.complete]
    found = own_airframe(scans, lidar.mounting, lidar.airframe_radius_m)
    return () if found is None else (f"{sequence.source}: {found.in_words()}",)


def corner_notes(source: str, points_m: FloatArray) -> tuple[str, ...]:
    """A note where all points lie forward, left and up: a map in its own frame, most likely."""
    if len(points_m) < MANY or float(points_m.min()) < 0.0:
        return ()
    return (
        f"{source}: x, y and z of all {len(points_m)} points are above 0: a map with its corner at "
        "the origin, rather than a scan, which has the sensor amid its points",
    )
