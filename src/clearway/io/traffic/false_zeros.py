"""Altitudes of exactly 0 that stand for "ground" or "unknown", as some recorders write them."""

from __future__ import annotations

from collections.abc import Sequence

from clearway.traffic.recorded.report import TrafficReport

WITHIN_S = 60.0
FALL_M = 300.0
FALL_MPS = 30.0
"""No aircraft comes down to 0 from higher up, or leaves it, faster."""


def without_false_zeros(reports: Sequence[TrafficReport]) -> tuple[list[TrafficReport], int]:
    """Reports, by time, with such altitudes as on the ground; and how many there were.

    One aircraft that falls to 0, or leaves it, faster than anything flies shows that its recorder
    writes 0 where it should not: no 0 of the file is taken for an altitude then.
    """
    zeros = any(report.altitude_m == 0.0 for report in reports)
    if not zeros or not _shows_false_zero(reports):
        return list(reports), 0
    changed = [_is_zero(report) for report in reports]
    told = [
        report._replace(altitude_m=None, altitude_kind="ground") if zero else report
        for report, zero in zip(reports, changed, strict=True)
    ]
    return told, sum(changed)


def _is_zero(report: TrafficReport) -> bool:
    return report.altitude_m == 0.0 and report.altitude_kind == "barometric"


def _shows_false_zero(reports: Sequence[TrafficReport]) -> bool:
    last: dict[str, TrafficReport] = {}
    for report in reports:
        if report.altitude_m is None:
            continue
        before = last.get(report.address)
        if before is not None and before.altitude_m is not None:
            elapsed = report.time_s - before.time_s
            fall = abs(report.altitude_m - before.altitude_m)
            if (
                (_is_zero(report) or _is_zero(before))
                and elapsed <= WITHIN_S
                and fall > FALL_M + FALL_MPS * elapsed
            ):
                return True
        last[report.address] = report
    return False
