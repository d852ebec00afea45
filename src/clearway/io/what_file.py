"""What a file is that the command it was given to does not take, and which one does."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import islice
from pathlib import Path
from typing import TypeVar

from clearway.base.errors import InputError, SeveralErrors, naming
from clearway.base.suggest import MOST_SEEN

HEAD = 4096
LOOKS_LIKE = "it looks like"
OSF_AS_PACKETS = (
    "save it as packets (`ouster-cli source FILE.osf save FILE.pcap`), "
    "which `clearway assess --scan` takes"
)
OSF_SIGN = slice(8, 12)
"""Where an OSF recording is signed, with OSF$ (with OSF! until version 1 of the format)."""
KNOWN = (
    (rb"# labels_initial\b", "an encounter model (Bayesian network of aircraft tracks): no map, "
     "no recording and no scan; `clearway risk` samples encounters from it"),
    (rb"# Daidalus Object\b|\Alookahead_time\s*=", "parameters of DAIDALUS, an alerting logic: "
     "clearway has its own and takes none of them"),
    (rb"\A\s*Time,.*\bAlert Level\b", "output of DAIDALUS (alert levels by time), not positions: "
     "`clearway traffic` takes the .daa file that it was made of"),
    (rb"\AULog\x01\x12\x35", "a ULog of a flight: `clearway traffic` lists it, "
     "`clearway assess --poses` takes its poses"),
    (rb"(?m)\A[^\x00]*?^\d+:\d\d:\d\d(\.\d+)?>", "a BlueSky scenario: `clearway traffic` takes it"),
    (rb"\A# \.PCD|\AVERSION [.0-9]+\s+FIELDS", "a point cloud: `clearway assess --scan` takes it"),
    (rb"\ALASF", "an aerial survey: `clearway assess --scan` takes it, missions as a world"),
    (rb"(?s)\ASQLite format 3\0.{52}GP(KG|1[01])|\A\0\0\x27\x0a|<osm\b|\A\0\0\0.\x0a\x09OSMHeader",
     "buildings (GeoPackage, Shapefile, OpenStreetMap): `clearway map` takes it"),
    (rb"\A#ROSBAG|\ASQLite format 3|\A\x89MCAP", "a robot recording: `clearway assess --scan` "
     "takes it if it holds point clouds"),
    (rb"\A(\xd4\xc3\xb2\xa1|\xa1\xb2\xc3\xd4)", "captured packets: `clearway assess --scan` takes "
     "those of an Ouster LiDAR"),
    (rb"\A(?:\s*#[^\n]*\n)*\s*(QGC WPL|RALLY[ \t])", "waypoints, fences or rally points of a "
     "ground station: `clearway fly` takes them"),
    (rb'"fileType"\s*:\s*"Plan"', "a plan of a ground station: `clearway fly` takes it"),
    (rb'"CityJSON"|"CityObjects"|"UASZoneList"|"FeatureCollection"',
     "a map: `clearway map` takes it"),
    (rb"\AUHL1", "a tile of DTED: `clearway map` takes terrain"),
    (rb"\AII\*\0|\AMM\0\*", "a raster (GeoTIFF): `clearway map` takes terrain"),
    (rb"(?s)\A.{8}OSF[$!]", f"an OSF recording of an Ouster LiDAR: {OSF_AS_PACKETS}"),
    (rb'"beam_altitude_angles"', "metadata of an Ouster LiDAR: `clearway assess --scan` reads it "
     "with the .pcap beside it"),
    (rb"\Aply\n", "a point cloud: `clearway assess --scan` takes it"),
    (rb"(?s)\A\0[\4-\7].{6}[\xfd\xfe]", "a telemetry log of MAVLink (.tlog): "
     "`clearway traffic` takes it"),
    (rb"\A\xa3\x95\x80\x80", "a DataFlash log of ArduPilot (.bin): `clearway traffic` takes it"),
    (rb"(?m)^[A-Za-z0-9-]{1,12}>[^:\s]{1,120}:/\d{6}h\d{4}\.", "lines of the Open Glider Network: "
     "`clearway traffic` takes them"),
    (rb"<kml\b|(?s:\APK\x03\x04.{26}(wpmz/|doc\.kml))", "a KML or a mission of DJI: "
     "`clearway fly` takes it"),
    (rb"\APK\x03\x04", "a zip archive: unpack it (`unzip`), and give what is in it"),
    (rb"\A\x1f\x8b", "a file packed by gzip: unpack it (`clearway traffic` reads it packed)"),
    (rb"\A\x28\xb5\x2f\xfd", "a file packed by zstd: unpack it with `zstd -d` (files of ROS 2 bags "
     "are read as `.db3.zstd`, `.mcap.zstd`)"),
    (rb"rosbag2_bagfile_information", "metadata of a ROS 2 bag: `clearway assess --scan` takes "
     "its folder"),
)  # fmt: skip

PLACED = r"(?=[^\n]*\blat)(?=[^\n]*\blon)"
TOP = r"(?<![a-z])(h|height|agl|amsl|top)(?![a-z])"
"""With a unit or a level beside it: `height_m`, `agl_ft`, `height_amsl`."""
LIKELY = (
    (rb"(?m)\A[^\0]*?^\[mission\]", "a mission of clearway: `clearway fly` takes it"),
    (rb"(?m)\A[^\0]*?^\[\[family\]\]", "a campaign of clearway: `clearway campaign` takes it"),
    (rb"(?m)\A[^\0]*?^\[(scan|grid|rating|reach_set|vehicle)\]|^\[\[(obstacle|intruder)\]\]",
     "a scene of clearway: `clearway assess` takes it"),
    (rb"\A\d+(\.\d+)?,[0-9a-fA-F]{14}([0-9a-fA-F]{14})?\r?\n", "Mode S messages: "
     "`clearway traffic` takes them"),
    ((rf"(?i)\A{PLACED}(?=[^\n]*\btime)[^\n]*[,;\t]").encode(), "a table of aircraft: "
     "`clearway traffic` takes it"),
    ((rf"(?i)\A{PLACED}(?=[^\n]*{TOP})[^\n]*[,;\t]").encode(),
     "a table of obstacles: `clearway map` takes it"),
    (rb"(?m)^[0-9A-Z]{2}-\d{6} [OU] ", "obstacles of the FAA (DOF): `clearway map` takes it"),
    (rb"(?i)\A\W*x\W+y\W+z\b", "a table of points: `clearway assess --scan` takes it"),
    (rb"(?m)^\s*ros__parameters:", "parameters of a node of ROS 2: `clearway ros2` takes them, "
     "`clearway guard` those with commands, `clearway px4` those of a flight mode"),
    (rb"(?m)\A[^\0]*?^\[\[volume\]\]", "volumes about other aircraft: "
     "`clearway alerts --volumes` takes them"),
)  # fmt: skip
"""What a file is reported to look like where a command could not read it, but never refused for."""


def what_file(path: str | Path, *, likely: bool = False) -> str:
    """The end of a message, "; it looks like a map: ...", or nothing where the file is unknown.

    likely: guesses count too that say nothing against a file which can be read.
    """
    try:
        if Path(path).is_dir():
            return _what_folder(Path(path))
        if not Path(path).is_file():
            return ""
        with Path(path).open("rb") as file:
            head = file.read(HEAD)
        return _what_suffix(Path(path), head) or what_content(head, likely=likely)
    except (OSError, ValueError):
        return ""


def _what_suffix(path: Path, head: bytes) -> str:
    """What is wrong with content that is not of the format which its suffix names."""
    if path.suffix.lower() != ".osf" or head[OSF_SIGN] in (b"OSF$", b"OSF!"):
        return ""
    return (
        f"; .osf is a recording of an Ouster LiDAR, but bytes {OSF_SIGN.start} to "
        f"{OSF_SIGN.stop - 1} of this one are {head[OSF_SIGN]!r} instead of b'OSF$': it is damaged "
        f"or something else; if it opens in Ouster's own tools, {OSF_AS_PACKETS}"
    )


def _what_folder(folder: Path) -> str:
    """The same of a folder, by the names in it."""
    names = {entry.name for entry in islice(folder.iterdir(), MOST_SEEN)}
    suffixes = {Path(name).suffix.lower() for name in names}
    if {"run.mcap", "summary.json"} <= names:
        return f"; {LOOKS_LIKE} a flight of clearway: `clearway replay` takes it"
    if "metadata.yaml" in names or suffixes & {".db3", ".zstd"}:
        return f"; {LOOKS_LIKE} a ROS 2 bag: `clearway assess --scan` takes it"
    if suffixes & {".pcd", ".ply", ".las", ".laz", ".npy"}:
        return f"; {LOOKS_LIKE} a folder of scans: `clearway assess --scan` takes it"
    return ""


def require_file(path: Path) -> None:
    """Raise InputError, with what is named alike, where nothing has that name."""
    with naming(path, "read"):
        path.stat()


def require_files(paths: Iterable[Path]) -> None:
    """The same for several: raises InputError for one that is not there, SeveralErrors for more."""
    absent: list[InputError] = []
    for path in paths:
        try:
            require_file(path)
        except InputError as error:
            absent.append(error)
    if absent:
        raise absent[0] if len(absent) == 1 else SeveralErrors(absent)


Reader = TypeVar("Reader")


def reader_of(path: Path, readers: Mapping[str, Reader], kind: str) -> Reader:
    """What reads files with the path's suffix; raises InputError for one that is none of a kind."""
    reader = readers.get(path.suffix.lower())
    if reader is None:
        require_file(path)
        raise InputError(
            str(path),
            f"suffix {path.suffix or '(none)'!r} is no known {kind} format; "
            f"valid suffixes: {', '.join(readers)}" + what_file(path),
        )
    return reader


def what_content(head: bytes, *, likely: bool = False) -> str:
    """As `what_file`, of the beginning of the content."""
    head = head[:HEAD].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    for sign, meaning in KNOWN + LIKELY * likely:
        if re.search(sign, head):
            return f"; {LOOKS_LIKE} {meaning}"
    return ""


def refuse_others(path: str | Path, command: str) -> None:
    """Raise InputError for a file that is known to be of no use to a command."""
    hint = what_file(path)
    if hint and f"`clearway {command}" not in hint:
        raise InputError(str(path), f"nothing for `clearway {command}`{hint}")
