"""Speed of traffic files: Mode S against the decoder alone, closest pairs of a busy sky."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.table import Benchmark, Row, Target
from benchmarks.timing import in_words, timed
from clearway.io.traffic.beast import read_beast
from clearway.io.traffic.mode_s_hex import read_hex
from clearway.traffic.recorded import (
    TrafficRecording,
    TrafficReport,
    closest_pairs,
    collect_aircraft,
)

POSITIONS = ("8D40621D58C382D690C8AC2863A7", "8D40621D58C386435CC412692AD6")
VELOCITY, CALLSIGN = "8D485020994409940838175B284F", "8D4840D6202CC371C32CE0576098"
STATUS = "8DA05629EA21485CBF3F8CADAEEB"
"""Published by J. Sun (The 1090 Megahertz Riddle)."""
MESSAGES = (*POSITIONS, *POSITIONS, *4 * (VELOCITY,), CALLSIGN, STATUS, STATUS, STATUS)
"""In the shares of a minute recorded near an airport."""
REPEATS = 2_000
LEAST_SHARE = 0.7


def _stream(quick: bool) -> tuple[list[str], list[float]]:
    """Messages of a minute, over and over, and a time for each."""
    messages = list(MESSAGES * (REPEATS // 5 if quick else REPEATS))
    return messages, [1.7e9 + number for number in range(len(messages))]


def mode_s(quick: bool) -> Row:
    messages, times_s = _stream(quick)
    content = "".join(
        f"{time_s:.3f},{message}\n" for time_s, message in zip(times_s, messages, strict=True)
    ).encode()
    return _beside_the_decoder("Mode S messages, lines of time and hex,", read_hex, content, quick)


def beast(quick: bool) -> Row:
    messages, times_s = _stream(quick)
    heads = [round(12e6 * (time_s - times_s[0])).to_bytes(6, "big") + b"\x40" for time_s in times_s]
    content = b"".join(
        b"\x1a3" + (head + bytes.fromhex(message)).replace(b"\x1a", b"\x1a\x1a")
        for head, message in zip(heads, messages, strict=True)
    )
    return _beside_the_decoder("Beast frames", read_beast, content, quick)


def _beside_the_decoder(
    what: str, read: Callable[[str, bytes], TrafficRecording], content: bytes, quick: bool
) -> Row:
    """A recording into reports; the reference decodes strings that lie ready."""
    import rs1090

    messages, times_s = _stream(quick)
    found = sum("latitude" in each for each in rs1090.decode(messages, times_s))
    assert found == len(read("benchmark", content).reports)
    decoder = timed(lambda: rs1090.decode(messages, times_s), quick, seconds=4.0)
    ours = timed(lambda: read("benchmark", content), quick, seconds=4.0)
    share = decoder.median_s / ours.median_s
    return Row(
        f"{len(messages):,} {what} into reports in SI units",
        f"{len(messages) / ours.median_s:,.0f} messages/s",
        f"{in_words(ours.median_s)} in all",
        Target(f">= {LEAST_SHARE:.0%} of the decoder's rate", share >= LEAST_SHARE),
        f"{share:.0%} of the rate of rs1090 alone, {len(messages) / decoder.median_s:,.0f}/s",
    )


def busy_sky(aircraft: int, seconds: int) -> TrafficRecording:
    """Straight flights over 200 km, reported every 4 s."""
    rng = np.random.default_rng(0)
    reports = []
    for number in range(aircraft):
        latitude, longitude = rng.uniform([45.0, 5.0], [47.0, 7.0])
        track = rng.uniform(0.0, 2.0 * np.pi)
        north, east = 1e-3 * np.cos(track), 1e-3 * np.sin(track)
        altitude = float(rng.uniform(500.0, 3_000.0))
        reports += [
            TrafficReport(float(t), f"{number:06x}", latitude + north * t, longitude + east * t,
                          altitude, "barometric", None, 100.0, track)
            for t in range(number % 4, seconds, 4)
        ]  # fmt: skip
    reports.sort(key=lambda report: report.time_s)
    return TrafficRecording("made", "made", "relative", len(reports), tuple(reports))


def pairs(quick: bool) -> Row:
    aircraft = collect_aircraft(busy_sky(100, 600))
    return timed(lambda: closest_pairs(aircraft), quick).row(
        "closest approaches of 100 aircraft over 10 minutes, each second, within 10 km"
    )


BENCHMARKS = (
    Benchmark("traffic, Mode S", mode_s, headline=True),
    Benchmark("traffic, Beast", beast),
    Benchmark("traffic, closest pairs", pairs),
)
