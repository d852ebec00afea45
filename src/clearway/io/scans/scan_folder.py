"""A folder of numbered scans (.bin, .pcd, ...) as a sequence, with KITTI's files of times."""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.foreign import read_text
from clearway.io.scans.scan_formats import SCAN_FORMATS, read_cloud
from clearway.io.scans.timed_scans import ScanSequence, TimedScan

SCAN_SUFFIXES = tuple(
    suffix for one in SCAN_FORMATS if one.cloud for suffix in one.suffixes if suffix != ".txt"
)
"""Those of files of one cloud; a .txt beside scans tells their times or poses."""
PERIOD_S = 0.1
"""Between scans whose times nobody tells: most LiDARs turn ten times a second."""
TIME_FILES = ("times.txt", "timestamps.txt")
NANOSECONDS = re.compile(r"\d{16,19}")
"""A number in a name that can only be a time since 1970."""
TWO_PARTS = re.compile(r"(?<!\d)(\d{10})[._](\d{9})(?!\d)")
"""The same as seconds and nanoseconds, as ROS has them."""


def folder_scans(path: Path) -> ScanSequence:
    """Scans in the order of the numbers in their names.

    Times are those of times.txt or timestamps.txt in the folder or beside it, else of names that
    are nanoseconds since 1970, else 0.1 s apart. Raises InputError for a folder with several kinds
    of scans, names without numbers, or as many times as it has no scans.
    """
    kinds: dict[str, list[Path]] = {}
    for one in path.iterdir():
        suffix = one.suffix.lower()
        if suffix in SCAN_SUFFIXES and one.is_file() and one.name not in TIME_FILES:
            kinds.setdefault(suffix, []).append(one)
    if len(kinds) != 1:
        found = ", ".join(f"{len(files)} {suffix}" for suffix, files in sorted(kinds.items()))
        raise InputError(
            str(path),
            f"a folder of scans needs files of one kind, found {found or 'none'}; valid: "
            f"{', '.join(SCAN_SUFFIXES)}, or the files of a ROS 2 bag",
        )
    ((suffix, unordered),) = kinds.items()
    nameless = [one.name for one in unordered if not _number(one)]
    if nameless:
        raise InputError(str(path), f"no number in the name of {', '.join(nameless[:5])}")
    files = sorted(unordered, key=lambda one: (int(_number(one)), one.name))
    times, note = _times(path, files)

    def scans() -> Iterator[TimedScan]:
        for index, (file, time_s) in enumerate(zip(files, times, strict=True)):
            yield TimedScan(index, time_s, None, lambda file=file: read_cloud(file))  # type: ignore[misc]

    return ScanSequence(
        str(path), f"folder of {len(files)} {suffix}", scans, notes=(f"{path}: {note}",)
    )


def _number(file: Path) -> str:
    """The last number in a file's name; seconds and nanoseconds of a time as one."""
    moment = TWO_PARTS.search(file.name)
    if moment is not None:
        return moment[1] + moment[2]
    return next(iter(re.findall(r"\d+", file.name.split(".")[0])[::-1]), "")


def _times(folder: Path, files: list[Path]) -> tuple[list[float], str]:
    for place in (folder, folder.parent):
        for name in TIME_FILES:
            if (place / name).is_file():
                return _read_times(place / name, len(files)), f"times of {name}"
    if all(NANOSECONDS.fullmatch(_number(file)) for file in files):
        scale = 10.0 ** -(len(_number(files[0])) - 10)
        return [int(_number(file)) * scale for file in files], "times of the names of its files"
    return [PERIOD_S * index for index in range(len(files))], (
        f"no {' or '.join(TIME_FILES)}: scans taken as {PERIOD_S:g} s apart"
    )


def _read_times(path: Path, count: int) -> list[float]:
    """Seconds, or dates and times, one a line."""
    lines = [line.strip() for line in read_text(path).splitlines() if line.strip()]
    if len(lines) != count:
        raise InputError(str(path), f"{len(lines)} times for {count} scans")
    times = []
    for place, line in enumerate(lines, start=1):
        try:
            times.append(_moment(line))
        except ValueError:
            raise InputError(
                str(path), f"line {place}: {line[:40]!r} is neither seconds nor a date and time"
            ) from None
    return times


def _moment(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        whole, _, fraction = text.partition(".")
        return datetime.fromisoformat(f"{whole}+00:00").timestamp() + float(f"0.{fraction or 0}")
