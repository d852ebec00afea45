"""When a command that runs live ends: after a time, on arrival, when its process is asked to."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clearway.live.link.loop import Stop
    from clearway.live.link.outcome import TickOutcome

ENDED_BY = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""A terminal that closes is reported as SIGHUP."""


@contextmanager
def stop_rule(
    duration: float | None, *, arrival: bool = False, ended: Callable[[], bool] | None = None
) -> Iterator[Stop]:
    """ended: whether nothing more comes, as at the end of a recording."""
    told: list[int] = []

    def note(number: int, _frame: object) -> None:
        told.append(number)

    def stop(elapsed_s: float, outcome: TickOutcome | None) -> bool:
        arrived = arrival and outcome is not None and outcome.state == "arrived"
        over = ended is not None and ended()
        late = duration is not None and elapsed_s >= duration
        return bool(told) or arrived or over or late

    before = {number: signal.signal(number, note) for number in ENDED_BY}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
