"""Scans of any known format as a sequence: files, folders, bags, packets; poses from where told."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.scans.bag import METADATA
from clearway.io.scans.bag_files import is_bag_file
from clearway.io.scans.bag_scans import bag_scans
from clearway.io.scans.optical import Axes, turn_scans
from clearway.io.scans.scan_folder import SCAN_SUFFIXES, folder_scans
from clearway.io.scans.scan_formats import BY_SUFFIX, check_start, format_of, read_points
from clearway.io.scans.timed_scans import ScanSequence, TimedScan
from clearway.io.what_file import refuse_others, require_file, what_file


def open_scans(
    path: str | Path,
    topic: str | None = None,
    poses: str | Path | None = None,
    frame: Axes = "auto",
) -> ScanSequence:
    """The scans of a point cloud file, a folder of numbered ones, a bag, or an Ouster recording.

    topic: of a bag with several. poses: a file of poses (KITTI, TUM, a table, ULog) or a bag's
    topic of odometry or poses; by default those that a bag tells. frame: the axes of the points,
    "body", "optical" or "auto"; by default optical ones are turned where the bag names them so.
    Raises InputError where the file cannot be read or an option does not belong to it, and
    MissingExtraError.
    """
    return turn_scans(_as_recorded(Path(path), topic, poses), frame)


def _as_recorded(path: Path, topic: str | None, poses: str | Path | None) -> ScanSequence:
    """The scans with the axes that they were recorded in."""
    if path.is_dir():
        is_bag = _is_bag_folder(path)
    else:
        is_bag = path.suffix.lower() in BY_SUFFIX and format_of(path).topics
    if topic is not None and not is_bag:
        raise InputError(str(path), f"topic {topic!r}: only bags and MCAP files have topics")
    if poses is None:
        return _open(path, is_bag, topic, None)
    file = Path(poses)
    if not file.is_file():
        if is_bag:
            return _open(path, is_bag, topic, str(poses))
        raise InputError(str(poses), "cannot be read: no such file of poses")
    return _with_poses(_open(path, is_bag, topic, None), file)


def _is_bag_folder(path: Path) -> bool:
    """Whether a folder holds a ROS 2 bag: its metadata, or its files alone."""
    files = list(path.iterdir())
    return (path / METADATA).is_file() or (
        any(map(is_bag_file, files)) and set(SCAN_SUFFIXES).isdisjoint(one.suffix for one in files)
    )


def _open(path: Path, is_bag: bool, topic: str | None, poses: str | None) -> ScanSequence:
    if path.is_dir():
        return bag_scans(path, topic, poses) if is_bag else folder_scans(path)
    if path.suffix.lower() not in BY_SUFFIX:
        require_file(path)
        raise InputError(
            str(path),
            f"suffix {path.suffix or '(none)'!r} is no known scan; valid suffixes: "
            f"{', '.join(BY_SUFFIX)}, or a folder" + what_file(path),
        )
    check_start(path)
    one = format_of(path)
    return _single(path) if one.scans is None else one.scans(path, topic, poses)


def _single(path: Path) -> ScanSequence:
    """A file that holds one scan."""
    refuse_others(path, "assess")

    def scans() -> Iterator[TimedScan]:
        yield TimedScan(0, 0.0, None, lambda: read_points(path))

    return ScanSequence(str(path), f"point cloud {path.suffix}", scans)


def _with_poses(sequence: ScanSequence, file: Path) -> ScanSequence:
    """The sequence with the poses of a file, which must know at least the first scan's."""
    from clearway.io.poses.pose_file import read_poses

    poses = read_poses(file)

    def scans() -> Iterator[TimedScan]:
        for scan in sequence:
            yield replace(scan, state=poses.at(scan.index, scan.time_s))

    notes = (*sequence.notes, *poses.notes)
    return replace(sequence, scans=scans, notes=notes, poses=poses.span)
