"""A deciding process of its own that runs a script, and its second process; both can be stopped."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

DECIDER = """
import json, os, socket, sys, time
from clearway.hand.hand import SecondProcess
from clearway.hand.handover import HandOver, Kind, Scheduled, Packet, encode

port, log, period_s = int(sys.argv[1]), os.open(sys.argv[2], os.O_RDWR | os.O_CREAT), 0.1
way = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
sender = {"descriptor": way.fileno(), "line": False, "key": None}
said = []
hand = SecondProcess.start(
    "clearway.mavlink.hand_process", sender, (way.fileno(),), period_s, log=log, notice=said.append
)

def escape(first, moments):
    now = time.monotonic()
    return HandOver(
        tuple(Scheduled(now + n * period_s, (Packet(0, b"hand %d" % (first + n)),))
              for n in range(moments)),
        peer=("127.0.0.1", port), begins=(Packet(0, b"begins"),), over=(Packet(0, b"over"),),
        nothing=(Packet(0, b"nothing"),),
    )

def speak(text):
    return hand.speak(lambda: way.sendto(text, ("127.0.0.1", port)))

def fly(ticks, first=0, late_s=0.0):
    for n in range(first, first + ticks):
        hand.hand_over(escape(n, 8))
        if not speak(b"own %d" % n):
            return False
        time.sleep(period_s + late_s)
    return True

print(hand._process.pid, flush=True)
"""


class Pair:
    """A deciding process that runs a script, and its second one."""

    def __init__(self, folder: Path, heard: socket.socket, script: str) -> None:
        self.log, self._heard = folder / "log.jsonl", heard
        words = [sys.executable, "-c", DECIDER + script, str(heard.getsockname()[1]), str(self.log)]
        self.decider = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert self.decider.stdout is not None
        self.hand = int(self.decider.stdout.readline())

    def next(self) -> str:
        return self._heard.recv(4096).decode()

    def until(self, text: str) -> list[str]:
        """What is heard up to a text, with it."""
        found = [self.next()]
        while found[-1] != text:
            found.append(self.next())
        return found

    def rows(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.log.read_text().splitlines()]

    def stop(self) -> None:
        """Between two set-points, while it does not have the word."""
        time.sleep(0.03)
        self.decider.send_signal(signal.SIGSTOP)

    def ended(self) -> str:
        """What the deciding process printed at its end."""
        output, errors = self.decider.communicate(timeout=20)
        assert self.decider.returncode == 0, errors
        return output

    def hand_ends(self) -> bool:
        return wait_for(lambda: not is_running(self.hand))


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def wait_for(holds: Callable[[], bool], seconds: float = 10.0) -> bool:
    until = time.monotonic() + seconds
    while not holds() and time.monotonic() < until:
        time.sleep(0.01)
    return holds()
