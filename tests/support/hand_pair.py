"""A deciding process of its own that runs a script, and its second process; both can be stopped."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hand_links import Ear

READY_S = 30.0
SUPPORT = Path(__file__).resolve().parent
DECIDER = """
import os, sys, time
from clearway.hand.hand import SecondProcess
from clearway.hand.handover import HandOver, Kind, Scheduled, encode
from hand_links import WAYS

way, log, period_s = WAYS[sys.argv[1]](int(sys.argv[2])), sys.argv[3], 0.1
log = os.open(log, os.O_RDWR | os.O_CREAT)
said = []

def note(text):
    said.append(text)
    print(text, file=sys.stderr, flush=True)

hand = SecondProcess.start(
    way.module, way.sender, way.descriptors, period_s, log=log, notice=note
)

def escape(first, moments):
    now = time.monotonic()
    return HandOver(
        tuple(Scheduled(now + n * period_s, way.packets("hand %d" % (first + n)))
              for n in range(moments)),
        peer=way.peer, begins=way.packets("begins"), over=way.packets("over"),
        nothing=way.packets("nothing"),
    )

def speak(text):
    return hand.speak(lambda: way.send(text))

def fly(ticks, first=0, late_s=0.0):
    for n in range(first, first + ticks):
        hand.hand_over(escape(n, 8))
        if not speak("own %d" % n):
            return False
        time.sleep(period_s + late_s)
    return True

print(hand._process.pid, flush=True)
input()
"""


class Pair:
    """A deciding process that runs a script, and its second one, heard at a link's other end."""

    def __init__(self, folder: Path, ear: Ear, script: str) -> None:
        self.log, self.ear = folder / "log.jsonl", ear
        words = [sys.executable, "-c", DECIDER + script, ear.link, str(ear.at), str(self.log)]
        path = os.pathsep.join([str(SUPPORT), os.environ.get("PYTHONPATH", "")])
        self.decider = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONPATH": path},
        )  # fmt: skip
        assert self.decider.stdin is not None
        assert self.decider.stdout is not None
        self.hand = int(self.decider.stdout.readline())
        assert wait_for(ear.is_ready, READY_S)
        self.decider.stdin.write("\n")
        self.decider.stdin.flush()

    def next(self) -> str:
        return self.ear.next()

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
