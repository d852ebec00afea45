"""Times of BlueSky that finds conflicts and resolves them by its MVP; run by the peers' Python.

    python time_bluesky.py courses.json calls workdir

The first of the aircraft is the own one; all of them avoid, as BlueSky does. Prints processor times
of finding and resolving as JSON.
"""

import json
import math
import sys
import time
from pathlib import Path

import bluesky as bs
from bluesky.tools.aero import ft

EARTH_M = 6371000.0
SCALE = 100.0
"""Lengths and speeds: BlueSky's aircraft fly hundreds of metres a second."""


def main():
    path, calls, workdir = sys.argv[1:]
    bs.init(mode="sim", detached=True, workdir=workdir)
    for command in ("CDMETHOD STATEBASED", "RESO MVP", "DTLOOK 20"):
        bs.stack.stack(command)
    for number, course in enumerate(json.loads(Path(path).read_text(encoding="utf-8"))):
        (x, y, z), (vx, vy, _) = course["position"], course["velocity"]
        bs.traf.cre(
            f"A{number}", "B744", math.degrees(y * SCALE / EARTH_M),
            math.degrees(x * SCALE / EARTH_M), math.degrees(math.atan2(vx, vy)) % 360.0,
            (10_000.0 * ft) + z * SCALE, math.hypot(vx, vy) * SCALE,
        )  # fmt: skip
    for _ in range(3):
        bs.sim.step()
    taken, found = [], 0
    for _ in range(int(calls) + 1):
        began = time.process_time()
        bs.traf.cd.update(bs.traf, bs.traf)
        if bs.traf.cd.confpairs:
            bs.traf.cr.update(bs.traf.cd, bs.traf, bs.traf)
        taken.append(time.process_time() - began)
        found = len(bs.traf.cd.confpairs)
    print(json.dumps({"conflicts": found, "taken_s": taken[1:]}))


if __name__ == "__main__":
    main()
