"""What `clearway guard` says: changes while it runs, and what came of it at the end."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Any

from clearway.cli.flight_time import FlightTime

if TYPE_CHECKING:
    from clearway.live.guard.guard_session import GuardSession
    from clearway.live.link.loop import LoopReport
    from clearway.live.link.outcome import TickOutcome

SAY_AGAIN_S = 1.0


class GuardWatch:
    """Tells on standard error when the link changes, and when the guardian steps in."""

    def __init__(self) -> None:
        self._told, self._told_s = ("", ""), -math.inf
        self._clock = FlightTime()

    def show(self, outcome: TickOutcome) -> None:
        begun = self._clock.begin(outcome.time_s)
        at = self._clock.words(outcome.time_s)
        if begun is not None:
            print(begun, file=sys.stderr, flush=True)
        for note in outcome.notes:
            print(f"{at}  {note}", file=sys.stderr, flush=True)
        guarded = outcome.guarded
        doing = "" if guarded is None else "passed" if guarded.is_wish else "replaced"
        present, now = (str(outcome.state), doing), outcome.time_s
        again = present != self._told and now >= self._told_s + SAY_AGAIN_S
        if present[0] == self._told[0] and not again:
            return
        self._told, self._told_s = present, now
        why = f" ({outcome.why_state})" if outcome.why_state else ""
        said = "" if guarded is None else f"; {guarded.why}"
        print(f"{at}  {outcome.state}{why}{said}", file=sys.stderr, flush=True)


def summarize_guard(session: GuardSession, report: LoopReport) -> dict[str, Any]:
    tally = session.tally
    wished = sum(tally[what] for what in ("passed", "slowed", "nearest", "replaced"))
    return {
        "acting": session.terms.act,
        "state": str(report.state or session.state),
        "wishes": tally["wishes"],
        "passed": tally["passed"],
        "slowed": tally["slowed"],
        "nearest": tally["nearest"],
        "replaced": tally["replaced"],
        "changed_mps": {
            "mean": round(session.changed_mps / max(1, wished), 3),
            "max": round(session.most_changed_mps, 3),
        },
        "without_a_wish": tally["without a wish"],
        "ticks": report.ticks,
        "late": report.late,
        "left_out": dict(session.left_out),
    }


def describe_link(link: Any) -> dict[str, Any]:
    """What came and went."""
    if hasattr(link, "topics"):
        heard = {topic: one.messages for topic, one in link.topics.items()}
        return {"heard": heard, "sent": dict(link.published)}
    received = link.autopilot.inbox.received + link.commanded.received
    refused = link.autopilot.inbox.refused + link.commanded.refused
    sent = dict(link.autopilot.outbox.sent)
    return {"heard": dict(received), "refused": dict(refused), "sent": sent}


def describe_guard(result: dict[str, Any]) -> str:
    changed = result["changed_mps"]
    lines = [
        f"guardian   {'acting' if result['acting'] else 'read-only'}; the link at the end: "
        f"{result['state']}",
        f"wishes     {result['wishes']}; ticks: {result['passed']} passed, {result['slowed']} "
        f"slowed, {result['nearest']} the nearest velocity, {result['replaced']} replaced, "
        f"{result['without_a_wish']} without a wish",
        f"changed    by {changed['mean']:.2f} m/s in the mean, {changed['max']:.2f} at most",
        f"ticks      {result['ticks']}, {result['late']} late",
    ]
    for title in ("heard", "refused", "left_out", "sent"):
        counts = {name: number for name, number in result.get(title, {}).items() if number}
        if counts:
            told = ", ".join(f"{number} {name}" for name, number in sorted(counts.items()))
            lines.append(f"{title.replace('_', ' '):<10} {told}")
    return "\n".join(lines)
