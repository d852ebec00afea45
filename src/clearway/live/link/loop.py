"""The loop at a set rate: read what has come, tick, send; deadlines are measured, not hoped for."""

from __future__ import annotations

import gc
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from clearway.live.link.hearing import Hearing
from clearway.live.link.link_state import LinkState
from clearway.live.link.outcome import Link, TickOutcome

IDLE_S = 0.2
"""In lock-step, a tick is due after so long even if no own position comes."""
TOLD_S = 1.1e-3
"""Vehicles tell whole milliseconds."""
LATEST = 100_000
"""Ticks and decisions whose times are kept: those of more than an hour at the usual rates."""
NEW_OBJECTS = 20_000
"""At most so many more objects than before until Python looks through them for garbage, which takes
the longer the more there are."""
READ_S = 0.02
"""The longest sleep without reading: the system keeps little for us between reads, and in a flood
what is beyond that is lost, good or bad."""
BATCH_S = 0.001
"""Between reads while waiting for what presses, so that a flood does not wake us for each of it."""
LEAST_S = 0.01
"""Between ticks at once."""
LATER = 1.25
"""Periods from such a tick to the next one at the set rate: what comes at that rate is waited for
that much longer."""


@dataclass(slots=True)
class LoopReport:
    """How the ticks went."""

    ticks: int = 0
    late: int = 0
    """Ticks that were not done when the next one was due."""
    skipped: int = 0
    """Ticks left out since their time had passed."""
    state: LinkState | None = None
    """Of the last tick, as it was sent: a process that was relieved flies no more."""
    tick_s: deque[float] = field(default_factory=lambda: deque(maxlen=LATEST))
    """Each of the latest from reading to the last message sent."""


OnOutcome = Callable[[TickOutcome], None]
Stop = Callable[[float, TickOutcome | None], bool]
"""(seconds since the start, last outcome) -> whether to end."""


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """What a session runs on; `run` ends when `stop` says so, or the autopilot restarts."""

    link: Link
    session: Hearing
    period_s: float
    """Between ticks, by the vehicle's clock."""
    at_once: bool = False
    """Whether what should not wait for the next tick, a scan or a wish, brings it on; by our clock
    alone, since in lock-step the vehicle sets the pace."""

    @property
    def wall_period_s(self) -> float:
        """The same by our clock."""
        return self.period_s / (self.session.terms.speedup or 1.0)

    @property
    def longest_s(self) -> float:
        """Between two ticks that are not late, by our clock."""
        return (LATER if self.at_once else 1.0) * self.wall_period_s

    def run(self, stop: Stop, on_outcome: OnOutcome) -> LoopReport:
        report, outcome = LoopReport(), None
        in_lock_step = self.session.terms.speedup is None
        # What is there stays there: looking through all of it for garbage takes 80 ms now and then.
        gc.collect()
        gc.freeze()
        rarely = gc.get_threshold()
        gc.set_threshold(min(rarely[0], NEW_OBJECTS), *rarely[1:])
        began = due = time.monotonic()
        crashed = True
        try:
            while not stop(time.monotonic() - began, outcome):
                if in_lock_step:
                    self._until_vehicle(outcome)
                else:
                    due = self._until(due, report)
                outcome = self._tick(report)
                on_outcome(outcome)
                report.late += not in_lock_step and time.monotonic() > due + self.wall_period_s
                due += self.wall_period_s
                if outcome.state.is_over:
                    break
            crashed = False
        finally:
            # Whatever ends it, a vehicle that is led is told to hold, or its escape is flown.
            self.link.end(crashed=crashed)
            gc.unfreeze()
            gc.set_threshold(*rarely)
        return report

    def _tick(self, report: LoopReport) -> TickOutcome:
        started = time.perf_counter()
        self.link.hear(time.monotonic())
        outcome = self.link.tick(time.monotonic())
        report.tick_s.append(time.perf_counter() - started)
        report.ticks += 1
        report.state = outcome.state
        return outcome

    def _until(self, due: float, report: LoopReport) -> float:
        """Sleep until a tick is due; those whose time has passed are left out."""
        now = time.monotonic()
        if now > due + self.wall_period_s:
            missed = int((now - due) / self.wall_period_s)
            report.skipped += missed
            due += missed * self.wall_period_s
        if self.at_once:
            return self._until_pressing(due, now + LEAST_S)
        while (left := due - time.monotonic()) > 0.0:
            time.sleep(min(left, READ_S))
            self.link.hear(time.monotonic())
        return due

    def _until_pressing(self, due: float, earliest: float) -> float:
        """Hear what comes until a tick is due, or something has come that should not wait."""
        while (left := due - time.monotonic()) > 0.0:
            self.link.wait(left)
            self.link.hear(time.monotonic())
            if self.session.pressing:
                time.sleep(max(0.0, min(due, earliest) - time.monotonic()))
                return time.monotonic() + (LATER - 1.0) * self.wall_period_s
            time.sleep(max(0.0, min(BATCH_S, due - time.monotonic())))
        return due

    def _until_vehicle(self, last: TickOutcome | None) -> None:
        """Read until there is an own position a period later, or nothing comes.

        The vehicle's clock alone would not do: attitude tells it too, and comes before the rest.
        """
        before = None if last is None else last.time_s
        until = time.monotonic() + IDLE_S
        while time.monotonic() < until:
            self.link.wait(until - time.monotonic())
            self.link.hear(time.monotonic())
            now = self.session.own_s
            if now is not None and (before is None or now >= before + self.period_s - TOLD_S):
                return
