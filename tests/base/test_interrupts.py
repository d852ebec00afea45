"""Ctrl-C at any moment of compiled code ends it as it ends Python, in no other way."""

from __future__ import annotations

import subprocess
import sys

INTERRUPTED = """
import collections, faulthandler, random, signal, sys, time
import numpy as np
from clearway.base.compiled import compiled

faulthandler.enable()

@compiled
def slow(count):
    total = 0.0
    for n in range(count):
        total += np.sin(n)
    return np.full(3, total), np.zeros(2)

def interrupt(*_):
    raise KeyboardInterrupt

slow(10)
signal.signal(signal.SIGALRM, interrupt)
moments, ended, began = random.Random(4), collections.Counter(), time.monotonic()
while time.monotonic() - began < 60.0 and sum(ended.values()) < 300:
    try:
        signal.setitimer(signal.ITIMER_REAL, moments.uniform(1e-4, 2e-3))
        while True:
            slow(3000)
    except BaseException as error:
        ended[type(error).__name__] += 1
print(dict(ended))
"""


def test_an_interrupt_is_an_interrupt_whatever_is_computed() -> None:
    command = [sys.executable, "-c", INTERRUPTED]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.strip() == "{'KeyboardInterrupt': 300}"
