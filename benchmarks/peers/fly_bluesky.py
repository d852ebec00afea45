"""Encounters flown by BlueSky with its MVP; run by the peers' Python, never imported by clearway.

    python fly_bluesky.py courses.json tracks.json workdir

The whole simulator runs, without windows or network. Its aircraft turn with 25 degrees of bank, so
that at 100 m/s the turning circle is 2.2 km; lengths are scaled until that is the circle of our
automaton, and times with them. Zone, distance of detection and tracks are then the same in units
of that circle. There is no performance envelope, the intruder is told not to resolve, and the
protected zone is the distance to keep, with BlueSky's own factor of 1.05 on top. Two variants:
"bluesky mvp" with heading and speed, as by default, and "bluesky mvp, heading only", which is what
a vehicle of constant speed can do.
"""

import json
import math
import sys
from pathlib import Path

import bluesky as bs
from bluesky.tools.aero import ft, nm, tas2cas

OWN_MPS = 100.0
BANK_RAD = math.radians(25.0)
EARTH_M = 6371000.0
STEP_S = 0.5
"""Of the simulation, at that scale."""
TOGETHER = 20
"""Encounters in one simulation, a degree of latitude apart."""
HORIZON_S = 10.0
"""Look-ahead, as the grid's range is 10 movements; scaled like all times."""
ALTITUDE_FT = 10000.0


def fly(courses, keep, turn_rps, headings_only):
    """[courses][n, 5] time and both positions, at our scale."""
    length = OWN_MPS**2 / (9.80665 * math.tan(BANK_RAD)) * turn_rps
    time = length / OWN_MPS
    bs.stack.stack("RESET")
    bs.sim.step()
    for command in (
        "CDMETHOD STATEBASED", "RESO MVP", f"ZONER {keep * length / nm}",
        "ZONEDH 1000", f"DTLOOK {HORIZON_S * time}", "RFACH 1.05",
        f"RMETHH {'HDG' if headings_only else 'BOTH'}", f"DT {STEP_S}",
    ):  # fmt: skip
        bs.stack.stack(command)
    for number, course in enumerate(courses):
        latitude = _latitude(number)
        _create(f"OWN{number}", latitude, (0.0, 0.0), (1.0, 0.0), length)
        _create(f"INT{number}", latitude, course["position"], course["velocity"], length)
        bs.stack.stack(f"RESOOFF INT{number}")
    rows, start = [[] for _ in courses], None
    lasts = max(course["lasts_s"] for course in courses)
    while True:
        bs.sim.step()
        if bs.traf.ntraf < 2 * len(courses):
            continue
        # The first step is the one in which the aircraft appear.
        start = bs.sim.simt if start is None else start
        elapsed = (bs.sim.simt - start) / time
        for number, course in enumerate(courses):
            if elapsed <= course["lasts_s"] + 1e-9:
                own, other = (_place(f"{name}{number}", number, length) for name in ("OWN", "INT"))
                rows[number].append([elapsed, *own, *other])
        if elapsed > lasts:
            return rows


def _create(name, latitude, position, velocity, length):
    """An aircraft in level flight; x is east, y is north."""
    x, y = position[0] * length, position[1] * length
    east = math.degrees(x / EARTH_M) / math.cos(math.radians(latitude))
    heading = math.degrees(math.atan2(velocity[0], velocity[1])) % 360.0
    speed = math.hypot(*velocity) * OWN_MPS
    bs.traf.cre(
        name, "B744", latitude + math.degrees(y / EARTH_M), east, heading,
        ALTITUDE_FT * ft, _calibrated(speed),
    )  # fmt: skip


def _calibrated(true_mps):
    return float(tas2cas(true_mps, ALTITUDE_FT * ft))


def _place(name, number, length):
    at = bs.traf.id2idx(name)
    latitude = _latitude(number)
    x = math.radians(bs.traf.lon[at]) * EARTH_M * math.cos(math.radians(bs.traf.lat[at]))
    y = math.radians(bs.traf.lat[at] - latitude) * EARTH_M
    return x / length, y / length


def _latitude(number):
    return float(number - TOGETHER // 2)


def _settings(workdir):
    """BlueSky's own, but without a performance envelope: its aircraft fly any speed."""
    default = Path(bs.__file__).parent / "resources" / "default.cfg"
    text = default.read_text(encoding="utf-8")
    changed = text.replace("performance_model = 'openap'", "performance_model = 'perfbase'")
    if changed == text:
        sys.exit(f"{default}: no performance model to switch off")
    (workdir / "settings.cfg").write_text(changed, encoding="utf-8")


def main():
    courses, out, workdir = sys.argv[1:]
    with open(courses, encoding="utf-8") as file:
        given = json.load(file)
    _settings(Path(workdir))
    bs.init(mode="sim", detached=True, workdir=workdir)
    flown = {}
    for name, only in (("bluesky mvp", False), ("bluesky mvp, heading only", True)):
        flown[name] = []
        for at in range(0, len(given["courses"]), TOGETHER):
            group = given["courses"][at : at + TOGETHER]
            flown[name] += fly(group, given["keep_m"], given["turn_rps"], only)
    with open(out, "w", encoding="utf-8") as file:
        json.dump(flown, file)


if __name__ == "__main__":
    main()
