"""The deciding process's side: start the second process, hand over, and ask for the word."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Protocol

from clearway.hand.handover import HandOver, Kind, encode
from clearway.hand.process import READY
from clearway.hand.word import Word

LATE_S = 0.02
"""A set-point that is late by more is sent by the second process."""
RELIEVED_S = 1.0
RELIEVED_PERIODS = 2.0
"""Silent for so long, and for so many periods, the deciding process is relieved."""
ANSWERS_S = 0.4
TRIES_S = 0.0005
"""The second process gives the word back within this time; and between two tries to take it."""
STARTS_S = 20.0
"""The second process watches within this time."""
ENDS_S = 2.0
"""It has ended so long after it was asked to."""
AGAIN_S = 2.0
"""Between two starts: one that is lost has a follower, but starts take time themselves."""
QUEUE_BYTES = 1 << 20
RELIEVED = "the second process has taken over: this one was silent for too long"
Notice = Callable[[str], None]


class Hand(Protocol):
    """A second process, or none."""

    @property
    def relieved(self) -> bool:
        """Whether the second process has taken over for good."""
        ...

    @property
    def wants_all(self) -> bool:
        """Whether the escape is to be handed over though it is the one handed over last."""
        ...

    def hand_over(self, handed: HandOver | None) -> None:
        """Give a pulse; and the escape, where it is another one than before."""
        ...

    def speak(self, send: Callable[[], None]) -> bool:
        """Send while no one else may; false where that is not to be any more."""
        ...

    def end(self) -> None:
        """In good order: nothing is to be flown."""
        ...

    def leave(self) -> bool:
        """Without a word, as by death: whether there is a second process to fly the escape."""
        ...


class NoHand:
    """Only one process: it may always speak."""

    relieved = False
    wants_all = False

    def hand_over(self, handed: HandOver | None) -> None: ...

    def speak(self, send: Callable[[], None]) -> bool:
        send()
        return True

    def end(self) -> None: ...

    def leave(self) -> bool:
        return False


Started = tuple["subprocess.Popen[bytes]", socket.socket]
"""A process, and our end of the way to it."""


class SecondProcess:
    """A running second process; see `start`. One that is lost in flight has a follower."""

    def __init__(self, launch: Callable[[], Started], word: Word, notice: Notice) -> None:
        self._launch, self._word, self._notice = launch, word, notice
        self._process, self._end = launch()
        self.on_return: Callable[[], None] = lambda: None
        """Called once the word is back from a second process that stood in."""
        self.relieved, self.wants_all = False, True
        self._gone, self._begun_s, self._starts = False, time.monotonic(), False

    @classmethod
    def start(
        cls,
        module: str,
        sender: Mapping[str, object],
        descriptors: Sequence[int],
        period_s: float,
        *,
        log: int | None,
        notice: Notice,
    ) -> SecondProcess:
        """Start it: `python -m module`, with a sender that `module` understands.

        descriptors: that the sender needs. period_s: at most, between two set-points, by our clock.
        """
        word = Word.new()
        given = {
            "word": word.descriptor,
            "late_s": period_s + LATE_S,
            "relieved_s": max(RELIEVED_S, RELIEVED_PERIODS * period_s),
            "pid": os.getpid(),
            "log": log,
            "sender": dict(sender),
        }
        kept = (word.descriptor, *descriptors, *(() if log is None else (log,)))
        hand = cls(partial(_launch, module, given, kept), word, notice)
        hand._wait_until_ready()
        return hand

    def _wait_until_ready(self) -> None:
        with suppress(OSError):
            self._end.settimeout(STARTS_S)
            if self._end.recv(len(READY)) == READY:
                self._end.setblocking(False)
                return
        self._kill()
        self._lose("did not start")

    def _follow(self) -> None:
        """Start another one where the last is lost, without waiting for it."""
        now = time.monotonic()
        if not self._starts:
            if now >= self._begun_s + AGAIN_S:
                self._kill()
                self._process, self._end = self._launch()
                self._end.setblocking(False)
                self._starts, self._begun_s = True, now
            return
        try:
            ready = self._end.recv(len(READY)) == READY
        except BlockingIOError:
            if now < self._begun_s + STARTS_S:
                return
            ready = False
        except OSError:
            ready = False
        self._starts = False
        if ready:
            self._gone, self.wants_all = False, True
            self._notice("another second process stands by")
        else:
            self._kill()

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait()
        self._end.close()

    def hand_over(self, handed: HandOver | None) -> None:
        if self._gone and not self.relieved and not self._word.is_marked:
            self._follow()
        kind = Kind.PULSE if handed is None else Kind.ESCAPE
        came = self._tell(kind, handed)
        if handed is not None:
            self.wants_all = not came

    def speak(self, send: Callable[[], None]) -> bool:
        if self.relieved:
            return False
        if not self._word.take() and not self._asks_back():
            return False
        try:
            if self._word.is_marked:
                self._step_back()
                return False
            send()
            return True
        finally:
            self._word.give()

    def _asks_back(self) -> bool:
        """Take the word back from a second process that stood in; it may keep it for good."""
        self._tell(Kind.PULSE, None)
        until = time.monotonic() + ANSWERS_S
        while not self._word.take():
            if self._word.is_marked:
                self._step_back()
                return False
            if time.monotonic() > until:
                self._kill()  # It hangs with the word: nobody would speak.
                self._lose("hung, and was killed")
                return self._word.take()
            time.sleep(TRIES_S)
        self.on_return()
        return True

    def _step_back(self) -> None:
        self.relieved = True
        self._notice(RELIEVED)

    def _tell(self, kind: Kind, handed: HandOver | None) -> bool:
        if self._gone or self.relieved:
            return False
        try:
            self._end.send(encode(kind, time.monotonic(), handed))
        except BlockingIOError:
            return False  # It does not keep up: the next one is whole again.
        except OSError:
            self._lose("has ended")
            return False
        return True

    def _lose(self, how: str) -> None:
        if self._word.is_marked:
            self._step_back()
        elif not self._gone:
            self._gone = True
            words = "until another one stands by, nobody flies the escape if this one dies"
            self._notice(f"the second process {how}: {words}")

    def end(self) -> None:
        """Nothing is left behind, unless it flies the escape."""
        self._tell(Kind.END, None)
        self._end.close()
        if self.relieved:
            return
        if self._gone:
            self._process.kill()  # It may not have begun to listen.
        try:
            self._process.wait(ENDS_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def leave(self) -> bool:
        flies = not self._gone and self._process.poll() is None
        self._gone, self.relieved = True, self.relieved or flies
        self._end.close()
        return flies


def _launch(module: str, given: Mapping[str, object], kept: Sequence[int]) -> Started:
    """Start a second process with the descriptors that it keeps."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    process = subprocess.Popen(
        [sys.executable, "-m", module, json.dumps({"end": theirs.fileno(), **given})],
        pass_fds=(theirs.fileno(), *kept),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    )
    theirs.close()
    with suppress(OSError):
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, QUEUE_BYTES)
    return process, ours
