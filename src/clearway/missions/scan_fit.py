"""What a recorded scan says of grid, axes, vehicle and airframe, where a file leaves it open."""

from __future__ import annotations

from itertools import islice

import numpy as np

from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import FloatArray
from clearway.io.scans.optical import Axes, is_optical
from clearway.io.scans.pointcloud import PointCloud
from clearway.io.scans.timed_scans import ScanSequence
from clearway.io.scans.usable import LeftOut
from clearway.missions.scene_file import ScanSection, SceneFile
from clearway.missions.sections import GridSection
from clearway.sensors import Lidar, Mounting
from clearway.sensors.beams.estimate import RECOGNISED
from clearway.sensors.beams.own_airframe import NEAR_M, own_airframe

LEVEL_RAD = np.radians(1.0)
"""A sensor tilted by more looks as high as its azimuth says: no grid follows that."""
THINNEST_DEG = 5.0
"""A field of view less high than this is that of a level scanner: the grid stays as it is."""
SCANS_LOOKED_AT = 5
MANY = 500
"""Points, of which a sensor sees some on either side."""
ENOUGH = 20
"""Points, of which a sensor that looks ahead has some ahead."""
NEARLY_ALL = 0.99
CONE_RAD = np.radians(65.0)
"""From the middle to the corner of what the widest depth cameras see; a LiDAR's rings are lower."""
EDGES = (1.0, 99.0)
"""Percentiles that count as the edges of an image."""
CORNER = 0.75
IN_A_CORNER = 0.002
"""From where, of half an image, a corner begins: a circle ends at 0.71. Share of points in each
corner, of which an even image has 1.6 %."""
ABOVE = "above"
DIRECTIONS = {
    ABOVE: (2, 1.0),
    "below": (2, -1.0),
    "left of": (1, 1.0),
    "right of": (1, -1.0),
    "behind": (0, -1.0),
}
"""Axis and sign."""
CHOICES = (
    "type --frame optical (z ahead, x right, y down: a depth camera) or --frame body (x ahead, y "
    "left, z up), or set `frame` of [scan]"
)


def fit_to_scan(
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
        clouds = [LeftOut().read(scan) for scan in islice(sequence, SCANS_LOOKED_AT)]
    except ClearwayError:  # told where that scan is asked for
        return ()
    scans = [cloud.points_m for cloud in clouds if cloud is not None and cloud.complete]
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


def refuse_other_axes(section: ScanSection, cloud: PointCloud, sequence: ScanSequence) -> None:
    """Raise InputError where x may not be ahead and nobody says what is.

    Nothing on the way of a vehicle would be seen, and all ahead would seem free.
    """
    named, turned_by_hand = is_optical(sequence.frame), section.attitude_deg is not None
    if section.frame == "optical" and cloud.pattern is not None:
        raise InputError(
            cloud.source, "packets of a sensor tell their axes: leave out --frame optical"
        )
    if section.frame != "auto" or cloud.pattern is not None:
        return
    if named and turned_by_hand:
        raise InputError(
            cloud.source,
            f"attitude_deg of [scan] may turn its points twice: the frame {sequence.frame} has z "
            'ahead by its name, so they are turned already. Set frame = "optical" of [scan] if '
            'attitude_deg says how the camera looks, or frame = "body" if it turns the points as '
            "they stand in the file",
        )
    if turned_by_hand or sequence.mounting is not None or len(cloud.points_m) < ENOUGH:
        return
    if named and np.mean(cloud.points_m[:, 0] > 0.0) < NEARLY_ALL:
        raise InputError(
            cloud.source,
            f"the frame {sequence.frame} has z ahead by its name, but its points lie behind the "
            f"camera too, where none sees: {CHOICES}",
        )
    if not named and find_direction(cloud.points_m) == ABOVE and _fills_an_image(cloud.points_m):
        raise InputError(
            cloud.source,
            f"all points lie within {np.degrees(CONE_RAD):.0f} deg of +z and fill a rectangular "
            "image, as those of a depth camera do. With x ahead, nothing ahead would be seen: "
            f"{CHOICES}",
        )


def _fills_an_image(points_m: FloatArray) -> bool:
    """Whether points before a camera that looks along z reach into all four corners of its image.

    Those of a LiDAR that looks up lie in rings, or in a circle.
    """
    ahead = points_m[points_m[:, 2] > 0.0]
    across = ahead[:, :2] / ahead[:, 2:]
    low, high = np.percentile(across, EDGES, axis=0)
    if not np.all(high > low):
        return False
    place = 2.0 * (across - low) / (high - low) - 1.0
    corners = [place * signs > CORNER for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    return all(float(np.mean(inside.all(axis=1))) >= IN_A_CORNER for inside in corners)


def note_direction(
    source: str, frame: Axes, mounting: Mounting, points_m: FloatArray
) -> tuple[str, ...]:
    """Return a note where no point of a scan lies ahead of the vehicle, and what to state."""
    direction = find_direction(points_m @ mounting.body_from_sensor.T)
    if direction is None:
        return ()
    note = f"{source}: all points lie {direction} the vehicle, so nothing ahead was seen"
    if frame != "auto":
        return (note,)
    if direction == ABOVE:
        return (f"{note}. Either the sensor looks up, or z is ahead: {CHOICES}",)
    return (
        f"{note}. If the sensor looks ahead, state the axes of its points (--frame) or how it sits "
        "(attitude_deg of [scan])",
    )


def find_direction(points_m: FloatArray) -> str | None:
    """Return where nearly all points lie, of `DIRECTIONS`; None where some are ahead or around."""
    if len(points_m) < ENOUGH:
        return None
    distance_m = np.sqrt(np.einsum("ij,ij->i", points_m, points_m))
    for name, (axis, sign) in DIRECTIONS.items():
        if np.mean(sign * points_m[:, axis] >= np.cos(CONE_RAD) * distance_m) >= NEARLY_ALL:
            return name
    return None


def note_vehicle(file: SceneFile, speed_mps: float) -> tuple[str, ...]:
    """A note where the vehicle of a recording is assumed."""
    stated = file.vehicle is not None and file.vehicle.kind is not None
    if stated or not file.records_a_flight:
        return ()
    return (describe_assumed_vehicle(speed_mps, "--vehicle (`kind` of [vehicle])", "--speed"),)


def describe_assumed_vehicle(speed_mps: float, kind_key: str, speed_key: str) -> str:
    """Return what is assumed of the vehicle of a recording, and what states another one."""
    return (
        f"vehicle: an inertialess one of up to {speed_mps:g} m/s is assumed; state yours with "
        f"{kind_key} and {speed_key}"
    )
