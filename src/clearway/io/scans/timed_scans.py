"""A sequence of scans: one type for all recordings, played from the start as often as wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from clearway.base.brief import brief
from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.io.scans.pointcloud import PointCloud
from clearway.sensors import Mounting

At = int | str
"""Which scan: its number from 0, or as "1.5s" the one nearest to that time after the first."""

NO_POSES = "no poses in it"


@dataclass(frozen=True, slots=True, eq=False)
class TimedScan:
    """One scan of a sequence; its points are read when asked for."""

    index: int
    time_s: float
    """On the clock of the recording, of the scan's beginning where that is known."""
    state: State | None
    """Pose of the vehicle in the world frame at that time; None where unknown."""
    read: Callable[[], PointCloud]
    """Points [n, 3] in the sensor's frame, perhaps none; raises InputError where damaged."""

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class ScanSequence:
    """Scans of one sensor in the order of time; iterating begins anew each time."""

    source: str
    format: str
    scans: Callable[[], Iterator[TimedScan]]
    mounting: Mounting | None = None
    """Pose of the sensor, x ahead, on the vehicle, where the recording tells it."""
    notes: tuple[str, ...] = ()
    """What was assumed where the recording is silent; to be shown."""
    poses: str = NO_POSES
    """What there is of poses, in words."""
    frame: str = ""
    """What the recording calls the frame of its points."""

    __repr__ = brief

    def __iter__(self) -> Iterator[TimedScan]:
        return self.scans()


def scan_at(sequence: ScanSequence, at: At = 0) -> TimedScan:
    """One scan of a sequence, by number or time.

    Raises InputError saying how many there are, or when, where there is no such scan.
    """
    after_s = _seconds(sequence.source, at)
    if after_s is None:
        return _number(sequence, int(at))
    first = best = None
    for scan in sequence:
        if first is None or best is None:
            first = best = scan
            continue
        since_s, before_s = scan.time_s - first.time_s, best.time_s - first.time_s
        if since_s <= after_s or since_s - after_s < after_s - before_s:
            best = scan
        if since_s > after_s:
            return best
    if first is None or best is None:
        raise InputError(sequence.source, "no scan in it")
    span = best.time_s - first.time_s
    if not -0.5 <= after_s <= span + 0.5:
        raise InputError(
            sequence.source, f"no scan at {after_s:g} s; it has {best.index + 1} in {span:g} s"
        )
    return best


def _seconds(source: str, at: At) -> float | None:
    """Seconds after the first scan; None where `at` is a number of a scan."""
    text = str(at).strip()
    if text.isdigit():
        return None
    try:
        seconds = float(text.removesuffix("s")) if text.endswith("s") else -1.0
    except ValueError:
        seconds = -1.0
    if not 0.0 <= seconds < float("inf"):
        raise InputError(
            source, f"at {text!r}: valid: the number of a scan from 0, or seconds such as 1.5s"
        )
    return seconds


def _number(sequence: ScanSequence, index: int) -> TimedScan:
    count = 0
    for scan in sequence:
        if scan.index == index:
            return scan
        count += 1
    raise InputError(
        sequence.source,
        f"no scan number {index}; it has {count}"
        + (f", numbered 0 to {count - 1}" if count else ""),
    )
