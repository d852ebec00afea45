"""What a session leaves behind: a line for every decision and change, and a summary."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, TextIO

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.version import SCHEMA_VERSION
from clearway.live.link.link_state import LinkState
from clearway.live.link.loop import LATEST, LoopReport
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.session import Session
from clearway.live.mission import Mode
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.mavlink_session import MavlinkSession
from clearway.mavlink.outbox import Outbox
from clearway.mavlink.set_points import set_point_row


class SessionRecord:
    """Takes outcomes as they come; `log` gets a JSON line for each that says something new.

    notice: told where the log can be written no more, which ends it, and not the flight.
    """

    def __init__(
        self,
        session: MavlinkSession[Session],
        log: TextIO | None,
        notice: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.last: TickOutcome | None = None
        self.decisions = 0
        self.emergencies = 0
        self.seconds_in: dict[str, float] = {}
        self._session, self._log, self._notice = session, log, notice
        self._elapsed_s: deque[float] = deque(maxlen=LATEST)

    def take(self, outcome: TickOutcome) -> None:
        last, self.last = self.last, outcome
        if last is not None and last.time_s > 0.0:
            spent = max(0.0, outcome.time_s - last.time_s)
            self.seconds_in[last.state] = self.seconds_in.get(last.state, 0.0) + spent
        if outcome.flight is not None:
            self.decisions += 1
            self.emergencies += outcome.flight.mode is Mode.EMERGENCY
            self._elapsed_s.append(outcome.elapsed_s)
        changed = last is None or last.state is not outcome.state
        if self._log is not None and (outcome.flight is not None or changed):
            row = {"schema_version": SCHEMA_VERSION, **make_log_row(outcome, self._session)}
            try:
                self._log.write(json.dumps(row, allow_nan=False) + "\n")
                self._log.flush()
            except OSError as cause:
                self._log = None
                self._notice(f"the log ends here, it cannot be written: {cause.strerror or cause}")

    def summary(
        self, loop: LoopReport, inbox: Inbox, outbox: Outbox, rate_hz: float
    ) -> dict[str, Any]:
        """What the session came to; every message is counted in one place."""
        system = self._session.core.system
        progress, mission = system.progress, system.mission
        state = LinkState.WAITING if self.last is None else self.last.state
        return {
            "mission": mission.name,
            "acting": self._session.terms.session.act,
            "reached": progress.is_done(mission),
            "waypoints_reached": progress.waypoints_reached(mission),
            **system.escape.to_json(),
            "state": str(state),
            "seconds_in": {name: round(spent, 3) for name, spent in self.seconds_in.items()},
            "decisions": self.decisions,
            "emergencies": self.emergencies,
            "decision_ms": quantiles_ms(self._elapsed_s),
            "rate_hz": rate_hz,
            "ticks": loop.ticks,
            "late": loop.late,
            "skipped": loop.skipped,
            "tick_ms": quantiles_ms(loop.tick_s),
            "received": dict(inbox.received),
            "refused": dict(inbox.refused),
            "left_out": dict(system.counts + self._session.counts),
            "sent": dict(outbox.sent),
        }


def make_log_row(outcome: TickOutcome, session: MavlinkSession[Session]) -> dict[str, Any]:
    """One line of the log."""
    row: dict[str, Any] = {
        "time_s": round(outcome.time_s, 3),
        "state": str(outcome.state),
        "autopilot": str(session.core.status or "unknown"),
        "sent": session.terms.session.act and outcome.set_point is not None,
        "set_point": None,
    }
    offset = session.place.world_from_local_m
    if outcome.set_point is not None and offset is not None:
        row["set_point"] = set_point_row(outcome.set_point, offset)
    if outcome.why_state:
        row["why_state"] = outcome.why_state
    flight = outcome.flight
    if flight is not None:
        was = flight.mode_state.before
        row |= {
            "why_now": outcome.why_now,
            "mode": str(flight.mode),
            "mode_before": None if was is None else str(was),
            "why_mode": flight.mode_state.why,
            "goal": flight.goal,
            "position_m": [round(v, 3) for v in flight.state.position_m.tolist()],
            "movements": list(flight.movements),
            "margin_m": round(flight.decision.margin_m, 3),
            "explanation": flight.explanation,
            "elapsed_ms": round(1e3 * outcome.elapsed_s, 3),
            "aircraft": [approach.row() for approach in outcome.approaches],
        }
    return row


def quantiles_ms(seconds: Sequence[float]) -> dict[str, float | None]:
    """Median, 99th percentile and largest, in milliseconds; None without any."""
    if not seconds:
        return {"p50": None, "p99": None, "max": None}
    values: FloatArray = 1e3 * np.array(seconds)
    p50, p99, top = np.percentile(values, [50.0, 99.0, 100.0]).tolist()
    return {"p50": round(p50, 3), "p99": round(p99, 3), "max": round(top, 3)}
