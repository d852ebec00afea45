"""How a flight ended, and what was wrong with it on its way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clearway.base.frames import FloatArray, measure_length
from clearway.live import FlightDecision
from clearway.live.mission import Mission, Mode, Progress
from clearway.live.outputs.alarms import Alarm
from clearway.sim.pilot import Steering


def reason_of(
    flights: Sequence[Steering], mission: Mission, progress: Progress, place_m: FloatArray
) -> str:
    """Return why a flight that ended at a place [3] did not arrive, and touched nothing."""
    last = next((one for one in reversed(flights) if one.mode is not Mode.ESCAPE), None)
    if isinstance(last, FlightDecision) and last.mode is Mode.HOLD:
        return str(last.mode_state.held)
    goals, goal = mission.goals_m, progress.goal
    left_m = measure_length(goals[goal] - place_m)
    why = f"its time was up {left_m:.3g} m from goal {goal + 1} of {len(goals)}"
    wrong = _alarms(flights[-1]) if flights else ()
    return "; ".join([why, *(alarm.why for alarm in wrong)])


def alarms_of(flights: Sequence[Steering]) -> list[dict[str, Any]]:
    """Return each alarm of a flight once, with the time at which it began."""
    found: list[dict[str, Any]] = []
    before: frozenset[str] = frozenset()
    for flight in flights:
        alarms = _alarms(flight)
        found += [
            {
                "time_s": round(flight.time_s, 6),
                "kind": str(alarm.kind),
                "why": alarm.why,
                "breaks_promise": alarm.breaks_promise,
            }
            for alarm in alarms
            if alarm.kind not in before
        ]
        before = frozenset(alarm.kind for alarm in alarms)
    return found


def _alarms(flight: Steering) -> tuple[Alarm, ...]:
    """Those of a decision; other planners than clearway raise none."""
    return flight.alarms if isinstance(flight, FlightDecision) else ()
