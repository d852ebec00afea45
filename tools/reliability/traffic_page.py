"""Covered of predicted places of recorded aircraft, into docs/results/calibration.md."""

from __future__ import annotations

from pathlib import Path

from clearway.base.intervals import exact_share
from clearway.io.marked_page import put_between_marks
from clearway.io.traffic.traffic import read_traffic
from clearway.studies.reliability.traffic_cover import (
    Track,
    judge_by_parts,
    moments_of,
    ratios_of,
    starts_of,
    verdicts_of,
)
from clearway.traffic.covering import NO_STARTS, STARTS, Covered, Key
from clearway.traffic.recorded import collect_aircraft
from tools.reliability.kept_page import PAGE


def tracks_of(recordings: list[Path]) -> list[Track]:
    """All aircraft of recordings that have at least two moments."""
    return [
        track
        for path in recordings
        for track in moments_of(collect_aircraft(read_traffic(path)))
        if len(track) > 1
    ]


def write(recordings: list[Path]) -> None:
    """The table into the page; prints the factors that `covering.STARTS` holds."""
    tracks = tracks_of(recordings)
    print(starts_of(map(ratios_of, tracks)), "STARTS:", STARTS)
    put_between_marks(PAGE, "traffic", _table(tracks))


def _table(tracks: list[Track]) -> str:
    found, plain = judge_by_parts(tracks), _plain(tracks)
    moments = sum(map(len, tracks))
    lines = [
        f"{len(tracks)} recorded aircraft, {moments:,} moments.",
        "",
        "| moves as | ahead | predictions | level, light aircraft | level, learned | "
        "height, light aircraft | height, learned |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for (motion, ahead_s), verdicts in found.items():
        before = plain[motion, ahead_s]
        lines.append(
            f"| {motion.name.lower()} | {ahead_s:g} s | {len(verdicts):,} | "
            f"{_share([one.level for one in before])} | "
            f"{_share([one.level for one in verdicts])} | "
            f"{_share([one.height for one in before])} | "
            f"{_share([one.height for one in verdicts])} |"
        )
    return "\n".join(lines)


def _plain(tracks: list[Track]) -> dict[Key, list[Covered]]:
    """By the encounter model's light aircraft, nothing learned."""
    return verdicts_of(tracks, NO_STARTS, step=0.0)


def _share(held: list[bool]) -> str:
    low, high = exact_share(sum(held), len(held))
    return f"{100 * sum(held) / len(held):.1f} % ({100 * low:.1f} to {100 * high:.1f})"
