"""How soon the second process sends: `python -m benchmarks.hand`.

A deciding process sends ten times a second on a link: as datagrams of MAVLink, on topics of ROS 2,
or in a flight mode of PX4. At random moments it is killed, or stopped. Printed are the longest gap
between two set-points from then on, less the period, and how many escapes were flown to their end.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.ros2 import ON_THIS_MACHINE

SUPPORT = Path(__file__).resolve().parent.parent / "tests" / "support"
PERIOD_S, LASTS_S, LOOKS_S = 0.1, 4.0, 0.0005
LINKS = {"mavlink": "MAVLink", "px4": "PX4's mode", "ros2": "ROS 2"}


def cut_once(link: str, number: signal.Signals, moment_s: float) -> tuple[float, bool]:
    """The longest gap around a cut, and whether the escape was flown to its end."""
    sys.path.append(str(SUPPORT))
    from hand_links import EARS
    from hand_pair import Pair

    ear = EARS[link]()
    with tempfile.TemporaryDirectory() as folder:
        pair = Pair(Path(folder), ear, "fly(100)")
        pair.until("own 2")
        ear.timeout_s = LOOKS_S
        cut_s, times, last = time.monotonic() + moment_s, [time.monotonic()], ""
        done = False
        while last != "over" and time.monotonic() < cut_s + LASTS_S:
            if not done and time.monotonic() >= cut_s:
                pair.decider.send_signal(number)
                done = True
            try:
                last = pair.next()
            except (TimeoutError, BlockingIOError):
                continue
            if last.startswith(("own", "hand")):
                times.append(time.monotonic())
        if last != "over":
            times.append(time.monotonic())
        pair.decider.kill()
        pair.decider.communicate()
    ear.close()
    return max(b - a for a, b in pairwise(times)), last == "over"


def main() -> None:
    """Cut as often as is asked for, and print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hand", description=__doc__)
    parser.add_argument("--link", choices=sorted(LINKS), action="append", help="default: each")
    parser.add_argument("--killed", type=int, default=50, help="on each link")
    parser.add_argument("--stopped", type=int, default=20, help="on each link")
    options = parser.parse_args()
    os.environ |= ON_THIS_MACHINE
    rng = random.Random(5)
    print("| deciding process | cases | flown to the end | median | 95 % | longest | load |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for link in options.link or LINKS:
        for name, number in (("killed", signal.SIGKILL), ("stopped", signal.SIGSTOP)):
            count = getattr(options, name)
            if not count:
                continue
            found = [cut_once(link, number, rng.uniform(0.0, 0.3)) for _ in range(count)]
            late = 1e3 * (np.array([gap for gap, _ in found]) - PERIOD_S)
            spread = " | ".join(f"{one:.0f} ms" for one in np.percentile(late, [50.0, 95.0, 100.0]))
            flown = f"{count} | {sum(flown for _, flown in found)} of {count}"
            load = f"{os.getloadavg()[0]:.0f}"
            print(f"| {LINKS[link]}, {name} | {flown} | {spread} | {load} |", flush=True)


if __name__ == "__main__":
    main()
