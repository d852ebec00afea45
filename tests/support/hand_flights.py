"""A deciding process that is killed or stopped in flight, and what its vehicle hears and does."""

from __future__ import annotations

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from clearway.mavlink.links import MOST_PIECES, Address, Peer, UdpLink
from clearway.mavlink.simulated_autopilot import SimulatedAutopilot
from clearway.mavlink.simulated_pilot import SimulatedPilot
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from free_ports import free_port

WALL = """
[mission]
name = "wall"
waypoints_m = [[60, 0, 5]]
reach_radius_m = 1.5

[vehicle]
kind = "multirotor"
position_m = [0, 0, 5]
speed_mps = 3.0
body_radius_m = 0.3
climb_mps = 0
sink_mps = 0

[grid]
range_m = 20

[safety]
margin_m = 1.0
obstacles_span_m = [0, 10]

[[obstacle]]
name = "wall"
shape = "cuboid"
position_m = [25, 0, 5]
size_m = [1, 40, 20]
"""
STEP_S = 0.05
TIMESTAMP_NS = 35
"""SO_TIMESTAMPNS: the kernel tells when each datagram came."""
SET_POINT = 84
STARTS_S = 120.0


class StampedLink(UdpLink):
    """A link that notes when set-points came, on the monotonic clock, and who sent them."""

    def __init__(self, port: int) -> None:
        super().__init__(Address("udpout", "127.0.0.1", port), Counter())
        self._socket.setsockopt(socket.SOL_SOCKET, TIMESTAMP_NS, 1)
        self.came_s: list[float] = []

    def receive(self) -> list[tuple[bytes, Peer]]:
        pieces: list[tuple[bytes, Peer]] = []
        ahead_s = time.time() - time.monotonic()
        while len(pieces) < MOST_PIECES:
            try:
                data, told, _, peer = self._socket.recvmsg(4096, 128)
            except OSError:
                break
            if int.from_bytes(data[7:10], "little") == SET_POINT:
                seconds, nanoseconds = struct.unpack("qq", told[0][2])
                self.came_s.append(seconds + 1e-9 * nanoseconds - ahead_s)
            pieces.append((data, peer))
        return pieces


@dataclass
class Flight:
    """What came of it."""

    autopilot: SimulatedAutopilot
    came_s: list[float]
    """When set-points came."""
    cut_s: float
    """When the deciding process was killed or stopped."""
    status: int
    said: str
    """On standard error, of both processes."""
    result: dict[str, Any] | None
    pid: int
    """Of the deciding process."""

    @property
    def left(self) -> list[int]:
        """Second processes that are still there."""
        return processes_of(f'"pid": {self.pid},')

    @property
    def gap_s(self) -> float:
        """The longest time without a set-point from the last before the cut until the last."""
        before = [at for at in self.came_s if at <= self.cut_s][-1]
        times = [before, *(at for at in self.came_s if at > self.cut_s)]
        return max(b - a for a, b in pairwise(times))

    @property
    def first_s(self) -> float:
        """From the cut to the first set-point after it."""
        return min(at for at in self.came_s if at > self.cut_s) - self.cut_s

    @property
    def after(self) -> int:
        """Set-points after the cut."""
        return sum(at > self.cut_s for at in self.came_s)


Cut = Callable[[subprocess.Popen[str]], None]


def kill(decider: subprocess.Popen[str]) -> None:
    decider.kill()


def end(decider: subprocess.Popen[str]) -> None:
    decider.terminate()


def stop(decider: subprocess.Popen[str]) -> None:
    decider.send_signal(signal.SIGSTOP)


def fly(
    folder: Path,
    cut: Cut,
    at_s: float,
    *,
    mission: str = WALL,
    after_s: float = 6.0,
    continues_s: float | None = None,
    command: str = "mavlink",
    more: Sequence[str] = (),
    key: bytes | None = None,
) -> Flight:
    """Fly a mission in real time, cut the decider at a mission time, and fly on for a while.

    continues_s: so long after the cut it is told to go on.
    """
    path, port, commands = folder / "m.toml", free_port(), free_port()
    path.write_text(mission)
    file = read_mission_file(str(path))
    setup = prepare(file)
    words = [str(path), "--connect", f"udpin:127.0.0.1:{port}", "--act", "--json", *more]
    if key is not None:
        (folder / "key").write_bytes(key)
        (folder / "key").chmod(0o600)
        words += ["--signing-key", str(folder / "key")]
    if command == "guard":
        words += ["--commands", f"udpin:127.0.0.1:{commands}"]
    errors = (folder / "said.txt").open("w+")
    decider = subprocess.Popen(
        [sys.executable, "-m", "clearway", command, *words],
        stdout=subprocess.PIPE, stderr=errors, text=True,
    )  # fmt: skip
    try:
        until = time.monotonic() + STARTS_S
        while "waiting" not in (folder / "said.txt").read_text():
            assert time.monotonic() < until, "never began"
            assert decider.poll() is None, "never began"
            time.sleep(0.05)
        link = StampedLink(port)
        autopilot = SimulatedAutopilot(file, setup, link, key)
        pilot = None
        if command == "guard":
            to = UdpLink(Address("udpout", "127.0.0.1", commands), Counter())
            goal, speed = setup.mission.goals_m[-1], setup.planner.speed_mps
            pilot = SimulatedPilot(to, key, goal, speed, sticks=False)
        cut_s = _run(autopilot, pilot, decider, cut, at_s, after_s, continues_s)
        # What goes on ends in good order; what stands still cannot.
        decider.send_signal(signal.SIGKILL if continues_s is None else signal.SIGTERM)
        output = decider.communicate(timeout=30)[0]
        link.close()
        if pilot is not None:
            pilot.close()
    finally:
        decider.kill()
        decider.communicate()
        errors.close()
    said = (folder / "said.txt").read_text()
    result = json.loads(output) if output.strip() else None
    return Flight(autopilot, link.came_s, cut_s, decider.returncode, said, result, decider.pid)


def _run(
    autopilot: SimulatedAutopilot,
    pilot: SimulatedPilot | None,
    decider: subprocess.Popen[str],
    cut: Cut,
    at_s: float,
    after_s: float,
    continues_s: float | None,
) -> float:
    began, cut_s = time.monotonic(), 0.0
    while not cut_s or time.monotonic() < cut_s + after_s:
        now = time.monotonic()
        if pilot is not None and not cut_s:
            pilot.command(autopilot.truth, autopilot.boot_ms)
        autopilot.tell()
        time.sleep(max(0.0, began + autopilot.time_s - time.monotonic()))
        autopilot.listen()
        autopilot.fly(autopilot.time_s + STEP_S)
        mission_s = autopilot.mission_s
        if not cut_s and mission_s is not None and mission_s >= at_s:
            cut(decider)
            cut_s = time.monotonic()
        if not cut_s:
            assert now < began + at_s + STARTS_S, "nothing was ever flown"
        if cut_s and continues_s is not None and now >= cut_s + continues_s:
            decider.send_signal(signal.SIGCONT)
            continues_s = None
    return cut_s


def processes_of(text: str) -> list[int]:
    """Processes that have a text in their command line."""
    found = []
    for one in Path("/proc").iterdir():
        if one.name.isdigit() and int(one.name) != os.getpid():
            try:
                words = (one / "cmdline").read_bytes().decode(errors="replace")
            except OSError:
                continue
            if text in words:
                found.append(int(one.name))
    return found
