"""Scans from files as values of their own: points, the LiDAR that saw them, the own pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from clearway.base.brief import in_brief, one_line
from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.io.scans.optical import Axes
from clearway.io.scans.pointcloud import PointCloud
from clearway.io.scans.sequences import open_scans
from clearway.io.scans.timed_scans import At, ScanSequence, TimedScan
from clearway.io.scans.usable import LeftOut, find_usable, read_usable
from clearway.missions.scan_fit import note_direction
from clearway.missions.scene_file import ScanSection
from clearway.missions.scene_reading import lidar_of
from clearway.sensors import Lidar, Scan

AUTO = "auto"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RecordedScan(Scan):
    """A scan of a file: what `AvoidanceSystem.update` and `assess` take, and what is known of it.

    All of its points are finite; its time is on the clock of the recording.

    Examples
    --------
    >>> import clearway as cw
    >>> scan = cw.read_scan("street.pcd")
    >>> scan.points_m.shape, scan.lidar_from, scan.state is None
    ((2760, 3), 'estimated', True)
    """

    lidar: Lidar
    """Its beams and where it sits: as stated, as the file says, or estimated from the points."""
    lidar_from: str
    """Which of these: "stated", "file" or "estimated"."""
    state: State | None = None
    """Own pose in the world frame at the scan's time; None where the recording tells none."""
    source: str = ""
    """The file."""
    index: int = 0
    """Number of the scan in its recording, from 0."""
    complete: bool = True
    """False where parts of the sweep were lost: missing returns are then no sign of free space."""
    left_out: Mapping[str, int] = field(default_factory=dict)
    """Points left out, by reason."""
    notes: tuple[str, ...] = ()
    """What was assumed where the file is silent; to be shown."""

    def __repr__(self) -> str:
        name = self.lidar.pattern.name.removeprefix("estimated: ").split(",")[0]
        return one_line(
            "RecordedScan",
            (
                f"{in_brief(Path(self.source).name)} scan {self.index}",
                f"{len(self.points_m):,} points",
                f"at {self.time_s:g} s",
                f"by {name} ({self.lidar_from})",
                *([] if self.complete else ["incomplete"]),
            ),
        )


def read_scan(
    path: str | Path,
    at: At | None = None,
    *,
    topic: str | None = None,
    poses: str | Path | None = None,
    sensor: str | Lidar = AUTO,
    frame: Axes = "auto",
) -> RecordedScan:
    """Read one scan of a point cloud, a folder of numbered ones, a bag, or a recording of packets.

    Parameters
    ----------
    path
        The file or folder.
    at
        Which scan of several, its number from 0 or seconds after the first such as "1.5s"; by
        default the first that can be used.
    topic
        Of a bag with several that have points.
    poses
        A file of the vehicle's poses (KITTI, TUM, a table, ULog) or a topic of the bag.
    sensor
        The LiDAR whose scan it is, or the name of a model such as "vlp16". "auto" takes it from the
        file, or estimates its beams from the points.
    frame
        Axes of the file's points, "body" (x forward, y left, z up) or "optical" (z forward, x
        right, y down). "auto" takes them as optical where a bag calls their frame so.

    Returns
    -------
    RecordedScan
        Points in metres in the sensor's frame (x forward, y left, z up).

    Raises
    ------
    InputError
        Naming the file and what is wrong: absent, empty, damaged, of no known format, without such
        a scan or any point in it, in map coordinates.
    MissingExtraError
        Where the package that reads the format is not installed.

    Examples
    --------
    >>> import clearway as cw
    >>> scan = cw.read_scan("street.pcd", sensor="vlp16")
    >>> scan
    RecordedScan('street.pcd' scan 0, 2,760 points, at 0 s, by vlp16 (stated))
    """
    sequence = open_scans(path, topic, poses, frame)
    scan, cloud, before = read_usable(sequence, at)
    if poses is not None and scan.state is None:
        raise InputError(str(poses), f"no pose at scan {scan.index}, {scan.time_s:.3f} s")
    recorded = _make_recorded(sequence, scan, cloud, *_lidar(sensor, frame, sequence, cloud))
    elsewhere = note_direction(sequence.source, frame, recorded.lidar.mounting, recorded.points_m)
    return replace(recorded, notes=(*before, *elsewhere, *recorded.notes))


def read_scans(
    path: str | Path,
    *,
    topic: str | None = None,
    poses: str | Path | None = None,
    sensor: str | Lidar = AUTO,
    frame: Axes = "auto",
) -> RecordedScans:
    """Read all scans of a recording that can be used, one after the other as they are asked for.

    The beams are those of the first complete scan with points in it. A scan without a pose or
    with parts missing comes like any other: see `state` and `complete`.

    Parameters
    ----------
    path
        The file or folder.
    topic
        As `read_scan` takes it.
    poses
        As `read_scan` takes them.
    sensor
        As `read_scan` takes it.
    frame
        As `read_scan` takes it.

    Returns
    -------
    RecordedScans
        To iterate over; its `left_out` counts damaged scans, and those without a point.

    Raises
    ------
    InputError
        As `read_scan` does, at once.
    MissingExtraError
        Where the package that reads the format is not installed.

    Examples
    --------
    >>> import clearway as cw
    >>> [len(scan.points_m) for scan in cw.read_scans("street.pcd")]
    [2760]
    """
    sequence = open_scans(path, topic, poses, frame)
    _, cloud = find_usable(sequence, LeftOut(), whole=True)
    return RecordedScans(sequence, *_lidar(sensor, frame, sequence, cloud))


class RecordedScans(Iterator[RecordedScan]):
    """What `read_scans` returns: the scans of a recording that can be used, each once."""

    def __init__(self, sequence: ScanSequence, lidar: Lidar, lidar_from: str) -> None:
        self._left_out = LeftOut()
        self._scans = (
            _make_recorded(sequence, scan, cloud, lidar, lidar_from)
            for scan in sequence
            if (cloud := self._left_out.read(scan)) is not None
        )

    def __next__(self) -> RecordedScan:
        return next(self._scans)

    @property
    def left_out(self) -> Mapping[str, int]:
        """Scans left out so far, by reason."""
        return dict(self._left_out.counts)

    def __repr__(self) -> str:
        words = self._left_out.in_words()
        return f"RecordedScans({f'left out: {words}' if words else ''})"


def _lidar(
    sensor: str | Lidar, frame: Axes, sequence: ScanSequence, cloud: PointCloud
) -> tuple[Lidar, str]:
    """The LiDAR, and where it is from."""
    if isinstance(sensor, Lidar):
        return sensor, "stated"
    section = ScanSection(file=sequence.source, pattern=sensor, frame=frame)
    try:
        return lidar_of(sequence.source, section, cloud, sequence)
    except InputError as error:
        told = [problem.removeprefix("scan.pattern: ") for problem in error.problems]
        raise InputError(error.source, told) from error


def _make_recorded(
    sequence: ScanSequence, scan: TimedScan, cloud: PointCloud, lidar: Lidar, told_by: str
) -> RecordedScan:
    state = None if scan.state is None else replace(scan.state, time_s=scan.time_s)
    return RecordedScan(
        points_m=cloud.points_m,
        time_s=scan.time_s,
        sensor=lidar.name,
        lidar=lidar,
        lidar_from=told_by,
        state=state,
        source=sequence.source,
        index=scan.index,
        complete=cloud.complete,
        left_out=cloud.counts,
        notes=(*sequence.notes, *cloud.notes),
    )


def beams_in_words(source: str, pattern: str) -> str:
    """What the beams are, after where that is from; estimated patterns say it themselves."""
    return pattern if pattern.startswith(source) else f"{source}: {pattern}"
