"""Readers in a process of their own: their results, their errors, and how they may end."""

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.io.apart import apart, items_apart

FILE = Path("some.laz")


def told(call, *arguments):
    with pytest.raises(InputError) as error:
        apart(FILE, "LAZ file", call, *arguments)
    return str(error.value)


def test_results_come_back_as_they_are():
    values = apart(FILE, "LAZ file", np.arange, 100_000)
    np.testing.assert_array_equal(values, np.arange(100_000))
    assert values.flags.writeable
    assert apart(FILE, "LAZ file", os.getpid) != os.getpid()


def test_items_come_one_by_one_and_the_process_ends_with_the_interest():
    items = items_apart(FILE, "LAZ file", range, 10**9)
    assert [next(items) for _ in range(3)] == [0, 1, 2]
    items.close()


def test_errors_of_the_reader_are_told():
    assert told(int, "x").startswith("some.laz: damaged or truncated LAZ file (ValueError: ")


def test_a_process_that_ends_is_an_error_of_the_file():
    assert told(os.abort) == (
        "some.laz: damaged LAZ file: the library that reads it broke down (SIGABRT)"
    )
    assert "(SIGFPE)" in told(signal.raise_signal, signal.SIGFPE)
    assert "(status 3)" in told(os._exit, 3)


def test_too_much_memory_is_an_error_of_the_file():
    assert "takes more memory than such a file can need" in told(bytearray, 2_000_000_000)


def test_what_does_not_come_to_an_end_is_ended(monkeypatch):
    monkeypatch.setattr("clearway.io.apart.CPU_S", 1)
    assert told(pow, 3, 10**9) == "some.laz: damaged LAZ file: reading it does not come to an end"
    monkeypatch.setattr("clearway.io.apart.LONGEST_WAIT_S", 0.5)
    assert told(time.sleep, 60.0).endswith("reading it does not come to an end")


def test_nothing_that_a_library_prints_is_seen(capfd):
    assert apart(FILE, "LAZ file", os.system, "echo out; echo err >&2") == 0
    assert capfd.readouterr() == ("", "")
