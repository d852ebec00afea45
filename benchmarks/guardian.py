"""What a guardian takes for a command: `python -m benchmarks.guardian`.

Hostile and harmless commands by turns, ten a second, in made-up worlds with a map, or with a LiDAR
of 1,500 beams five times a second, as the tests of this checkout fly them. Own places and scans are
taken in before the command comes, as live sessions do, and timed apart. Times are CPU of one
thread.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from clearway.live.guard.guardian import Guardian
from clearway.live.link.guarded import Guarded

SUPPORT = Path(__file__).resolve().parent.parent / "tests" / "support"
FIRST_SEED = 300


class TimedGuardian(Guardian):
    """One that knows how long it took."""

    catch_up_ms: list[float]
    rows_ms: dict[bool, list[float]]
    """By whether the command passed, unchanged or slowed."""

    def __init__(self, *words: Any, **named: Any) -> None:
        super().__init__(*words, **named)
        self.catch_up_ms, self.rows_ms = [], {True: [], False: []}

    def catch_up(self, now_s: float) -> None:
        """Timed."""
        began = time.thread_time()
        super().catch_up(now_s)
        self.catch_up_ms.append(1e3 * (time.thread_time() - began))

    def guard_velocity(self, *words: Any, **named: Any) -> Guarded:
        """Timed."""
        began = time.thread_time()
        out = super().guard_velocity(*words, **named)
        self.rows_ms[out.passed or out.slowed].append(1e3 * (time.thread_time() - began))
        return out


def main() -> None:
    """A table of all four."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.guardian", description=__doc__)
    parser.add_argument("--worlds", type=int, default=10, help="of each kind")
    parser.add_argument("--ticks", type=int, default=150)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    load = os.getloadavg()[0]
    print("| vehicle | knows by | what | n | p50 | p99 | most, ms |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for vehicle in ("stops", "flies on"):
        for with_lidar in (False, True):
            _print(vehicle, with_lidar, _flown(vehicle, options, with_lidar=with_lidar))
    print(f"\nload {load:.1f} before, {os.getloadavg()[0]:.1f} after, {os.cpu_count()} cores")


def _flown(
    vehicle: str, options: argparse.Namespace, *, with_lidar: bool
) -> dict[str, list[float]]:
    sys.path.insert(0, str(SUPPORT))
    import guarded_flights

    guarded_flights.Guardian = TimedGuardian
    found: dict[str, list[float]] = {"passed": [], "replaced": [], "taken in before": []}
    for number in range(options.worlds + 1):
        flight = guarded_flights.GuardedFlight(
            FIRST_SEED + number, vehicle, options.ticks, with_lidar=with_lidar, ahead=True
        )
        if number == 0:
            continue  # Loads modules.
        guardian: TimedGuardian = flight.guardian
        found["passed"] += guardian.rows_ms[True]
        found["replaced"] += guardian.rows_ms[False]
        found["taken in before"] += guardian.catch_up_ms
    return found


def _print(vehicle: str, with_lidar: bool, found: dict[str, list[float]]) -> None:
    for what, taken_ms in found.items():
        p50, p99 = np.percentile(taken_ms, [50, 99])
        knows = "LiDAR" if with_lidar else "a map"
        print(
            f"| {vehicle} | {knows} | {what} | {len(taken_ms)} | {p50:.2f} | {p99:.2f} "
            f"| {max(taken_ms):.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
