"""Readers in a process of their own: their results, their errors, and how they may end."""

import os
import signal
import subprocess
import sys
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


def is_gone(pid, within_s=5.0):
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.01)
    return False


def pids():
    """For ever; a generator cannot be pickled, a function that makes one can."""
    while True:
        yield os.getpid(), os.getppid()


def test_readers_come_from_one_process_that_has_their_libraries_loaded():
    keeper = apart(FILE, "LAZ file", os.getppid)
    assert keeper != os.getpid()
    assert apart(FILE, "LAZ file", os.getppid) == keeper
    assert apart(FILE, "LAZ file", os.getpid) != apart(FILE, "LAZ file", os.getpid)


def test_a_reader_is_gone_once_nobody_wants_more_of_it():
    items = items_apart(FILE, "LAZ file", pids)
    pid, _ = next(items)
    items.close()
    assert is_gone(pid)


def test_two_readings_at_once_do_not_disturb_each_other():
    first, second = (items_apart(FILE, "LAZ file", pids) for _ in range(2))
    (one, _), (other, _) = next(first), next(second)
    assert one != other
    second.close()
    assert is_gone(other)
    assert next(first)[0] == one
    first.close()


def test_the_process_that_forks_is_begun_again_where_it_was_ended():
    keeper = apart(FILE, "LAZ file", os.getppid)
    os.kill(keeper, signal.SIGKILL)
    # A zombie may have threads that end later, and with them its sockets: this waits for the last.
    os.waitid(os.P_PID, keeper, os.WEXITED | os.WNOWAIT)
    assert apart(FILE, "LAZ file", os.getppid) != keeper


def is_gone_or_dead(pid):
    """A process that has ended stays known until its end was asked for."""
    until = time.monotonic() + 5.0
    while time.monotonic() < until:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
        except FileNotFoundError:
            return True
        if state == "Z":
            return True
        time.sleep(0.01)
    return False


def test_modules_found_elsewhere_are_found_by_readers(tmp_path, monkeypatch):
    begun = items_apart(FILE, "LAZ file", pids)
    _, keeper = next(begun)
    (tmp_path / "found_elsewhere.py").write_text("def two():\n    return 2\n")
    monkeypatch.syspath_prepend(tmp_path)
    import found_elsewhere

    assert apart(FILE, "LAZ file", found_elsewhere.two) == 2
    assert next(begun)[1] == keeper
    begun.close()
    assert is_gone_or_dead(keeper)


def test_readers_see_the_folder_and_the_environment_of_the_moment(tmp_path, monkeypatch):
    apart(FILE, "LAZ file", os.getpid)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("A_NAME", "a value")
    assert apart(FILE, "LAZ file", os.getcwd) == str(tmp_path)
    assert apart(FILE, "LAZ file", os.getenv, "A_NAME") == "a value"


def test_nothing_is_left_behind_by_a_process_that_read():
    script = (
        "import os; from pathlib import Path; from clearway.io.apart import apart; "
        "print(apart(Path('a'), 'file', os.getppid))"
    )
    ended = subprocess.run(
        [sys.executable, "-X", "dev", "-c", script], capture_output=True, text=True, check=True
    )
    assert ended.stderr == ""
    assert is_gone(int(ended.stdout))
