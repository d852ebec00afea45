"""A simulated PX4 to try `clearway px4` on: `python -m clearway.px4.simulated MISSION`.

Its pilot arms once a mode has registered, takes off, and chooses that mode.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import Final

from clearway.base.errors import ClearwayError
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.px4.mode import FIRST_MODE, HOLD_MODE
from clearway.px4.releases import RELEASES
from clearway.px4.simulated_commander import TAKE_OFF
from clearway.px4.simulated_px4 import SimulatedPx4
from clearway.ros2.dds import DdsBus, domain_id

STEP_S: Final = 0.1
ANSWER_S: Final = 1.0
"""In lock-step, how long a set-point is waited for."""
ENDS_S: Final = 2.0
"""After the mode has told that it is done, or was left, it is flown on for so long."""


class ModePilot:
    """Arms, takes off and chooses the mode of a name; ask `act` at every step."""

    def __init__(self, px4: SimulatedPx4, name: str) -> None:
        self._px4, self._name = px4, name
        self.ended_s: float | None = None
        """When the mode was done, or was left."""
        self._has_flown = False

    def act(self) -> None:
        """What a pilot does now."""
        commander, now_s = self._px4.commander, self._px4.time_s
        mode = commander.mode_named(self._name)
        flies = commander.nav_state >= FIRST_MODE
        if self._has_flown and (commander.completed or not flies):
            self.ended_s = now_s if self.ended_s is None else self.ended_s
        elif flies:
            self._has_flown = True
        elif mode is not None and not commander.is_armed and commander.modes:
            if any(one.answer is not None for one in commander.modes.values()):
                commander.choose(TAKE_OFF)
                commander.arm()
        elif mode is not None and commander.is_armed and commander.nav_state == HOLD_MODE:
            commander.choose(mode)


def fly(px4: SimulatedPx4, pilot: ModePilot, duration_s: float, *, lock_step: bool) -> None:
    """Step it until the mode is done or was left, or time is up."""
    began = time.monotonic()
    while px4.time_s < duration_s:
        pilot.act()
        px4.step(STEP_S)
        if pilot.ended_s is not None and px4.time_s >= pilot.ended_s + ENDS_S:
            break
        if not lock_step:
            time.sleep(max(0.0, began + px4.time_s - time.monotonic()))
            continue
        # Before the mode flies, both ends' questions take time of their own.
        until = time.monotonic() + (ANSWER_S if px4.flies_external else 0.05)
        while px4.answered_s < px4.time_s - 1e-6 and time.monotonic() < until:
            px4.bus.wait(until - time.monotonic())
            px4.listen()


def main(arguments: list[str] | None = None) -> int:
    """Entry point; 0 if the mode told that it is done, 1 if not, 2 for bad input."""
    parser = argparse.ArgumentParser(description="A simulated PX4 for `clearway px4`.")
    parser.add_argument("mission", help="a mission by name, or a mission file")
    parser.add_argument("--release", choices=sorted(RELEASES), default="1.18")
    parser.add_argument("--domain", type=int, help="DDS domain; default: ROS_DOMAIN_ID, or 0")
    parser.add_argument("--mode", default="clearway", help="name of the mode to choose")
    parser.add_argument("--cloud", default="", help="topic of a cloud, in place of distances")
    parser.add_argument("--duration", type=float, default=600.0, help="at most; its own seconds")
    parser.add_argument("--lock-step", action="store_true", help="wait for every set-point")
    options = parser.parse_args(arguments)
    try:
        file = read_mission_file(options.mission)
        setup = prepare(file)
        bus = DdsBus(domain_id() if options.domain is None else options.domain)
    except ClearwayError as error:
        print(error, file=sys.stderr)
        return 2
    release = RELEASES[options.release]
    px4 = SimulatedPx4(bus, file, setup, release, cloud_topic=options.cloud)
    fly(px4, ModePilot(px4, options.mode), options.duration, lock_step=options.lock_step)
    bus.close()
    print(json.dumps(px4.summary()))
    return 0 if px4.commander.completed else 1


if __name__ == "__main__":
    sys.exit(main())
