"""The formats that scans come in: the one place where a format is added.

Above all readers, none of which knows it. They are imported when they are used, so that help texts
can list the formats at no cost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from clearway.base.errors import InputError, naming
from clearway.io.what_file import reader_of

if TYPE_CHECKING:
    from clearway.io.scans.optical import Axes
    from clearway.io.scans.pointcloud import PointCloud
    from clearway.io.scans.timed_scans import ScanSequence


class ScanFormat(NamedTuple):
    """A format by the suffixes of its files: either of one cloud, or of a recording of many."""

    name: str
    """For tables."""
    suffixes: tuple[str, ...]
    magic: tuple[bytes, ...] = ()
    """What its files begin with, where they all do."""
    cloud: Callable[[Path], PointCloud] | None = None
    """Reads a file of one cloud."""
    scans: Callable[[Path, str | None, str | None], ScanSequence] | None = None
    """Opens a recording; topic and poses (of its own topics) where it has such."""
    topics: bool = False
    """Whether its recordings have topics, to choose scans and poses by."""
    beams: str = "estimated"
    """Where the pattern of beams is from, for tables; so the next two."""
    time: str = ""
    needs: str = ""
    """Extra that it needs."""
    known_by: str = ""
    """Beside the suffix."""


def _reader(module: str, name: str) -> Callable[..., Any]:
    """A function of a module beside this one, imported when it is called."""

    def read(*given: Any) -> Any:
        return getattr(import_module(f"clearway.io.scans.{module}"), name)(*given)

    return read


_BAG = _reader("bag_scans", "bag_scans")


def _packets(path: Path, _topic: str | None, _poses: str | None) -> ScanSequence:
    from clearway.io.scans.ouster import ouster_scans

    return ouster_scans(path)


SCAN_FORMATS = (
    ScanFormat(
        "PCD 0.5 to 0.7: ascii, binary, compressed",
        (".pcd",),
        (b"# .PCD", b"VERSION"),
        _reader("pcd", "read_pcd"),
        needs="compressed: `[lidar]`",
    ),
    ScanFormat(
        "PLY: ascii, binary of either byte order",
        (".ply",),
        (b"ply\n", b"ply\r"),
        _reader("ply", "read_ply"),
    ),
    ScanFormat(
        "LAS, LAZ", (".las", ".laz"), (b"LASF",), _reader("las", "read_las"), needs="`[lidar]`"
    ),
    ScanFormat(
        "tables of points",
        (".csv", ".xyz", ".txt"),
        cloud=_reader("point_table", "read_point_table"),
    ),
    ScanFormat("NumPy arrays", (".npy",), (b"\x93NUMPY",), _reader("point_table", "read_npy")),
    ScanFormat(
        "KITTI (x, y, z, intensity as float32), nuScenes",
        (".bin",),
        cloud=_reader("kitti", "read_bin"),
    ),
    ScanFormat(
        "ROS 1 bag",
        (".bag",),
        (b"#ROSBAG",),
        scans=_BAG,
        topics=True,
        beams="as of its topic",
        time="header stamp, else time of recording",
        needs="`[lidar]`",
    ),
    ScanFormat(
        "ROS 2 bag, its `metadata.yaml` of any version or lost",
        (".db3",),
        (b"SQLite format 3",),
        scans=_BAG,
        topics=True,
        beams="as of its topic",
        time="header stamp, else time of recording",
        needs="`[lidar]`",
        known_by="its folder",
    ),
    ScanFormat(
        "MCAP of ROS 1 or ROS 2 messages",
        (".mcap",),
        (b"\x89MCAP",),
        scans=_BAG,
        topics=True,
        beams="as of its topic",
        time="header stamp, else time of recording",
        needs="`[lidar]`",
    ),
    ScanFormat(
        "file of a ROS 2 bag packed by zstd (`.db3.zstd`, `.mcap.zstd`)",
        (".zstd",),
        (b"\x28\xb5\x2f\xfd",),
        scans=_BAG,
        topics=True,
        beams="as of its topic",
        time="header stamp, else time of recording",
        needs="`[lidar]`",
        known_by="its folder",
    ),
    ScanFormat(
        "Ouster packets",
        (".pcap",),
        scans=_packets,
        beams="of the metadata",
        time="the sensor's clock",
        needs="`[ouster]`",
        known_by="the sensor's `.json` beside it",
    ),
)
"""Add a format here: help, messages and the table of docs/scans.md are made from it."""
BY_SUFFIX: Mapping[str, ScanFormat] = {
    suffix: one for one in SCAN_FORMATS for suffix in one.suffixes
}


def format_of(path: Path) -> ScanFormat:
    """The format that a file's suffix tells; InputError listing the valid ones where none does."""
    return reader_of(path, BY_SUFFIX, "point cloud")


def read_points(
    path: str | Path, without_classes: Sequence[int] = (), frame: Axes = "auto"
) -> PointCloud:
    """Read a point cloud of any known format, of recordings the first usable one, x ahead.

    without_classes: points of a survey that are left out and counted, wherever they stray. frame:
    the axes of the points as they stand; "auto" takes them for a camera's where a recording calls
    their frame so.

    Points that are not finite are left out and counted. Raises InputError when the file is absent,
    empty, truncated, of another format than its suffix says, without points, or too wide to be in
    metres; MissingExtraError when the package that reads the format is not installed.
    """
    from clearway.io.scans.pointcloud import with_points

    return with_points(read_cloud(Path(path), without_classes, frame))


def read_cloud(path: Path, without_classes: Sequence[int] = (), frame: Axes = "body") -> PointCloud:
    """As `read_points`, but perhaps without any point, and by default as it stands."""
    from clearway.io.foreign_errors import damage_told
    from clearway.io.scans.optical import turn_cloud, turn_scans
    from clearway.io.scans.pointcloud import clean_cloud
    from clearway.io.scans.usable import LeftOut, find_usable

    one = format_of(path)
    check_start(path)
    with damage_told(path, f"{path.suffix} file"):
        if one.cloud is not None:
            cloud = clean_cloud(one.cloud(path), without_classes)
            return turn_cloud(cloud) if frame == "optical" else cloud
        assert one.scans is not None
        return find_usable(turn_scans(one.scans(path, None, None), frame), LeftOut())[1]


def check_start(path: Path) -> None:
    """Refuse files that cannot be opened, are empty, or begin like another format."""
    own = format_of(path)
    with naming(path, "read"), path.open("rb") as file:
        start = file.read(16)
    if not start:
        raise InputError(str(path), "the file is empty (0 bytes)")
    for other in SCAN_FORMATS:
        for magic in other.magic:
            if other is not own and start.startswith(magic):
                raise InputError(
                    str(path),
                    f"suffix {path.suffix!r}, but the content is of another format: its first "
                    f"bytes are {magic!r}, which belong to {' or '.join(other.suffixes)}",
                )
