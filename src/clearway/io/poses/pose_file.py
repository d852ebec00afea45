"""Files that say where the vehicle was: KITTI poses, TUM trajectories, tables of angles, ULog."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from clearway.base.checks import LARGEST
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray, attitude_from_rotation
from clearway.base.state import State
from clearway.io.foreign import is_number, note_unended, read_text
from clearway.io.foreign_errors import damage_told
from clearway.io.moments import second_of
from clearway.io.poses.pose_columns import TABLE, TUM, PoseColumns, find_pose_columns
from clearway.io.poses.pose_track import PoseTrack, pose_track

PoseAt = Callable[[int, float], State | None]
"""(index of the scan, its time) -> pose of the vehicle; None where none is known."""


class Poses(NamedTuple):
    """What a file of poses says."""

    at: PoseAt
    span: str
    """How many there are and when, in words."""
    notes: tuple[str, ...]


class PoseFormat(NamedTuple):
    """A kind of files of poses, told by suffix, header, or the number of values a line."""

    name: str
    holds: str
    """For tables; so the next two."""
    example: str
    needs: str = ""


POSE_FORMATS = (
    PoseFormat(
        "table",
        "table: time, x, y, z, roll, pitch, yaw in seconds, metres, degrees, pitch nose down",
        "way.csv",
    ),
    PoseFormat("TUM", "TUM: time, x, y, z, qx, qy, qz, qw", "way.txt"),
    PoseFormat(
        "KITTI",
        "KITTI: 12 numbers a scan, of a camera; `Tr` of a `calib.txt` beside it says where the "
        "LiDAR is",
        "poses.txt",
    ),
    PoseFormat(
        "ULog",
        "ULog of PX4: local position and attitude, in UTC where GPS told it",
        "log.ulg",
        "`[ulog]`",
    ),
)
"""Add a kind here: help and the table of docs/scans.md are made from it."""
KITTI = 12
"""Values a line."""
SHAPE_OF = {KITTI: None, 8: TUM, 7: TABLE}
"""PoseColumns of files without a header, by the number of values."""
MOST_SKEW = 0.01
"""A rotation times its transpose is one, but for the digits that are written."""
SHAPES = (
    "time,x,y,z,roll,pitch,yaw (degrees, pitch nose down), time x y z qx qy qz qw (TUM), "
    "12 numbers a scan (KITTI), or a header that names time, x, y, z and qw, qx, qy, qz or angles"
)
CAMERA_FROM_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""A camera has x right, y down, z ahead."""


def read_poses(path: str | Path) -> Poses:
    """Poses of a file, and what was assumed; a header, or the number of values a line, tells which.

    Times since 1970 may be counted in parts of a second. Raises InputError naming the lines that
    cannot be read.
    """
    path = Path(path)
    with damage_told(path, "file of poses"):
        return _read(path)


def _read(path: Path) -> Poses:
    if path.suffix.lower() == ".ulg":
        from clearway.io.poses.ulog import read_ulog

        track = read_ulog(path).track
        return _of_track(track)
    text = read_text(path)
    columns, rows = _numbers(path, text)
    if columns is None:
        return _kitti(path, rows)
    time_s, position, quaternion = columns.track(rows)
    second = second_of(float(np.max(np.abs(time_s), where=np.isfinite(time_s), initial=0.0)))
    notes = tuple(f"{path}: {note}" for note in note_unended(text))
    table = pose_track(str(path), time_s * second, position, quaternion, notes)
    if not len(table.time_s):
        raise InputError(str(path), "no usable pose in it")
    return _of_track(table)


def _of_track(track: PoseTrack) -> Poses:
    first, last = track.time_s[[0, -1]]
    span = f"{len(track.time_s)} poses, from {first:.3f} to {last:.3f} s"
    return Poses(lambda _, time_s: track.at(time_s), span, track.notes)


def _numbers(path: Path, text: str) -> tuple[PoseColumns | None, FloatArray]:
    """PoseColumns, None for KITTI's, and [n, values] of all lines but comments and a header."""
    rows: list[list[float]] = []
    problems = []
    header: PoseColumns | None = None
    for place, line in enumerate(text.splitlines(), start=1):
        words = line.split("#")[0].replace(",", " ").replace(";", " ").split()
        if not words or (not rows and not is_number(words[0])):
            header = find_pose_columns(line) or header
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            problems.append(f"line {place}: {line.strip()[:60]!r} is no row of numbers")
            continue
        if not _fits(len(values), header) or (rows and len(values) != len(rows[0])):
            problems.append(f"line {place}: {len(values)} values; valid: {SHAPES}")
        else:
            rows.append(values)
    if problems or not rows:
        raise InputError(str(path), problems[:5] or [f"no pose in it; valid: {SHAPES}"])
    return header or SHAPE_OF[len(rows[0])], np.array(rows)


def _fits(count: int, header: PoseColumns | None) -> bool:
    """Whether a row of so many values can hold a pose."""
    if header is None:
        return count in SHAPE_OF
    return count > max(header.time, *header.place, *header.turn)


def _kitti(path: Path, rows: FloatArray) -> Poses:
    """Poses of a camera by scan; `calib.txt` beside them says where the LiDAR is (Tr)."""
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3] = rows.reshape(-1, 3, 4)
    turns = poses[:, :3, :3]
    skew = np.abs(turns @ np.swapaxes(turns, 1, 2) - np.eye(3)).max(axis=(1, 2))
    bad = np.flatnonzero(~(np.isfinite(rows).all(axis=1) & (skew < MOST_SKEW)))
    if len(bad):
        raise InputError(
            str(path), [f"pose {n}: its first 3 x 3 numbers are no rotation" for n in bad[:5]]
        )
    camera_from_lidar, note = _calibration(path.parent / "calib.txt")
    lidar = np.linalg.inv(camera_from_lidar) @ poses @ camera_from_lidar
    far = np.flatnonzero(~(np.abs(lidar[:, :3, 3]) <= LARGEST).all(axis=1))
    if len(far):
        raise InputError(str(path), [f"pose {n}: farther than {LARGEST:g} m" for n in far[:5]])
    attitude = attitude_from_rotation(lidar[:, :3, :3])

    def pose(index: int, time_s: float) -> State | None:
        if index >= len(lidar):
            return None
        return State(lidar[index, :3, 3], attitude[index], time_s=time_s)

    return Poses(pose, f"{len(lidar)} poses, one a scan", (f"{path}: {note}",))


def _calibration(path: Path) -> tuple[FloatArray, str]:
    """[4, 4] camera from LiDAR."""
    camera_from_lidar = np.eye(4)
    if path.is_file():
        for line in read_text(path).splitlines():
            name, _, values = line.partition(":")
            numbers = values.split()
            if name.strip() in ("Tr", "Tr_velo_to_cam") and len(numbers) == KITTI:
                camera_from_lidar[:3] = np.array([float(word) for word in numbers]).reshape(3, 4)
                return camera_from_lidar, f"poses of the LiDAR by Tr of {path.name}"
    camera_from_lidar[:3, :3] = CAMERA_FROM_BODY
    return camera_from_lidar, "poses of a camera; no calib.txt with Tr: LiDAR assumed at its place"
