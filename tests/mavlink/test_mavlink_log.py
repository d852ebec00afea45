"""The log of a session on a disk that is full."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest

from clearway.mavlink.record import SessionRecord
from mavlink_for_tests import Bench

FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.exists(), reason="no device that is always full")
def test_a_full_disk_ends_the_log_and_not_the_flight() -> None:
    bench, told = Bench(), list[str]()
    with contextlib.suppress(OSError), FULL.open("w") as log:
        record = SessionRecord(bench.session, log, told.append)
        taken = [bench.tick(time_s) for time_s in (0.0, 5.0, 10.0)]
        for outcome in taken:
            record.take(outcome)
    assert record.last is taken[-1]
    assert told == ["the log ends here, it cannot be written: No space left on device"]
