"""A simulated autopilot to try `clearway mavlink` and `clearway guard` on.

`python -m clearway.mavlink.simulated MISSION` flies it over a link; with `--pilot` somebody
commands it, straight at the last goal.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from pathlib import Path

from clearway.base.errors import ClearwayError
from clearway.mavlink.links import FrameLink, open_link
from clearway.mavlink.signing import read_key
from clearway.mavlink.simulated_autopilot import SimulatedAutopilot
from clearway.mavlink.simulated_pilot import SimulatedPilot
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare

TARGET_NAME = "SET_POSITION_TARGET_LOCAL_NED"
ANSWER_S = 5.0
"""In lock-step, how long a set-point is waited for."""
SILENT_S = 0.05
"""How long one is waited for where none has come for a while."""
UNANSWERED = 3
"""So many moments without any set-point are a while."""
MOST_SILENCE_S = 30.0
"""Without any set-point for so long by our clock, it ends."""


def run_autopilot(
    autopilot: SimulatedAutopilot,
    link: FrameLink,
    period_s: float,
    duration_s: float,
    speedup: float | None,
    pilot: SimulatedPilot | None = None,
) -> None:
    """Tell, listen, fly, over and over, until it has arrived or time is up."""
    began = answered = time.monotonic()
    while autopilot.time_s < duration_s and not autopilot.has_arrived:
        if pilot is not None:
            pilot.command(autopilot.truth, autopilot.boot_ms)
        autopilot.tell()
        if speedup is None:
            _await_answer(autopilot, link)
        else:
            link.wait(began + autopilot.time_s / speedup - time.monotonic())
            time.sleep(max(0.0, began + autopilot.time_s / speedup - time.monotonic()))
        before = autopilot.heard[TARGET_NAME]
        autopilot.listen()
        now = time.monotonic()
        answered = now if autopilot.heard[TARGET_NAME] > before else answered
        if autopilot.target is not None and now - answered > MOST_SILENCE_S:
            break
        autopilot.fly(autopilot.time_s + period_s)


def _await_answer(autopilot: SimulatedAutopilot, link: FrameLink) -> None:
    """Until the set-point of this moment has come, but not for ever."""
    before = autopilot.heard[TARGET_NAME]
    waiting_s = ANSWER_S if autopilot.unanswered < UNANSWERED else SILENT_S
    until = time.monotonic() + waiting_s
    while autopilot.target_ms != autopilot.boot_ms and time.monotonic() < until:
        link.wait(until - time.monotonic())
        autopilot.listen()
    any_came = autopilot.heard[TARGET_NAME] > before
    autopilot.unanswered = 0 if any_came else autopilot.unanswered + 1


def main(arguments: list[str] | None = None) -> int:
    """Entry point; 0 if the vehicle arrived, 1 if not, 2 for bad input."""
    parser = argparse.ArgumentParser(description="A simulated autopilot for `clearway mavlink`.")
    parser.add_argument("mission", help="a mission by name, or a mission file")
    parser.add_argument("--connect", default="udpout:127.0.0.1:14550")
    parser.add_argument("--rate", type=float, default=10.0, help="messages of each kind a second")
    parser.add_argument("--duration", type=float, default=600.0, help="at most; its own seconds")
    parser.add_argument("--speedup", type=float, default=1.0, help="its clock against ours")
    parser.add_argument("--lock-step", action="store_true", help="wait for every set-point")
    parser.add_argument("--signing-key", type=Path)
    parser.add_argument("--pilot", help="address on which a guardian hears somebody command")
    parser.add_argument("--sticks", action="store_true", help="who commands holds sticks")
    options = parser.parse_args(arguments)
    try:
        key = None if options.signing_key is None else read_key(options.signing_key)
        file = read_mission_file(options.mission)
        setup = prepare(file)
        link = open_link(options.connect, Counter())
        pilot = None
        if options.pilot is not None:
            to, speed = open_link(options.pilot, Counter(), "--pilot"), setup.planner.speed_mps
            goal = setup.mission.goals_m[-1]
            pilot = SimulatedPilot(to, key, goal, speed, sticks=options.sticks)
    except ClearwayError as error:
        print(error, file=sys.stderr)
        return 2
    autopilot = SimulatedAutopilot(file, setup, link, key)
    speedup = None if options.lock_step else options.speedup
    run_autopilot(autopilot, link, 1.0 / options.rate, options.duration, speedup, pilot)
    link.close()
    if pilot is not None:
        pilot.close()
    print(json.dumps(autopilot.summary()))
    return 0 if autopilot.has_arrived else 1


if __name__ == "__main__":
    sys.exit(main())
