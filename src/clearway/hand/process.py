"""The second process: it waits for the pulse to stop, and then sends what it holds, nothing else.

While the deciding process is late by more than a moment, the set-points that it handed over are
sent in its place, and it goes on where it left off. Once it is dead, or silent for too long, it is
relieved: the escape is flown to its end, and the other stops as soon as it finds that out.
"""

from __future__ import annotations

import gc
import json
import os
import select
import signal
import socket
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

from clearway.base.version import SCHEMA_VERSION
from clearway.hand.handover import (
    MOST_BYTES,
    NOTHING_YET,
    BrokenHandOver,
    HandOver,
    Kind,
    Packet,
    decode,
)
from clearway.hand.word import Word

RETRY_S = 0.002
"""Between two tries to take the word from a process that does not answer."""
DIES_WITHIN_S = 2.0
"""A process that is being killed has let go of the word by then."""
LED_BY_OTHERS = "somebody else leads the vehicle"
READY = b"ready"
"""Said once to the deciding process."""


class Sender(Protocol):
    """The second process's way to the vehicle."""

    def send(self, packet: Packet, peer: tuple[str, int] | None, age_s: float, /) -> bool:
        """Send one message that was encoded so long ago, and say whether it went; never raises."""
        ...

    def wait(self, seconds: float, /) -> bool:
        """Wait between two set-points; false where somebody else leads the vehicle by now."""
        time.sleep(seconds)
        return True


class DescriptorSender(Sender):
    """A UDP socket or a serial line that the deciding process opened: the same port, and keys."""

    def __init__(self, descriptor: int, *, line: bool) -> None:
        self._descriptor = descriptor
        self._socket = None if line else socket.socket(fileno=descriptor)

    def send(self, packet: Packet, peer: tuple[str, int] | None, _age_s: float) -> bool:
        try:
            if self._socket is None:
                return os.write(self._descriptor, packet.data) == len(packet.data)
            return peer is not None and self._socket.sendto(packet.data, peer) > 0
        except OSError:
            return False


class WatchTerms(NamedTuple):
    """When the deciding process is late, and when it is relieved."""

    late_s: float
    """Without a pulse for so long, what is due is sent in its place."""
    relieved_s: float
    """And for so long, it is relieved for good."""
    pid: int
    """Of the deciding process."""


class PulseWatch:
    """One deciding process, watched to its end.

    end: our end of a pair of sockets that keep messages whole. log: a descriptor that lines of JSON
    go to, beside standard error.
    """

    def __init__(
        self, end: socket.socket, word: Word, sender: Sender, terms: WatchTerms, log: int | None
    ) -> None:
        self._end, self._word, self._sender, self._terms = end, word, sender, terms
        self._log = log
        self._held: HandOver = NOTHING_YET
        self._pulse_s = self._handed_s = time.monotonic()
        self._next = 0  # Of the moments held, the first that was not sent.
        self._speaks = False
        self._bridged = 0

    def run(self) -> int:
        """PulseWatch, and fly the escape if need be; how many set-points were sent for good."""
        while True:
            if select.select([self._end], [], [], self._sleeps_s())[0]:
                data = self._receive()
                if not data:
                    return self._relieve("died")
                if not self._take(data):
                    return 0
                continue  # All that has come counts before any time does.
            silent_s = time.monotonic() - self._pulse_s
            if self._held.moments and silent_s >= self._terms.late_s:
                self._stand_in()
                if silent_s >= self._terms.relieved_s:
                    return self._relieve("is silent")

    def _receive(self) -> bytes:
        """The next message; none once the deciding process is gone and all of them are read."""
        try:
            return self._end.recv(MOST_BYTES)
        except ConnectionResetError:  # It left something of ours unread: said once.
            return self._end.recv(MOST_BYTES)

    def _take(self, data: bytes) -> bool:
        """Take a message; false for the last one."""
        if self._speaks:
            self._word.give()
            self._speaks = False
        try:
            kind, self._pulse_s, handed = decode(data)
        except BrokenHandOver as flaw:
            self._held = HandOver(why_none=f"the last hand-over is broken: {flaw}")
            self._note("holds nothing", why=self._held.why_none)
            return True
        if handed is not None:
            self._held, self._handed_s, self._next = handed, self._pulse_s, 0
        return kind is not Kind.END

    def _sleeps_s(self) -> float | None:
        """Until something is to be done without a message; None for ever."""
        if not self._held.moments:
            return None
        now = time.monotonic()
        if not self._speaks:
            left_s = self._pulse_s + self._terms.late_s - now
            return left_s if left_s > 0.0 else RETRY_S
        due_s = self._pulse_s + self._terms.relieved_s
        if self._next < len(self._held.moments):
            due_s = min(due_s, self._held.moments[self._next].at_s)
        return max(0.0, due_s - now)

    def _stand_in(self) -> None:
        """Send what is due, if the word can be had."""
        if not self._speaks and self._word.take():
            self._speaks = True
            # What is due now may have been sent: once more does no harm, and not at all would.
            self._skip_past(time.monotonic())
            self._bridged += 1
        if self._speaks:
            self._send_due()

    def _skip_past(self, now: float) -> None:
        """Leave out what should have been sent before, but for the last of it."""
        moments = self._held.moments
        while self._next + 1 < len(moments) and moments[self._next + 1].at_s <= now:
            self._next += 1

    def _send_due(self) -> int:
        moments, sent = self._held.moments, 0
        while self._next < len(moments) and moments[self._next].at_s <= time.monotonic():
            self._send(moments[self._next].packets)
            self._next, sent = self._next + 1, sent + 1
        return sent

    def _send(self, packets: Sequence[Packet]) -> None:
        age_s = time.monotonic() - self._handed_s
        for packet in packets:
            self._sender.send(packet, self._held.peer, age_s)

    # --- for good ---------------------------------------------------------------------------

    def _relieve(self, how: str) -> int:
        """Fly the escape to its end, alone."""
        silent_s, held = time.monotonic() - self._pulse_s, self._held
        why = f"the deciding process {how}"
        self._word.mark()
        if not self._has_word():
            self._note("gives up", why="the deciding process holds the word")
            return 0
        if not held.moments:
            self._send(held.nothing)
            self._note("flies nothing", why=f"{why}; {held.why_none}")
            return 0
        self._skip_past(time.monotonic())
        sent = self._send_due()
        self._send(held.begins)
        self._note("flies the escape", why=why, silent_s=round(silent_s, 4))
        while self._next < len(held.moments):
            if not self._sender.wait(max(0.0, held.moments[self._next].at_s - time.monotonic())):
                self._send(held.nothing)
                self._note("ends", why=f"{why}; {LED_BY_OTHERS}", set_points=sent)
                return sent
            sent += self._send_due()
        self._send(held.over)
        self._note("has flown the escape", why=why, set_points=sent, stood_in=self._bridged)
        return sent

    def _has_word(self) -> bool:
        """Take the word; a process that stands still while it has it is killed first."""
        until = time.monotonic() + DIES_WITHIN_S
        while not (self._speaks or self._word.take()):
            if time.monotonic() > until:
                return False
            if os.getppid() == self._terms.pid:
                os.kill(self._terms.pid, signal.SIGKILL)
            time.sleep(RETRY_S)
        return True

    def _note(self, what: str, **more: object) -> None:
        """A line for people, and one of JSON for the log."""
        now = time.monotonic() + self._held.vehicle_s
        row = {"schema_version": SCHEMA_VERSION, "time_s": round(now, 3), "hand": what, **more}
        said = "; ".join(f"{value}" for key, value in more.items() if key == "why")
        for descriptor, line in (
            (2, f"second process: {what}: {said}"),
            (self._log, json.dumps(row)),
        ):
            if descriptor is not None:
                try:
                    os.write(descriptor, line.encode() + b"\n")
                except OSError:
                    continue  # Nobody reads any more: that must not keep it from flying.


def watch_over(arguments: Sequence[str], open_sender: Callable[[dict[str, Any]], Sender]) -> int:
    """Run the second process by what the deciding one says of it on the command line."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # It ends with the other, or with the escape.
    given = json.loads(arguments[0])
    end = socket.socket(fileno=given["end"])
    terms = WatchTerms(given["late_s"], given["relieved_s"], given["pid"])
    sender = open_sender(given["sender"])
    watch = PulseWatch(end, Word(given["word"]), sender, terms, given["log"])
    end.send(READY)
    gc.collect()
    gc.disable()
    watch.run()
    return 0
