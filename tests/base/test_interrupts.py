"""Ctrl-C at any moment of compiled code ends it as it ends Python, in no other way."""

from __future__ import annotations

import subprocess
import sys

import pytest

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


COMPILING = """
import collections, faulthandler, random, signal
import numpy as np
from clearway.base.compiled import compiled

faulthandler.enable()

def interrupt(*_):
    raise KeyboardInterrupt

def made():
    @compiled
    def inner(value, factor):
        return np.sqrt(value ** 2 + factor)

    @compiled
    def loop(values, factor):
        total = np.zeros(3)
        for n in range(len(values)):
            for at in range(3):
                total[at] += inner(values[n], factor * at)
        return total, np.sort(values)

    return loop

values = np.arange(4.0)
signal.signal(signal.SIGALRM, interrupt)
moments, ended, kept = random.Random(5), collections.Counter(), []
for number in range(40):
    fresh = made()
    kept.append(fresh)  # Loops of modules live as long as the process.
    try:
        signal.setitimer(signal.ITIMER_REAL, moments.uniform(0.01, 1.0))
        fresh(values, 1.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        ended["compiled"] += 1
    except KeyboardInterrupt:
        ended["KeyboardInterrupt"] += 1
    kept.append(made())
    assert kept[-1](values, 1.0)[0].shape == (3,)
print(sorted(ended))
"""


@pytest.mark.nightly
def test_an_interrupt_while_code_is_made_leaves_it_working() -> None:
    command = [sys.executable, "-c", COMPILING]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.strip() == "['KeyboardInterrupt', 'compiled']"
    assert "Traceback" not in ran.stderr
