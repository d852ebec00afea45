"""The second process, told everything by a deciding process that the test can kill or stop."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hand_links import EARS
from hand_pair import Pair, is_running
from ros2_for_tests import LOOPBACK

pytestmark = pytest.mark.realtime


LINKS = [
    "mavlink",
    *(pytest.param(one, marks=pytest.mark.nightly) for one in ("ros2", "px4")),
]


@pytest.fixture
def link() -> str:
    """Of tests that look at one alone."""
    return "mavlink"


@pytest.fixture
def pair(
    tmp_path: Path, link: str, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str], Pair]]:
    if link != "mavlink":
        pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")
        monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    begun, ear = list[Pair](), EARS[link]()

    def begin(script: str) -> Pair:
        begun.append(Pair(tmp_path, ear, script))
        return begun[-1]

    yield begin
    for one in begun:
        one.decider.kill()
        one.decider.communicate()
        if is_running(one.hand):
            os.kill(one.hand, signal.SIGKILL)
    ear.close()


@pytest.mark.parametrize("link", LINKS)
def test_killed_its_escape_is_flown_to_the_end_and_nothing_else(
    pair: Callable[[str], Pair],
) -> None:
    both = pair("fly(100)")
    both.until("own 3")
    both.decider.kill()
    came = both.until("over")
    numbers = [int(text.split()[1]) for text in came if text.startswith("hand")]
    last = numbers[-1]
    assert "begins" in came
    # All of the escape that was handed over last, each once, none of another.
    assert numbers == list(range(numbers[0], last + 1))
    assert last >= 3 + 7
    assert both.hand_ends()
    assert [row["hand"] for row in both.rows()] == ["flies the escape", "has flown the escape"]
    assert both.rows()[0]["why"] == "the deciding process died"


@pytest.mark.parametrize("link", LINKS)
def test_stopped_it_is_relieved_and_says_so_once_it_goes_on(pair: Callable[[str], Pair]) -> None:
    both = pair("ok = fly(100); hand.end(); print(ok, said, flush=True)")
    both.until("own 3")
    both.stop()
    came = both.until("over")
    assert not [text for text in came if text.startswith("own")]
    both.decider.send_signal(signal.SIGCONT)
    output = both.ended()
    assert output.startswith("False ['the second process has taken over")
    both.ear.timeout_s = 0.3
    with pytest.raises(TimeoutError):
        both.next()  # Nobody speaks any more.
    assert both.hand_ends()


@pytest.mark.parametrize("link", LINKS)
def test_stopped_only_for_a_moment_it_goes_on_and_the_other_is_silent_again(
    pair: Callable[[str], Pair],
) -> None:
    both = pair("print(fly(12), said, flush=True); hand.end()")
    both.until("own 3")
    both.stop()
    assert both.until("hand 5")
    both.decider.send_signal(signal.SIGCONT)
    came = both.until("own 11")
    assert [text for text in came if text.startswith("own")] == [f"own {n}" for n in range(4, 12)]
    output = both.ended()
    assert output.startswith("True []")
    assert both.hand_ends()
    assert both.rows() == []


def test_late_by_a_hair_over_and_over_it_stays_in_command(pair: Callable[[str], Pair]) -> None:
    both = pair("print(fly(20, late_s=0.021), said, flush=True); hand.end()")
    came = both.until("own 19")
    assert [text for text in came if text.startswith("own")] == [f"own {n}" for n in range(20)]
    output = both.ended()
    assert output.startswith("True []")
    assert "begins" not in came


def test_killed_before_its_first_escape_nothing_is_flown_and_that_is_said(
    pair: Callable[[str], Pair],
) -> None:
    both = pair(
        "none = escape(0, 0)._replace(why_none='no escape was held')\n"
        "for n in range(100): hand.hand_over(none); speak('own'); time.sleep(0.1)"
    )
    both.until("own")
    both.decider.kill()
    assert set(both.until("nothing")) <= {"own", "nothing"}
    assert both.hand_ends()
    (row,) = both.rows()
    assert row["hand"] == "flies nothing"
    assert row["why"] == "the deciding process died; no escape was held"


def test_a_broken_hand_over_is_not_flown_nor_is_the_one_before(pair: Callable[[str], Pair]) -> None:
    both = pair(
        "fly(3)\n"
        "broken = bytearray(encode(Kind.ESCAPE, time.monotonic(), escape(50, 8)))\n"
        "broken[60] ^= 4\n"
        "hand._end.send(bytes(broken)); speak('broken'); time.sleep(60)"
    )
    both.until("broken")
    both.decider.kill()
    assert both.hand_ends()
    both.ear.timeout_s = 0.3
    with pytest.raises(TimeoutError):
        both.next()
    assert [row["hand"] for row in both.rows()] == ["holds nothing", "flies nothing"]
    assert "checksum" in both.rows()[1]["why"]


def test_a_whole_one_after_a_broken_one_is_flown(pair: Callable[[str], Pair]) -> None:
    both = pair("hand._end.send(b'broken'); fly(100)")
    both.until("own 2")
    both.decider.kill()
    assert "begins" in both.until("over")


def test_ending_in_good_order_leaves_no_process(pair: Callable[[str], Pair]) -> None:
    both = pair("fly(3); hand.end(); print('ended', flush=True); time.sleep(60)")
    assert both.decider.stdout is not None
    assert both.decider.stdout.readline() == "ended\n"
    assert not Path(f"/proc/{both.hand}").exists()
    assert both.rows() == []


def test_signals_to_all_of_a_group_do_not_end_it_before_the_escape(
    pair: Callable[[str], Pair],
) -> None:
    both = pair("fly(100)")
    both.until("own 3")
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        os.kill(both.hand, number)
    both.decider.kill()
    assert "begins" in both.until("over")


def test_a_second_process_that_dies_is_noticed_and_flight_goes_on(
    pair: Callable[[str], Pair],
) -> None:
    both = pair("print(fly(6), said, flush=True); hand.end()")
    both.until("own 2")
    os.kill(both.hand, signal.SIGKILL)
    both.until("own 5")
    output = both.ended()
    assert "nobody flies the escape" in output
    assert output.startswith("True")


def test_a_second_process_that_hangs_with_the_word_is_killed(pair: Callable[[str], Pair]) -> None:
    both = pair("print(fly(30), said, flush=True); hand.end()")
    both.until("own 3")
    both.stop()
    both.until("hand 4")
    os.kill(both.hand, signal.SIGSTOP)
    both.decider.send_signal(signal.SIGCONT)
    both.until("own 29")
    output = both.ended()
    assert output.startswith("True")
    assert "hung" in output
    assert both.hand_ends()


@pytest.mark.parametrize("lost", ["killed", "hangs"])
def test_another_second_process_flies_the_escape_where_the_first_was_lost(
    pair: Callable[[str], Pair], lost: str
) -> None:
    both = pair(
        "n = 0\n"
        "while 'another second process stands by' not in said:\n"
        "    fly(1, n); n += 1\n"
        "fly(3, n); speak('dies'); time.sleep(60)"
    )
    both.until("own 3")
    if lost == "hangs":
        both.stop()
        both.until("hand 4")
        os.kill(both.hand, signal.SIGSTOP)
        both.decider.send_signal(signal.SIGCONT)
    else:
        os.kill(both.hand, signal.SIGKILL)
    both.until("dies")
    both.decider.kill()
    assert "begins" in both.until("over")


def test_a_decider_stopped_while_it_speaks_is_killed_so_that_only_one_speaks(
    pair: Callable[[str], Pair],
) -> None:
    both = pair(
        "fly(3)\n"
        "hand.hand_over(escape(3, 20))\n"
        "hand.speak(lambda: (way.send('stops'), time.sleep(60)))"
    )
    both.until("stops")
    assert "begins" in both.until("over")
    assert both.decider.wait(10) == -signal.SIGKILL


def test_it_is_small() -> None:
    script = (
        "import sys, clearway.mavlink.hand_process, clearway.hand.process\n"
        "assert 'numpy' not in sys.modules, 'numpy'"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
