"""How soon the second process sends: `python -m benchmarks.hand`.

A deciding process sends ten times a second. At random moments it is killed, or stopped. Printed are
the longest gap between two set-points from then on, less the period, and how many escapes were
flown to their end.
"""

from __future__ import annotations

import argparse
import random
import signal
import socket
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

SUPPORT = Path(__file__).resolve().parent.parent / "tests" / "support"
PERIOD_S, LASTS_S = 0.1, 4.0
CUTS = {"killed": signal.SIGKILL, "stopped": signal.SIGSTOP}


def cut_once(number: signal.Signals, moment_s: float) -> tuple[float, bool]:
    """The longest gap around a cut, and whether the escape was flown to its end."""
    sys.path.append(str(SUPPORT))
    from hand_pair import Pair

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as heard:
        heard.bind(("127.0.0.1", 0))
        heard.settimeout(3.0)
        with tempfile.TemporaryDirectory() as folder:
            pair = Pair(Path(folder), heard, "fly(100)")
            pair.until("own 2")
            heard.settimeout(0.0005)
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
            pair.decider.kill()
            pair.decider.communicate()
    return max(b - a for a, b in pairwise(times)), last == "over"


def main() -> None:
    """Cut as often as is asked for, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="of each kind")
    count, rng = parser.parse_args().count, random.Random(5)
    print("| deciding process | cases | flown to the end | median | 95 % | longest |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, number in CUTS.items():
        found = [cut_once(number, rng.uniform(0.0, 0.3)) for _ in range(count)]
        late = 1e3 * (np.array([gap for gap, _ in found]) - PERIOD_S)
        told = " | ".join(f"{one:.0f} ms" for one in np.percentile(late, [50.0, 95.0, 100.0]))
        print(f"| {name} | {count} | {sum(flown for _, flown in found)} of {count} | {told} |")


if __name__ == "__main__":
    main()
