"""Which scans of a recording can be used, and what is counted of the others."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from clearway.base.errors import InputError
from clearway.io.scans.pointcloud import PointCloud, with_points
from clearway.io.scans.timed_scans import At, ScanSequence, TimedScan, scan_at

DAMAGED = "damaged"
EMPTY = "without a point"
LONGEST = 200
"""Characters of what is wrong with one scan."""


@dataclass(slots=True, eq=False)
class LeftOut:
    """Scans that were left out so far."""

    counts: Counter[str] = field(default_factory=Counter)
    """By reason."""
    first: dict[str, str] = field(default_factory=dict)
    """What is wrong with the first one of each reason, in words."""
    error: InputError | None = None
    """Of the first one that cannot be read."""

    def read(self, scan: TimedScan) -> PointCloud | None:
        """Return the points of a scan; None, and it is counted, where it cannot be used.

        No point at all is an answer only of a sensor whose beams the recording tells.
        """
        cloud = None
        try:
            cloud = scan.read()
            return cloud if cloud.pattern is not None else with_points(cloud)
        except InputError as error:
            self.add(DAMAGED if cloud is None else EMPTY, scan, "; ".join(error.problems))
            self.error = self.error or error
            return None

    def add(self, reason: str, scan: TimedScan, words: str = "") -> None:
        """Count one more."""
        self.counts[reason] += 1
        if words:
            self.first.setdefault(reason, f"scan {scan.index} {reason}: {words[:LONGEST]}")

    def in_words(self) -> str:
        """Return the counts as one line; empty without any."""
        return ", ".join(f"{count} {reason}" for reason, count in self.counts.items())


def find_usable(
    sequence: ScanSequence, left_out: LeftOut, *, whole: bool = False
) -> tuple[TimedScan, PointCloud]:
    """Return the first scan that can be used, and its points; those before it are counted.

    whole: with points, and no part of it lost. Raises InputError where there is none.
    """
    seen = 0
    for scan in sequence:
        seen += 1
        cloud = left_out.read(scan)
        if cloud is not None and not (whole and not (cloud.complete and len(cloud.points_m))):
            return scan, cloud
    if left_out.error is None:
        raise InputError(
            sequence.source, "no complete scan with points in it" if seen else "no scan in it"
        )
    if seen == 1:
        raise left_out.error
    none = f"none of its {seen} scans can be used: {left_out.in_words()}"
    raise InputError(left_out.error.source, [*left_out.error.problems, none]) from left_out.error


def read_usable(
    sequence: ScanSequence, at: At | None
) -> tuple[TimedScan, PointCloud, tuple[str, ...]]:
    """Return a scan by number or time, its points, and notes; by default the first usable one.

    Raises InputError where there is no such scan, or it has no point.
    """
    if at is not None:
        scan = scan_at(sequence, at)
        return scan, with_points(scan.read()), ()
    left_out = LeftOut()
    scan, cloud = find_usable(sequence, left_out)
    notes = tuple(f"{sequence.source}: left out {words}" for words in left_out.first.values())
    return scan, with_points(cloud), notes
