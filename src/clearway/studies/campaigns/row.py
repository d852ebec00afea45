"""What is kept of a flight: one row, with all that is needed to fly it again.

A measure of campaigns is a field of `FlightRow` that says what it is of a run; whatever is written
follows.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_type_hints

import numpy as np

from clearway.io.json_values import finite
from clearway.sim import Run

Outcome = Literal["safe", "margin lost", "crashed", "not reached", "refused", "failed"]
"""safe: reached, never nearer than the margin; not reached: in time, but with the margin kept;
refused: the mission cannot be flown; failed: the planner raised an error."""

TIMINGS = ("decision_ms_p50", "decision_ms_p99", "wall_s", "cpu_s")
"""What differs from run to run."""


def measure_run(of: Callable[[Run[Any]], Any], default: Any = None) -> Any:
    """A field of a row that is computed of a run; default: where there was no flight."""
    return field(default=default, metadata={"of": of})


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightRow:
    """One flight. None where there is nothing to tell, such as a distance in empty space."""

    key: str
    """label/planner/seed."""
    label: str
    planner: str
    seed: int
    family: str
    parameters: str
    """JSON object."""
    changes: str
    """JSON object of what was changed in the mission, by table."""
    campaign: str
    settings_id: str
    """Of family, parameters and changes."""
    version: str
    """Of clearway."""
    replay: str
    """The command that flies it again."""
    outcome: Outcome
    why: str
    """Of a refusal or failure."""
    hidden: str = ""
    """What of the flight the planner cannot know, in words: how it avoids says nothing then."""
    reached: bool = measure_run(lambda run: run.reached, default=False)
    crashed: bool = measure_run(lambda run: run.crashed_s is not None, default=False)
    touched: bool = measure_run(lambda run: run.touched, default=False)
    """Whether the body of the vehicle, not only its centre, touched anything."""
    margin_kept: bool = measure_run(lambda run: run.metrics.margin_violations == 0, default=False)
    margin_m: float | None = measure_run(lambda run: run.safety_margin_m)
    margin_violations: int = measure_run(lambda run: run.metrics.margin_violations, 0)
    """Episodes below the margin."""
    nearest_m: float | None = measure_run(lambda run: finite(float(run.nearest_surface_m.min())))
    """Smallest distance to any surface, of obstacles or of intruders."""
    nearest_obstacle_m: float | None = measure_run(
        lambda run: finite(run.metrics.min_obstacle_distance_m)
    )
    nearest_intruder_m: float | None = measure_run(lambda run: _nearest_intruder_m(run))
    """Between centres."""
    emergencies: int = measure_run(lambda run: run.emergencies, 0)
    """Decisions in which nothing kept the margin."""
    escape: str = measure_run(lambda run: "" if run.ways_out is None else run.ways_out.flown, "")
    """Which escapes were held; empty for other planners."""
    waypoints_reached: int = measure_run(lambda run: run.progress.waypoints_reached(run.mission), 0)
    time_s: float | None = measure_run(lambda run: run.metrics.time_s)
    crashed_s: float | None = measure_run(lambda run: run.crashed_s)
    straight_m: float | None = measure_run(lambda run: run.mission.straight_length_m)
    """Length of straight flight."""
    path_m: float | None = measure_run(lambda run: run.metrics.path_length_m)
    mean_mps: float | None = measure_run(lambda run: run.mean_mps)
    top_mps: float | None = measure_run(lambda run: run.top_mps)
    climb_m: float | None = measure_run(lambda run: run.metrics.climb_m)
    effort_m2ps3: float | None = measure_run(lambda run: run.metrics.effort_m2ps3)
    tracking_mean_m: float | None = measure_run(lambda run: float(run.metrics.tracking_m.mean()))
    corrections: int = measure_run(lambda run: run.corrections, 0)
    decisions: int = measure_run(lambda run: len(run.decisions), 0)
    track_id: str = measure_run(lambda run: _track_id(run), "")
    """The same for the same track to the last bit."""
    decision_ms_p50: float | None = measure_run(lambda run: _decision_ms(run, 50))
    decision_ms_p99: float | None = measure_run(lambda run: _decision_ms(run, 99))
    wall_s: float = 0.0
    """Time that the flight took to compute."""
    cpu_s: float = 0.0
    """Time of a core in it."""

    @property
    def safe(self) -> bool:
        """Reached, and never nearer than the margin."""
        return self.outcome == "safe"

    @property
    def lost_margin(self) -> bool:
        """Nearer than the margin at some time, or in the hands of a planner that failed."""
        return self.outcome in ("margin lost", "crashed", "failed")


COLUMN_TYPES: dict[str, Any] = get_type_hints(FlightRow)
"""Name and type of each, in order."""
IDENTITY = tuple(f.name for f in fields(FlightRow) if "of" not in f.metadata)
"""What a row says beside measures: which flight it is, how it ended, and what it cost."""


def without_timings(row: FlightRow) -> dict[str, Any]:
    """What is equal for equal flights."""
    return {f.name: getattr(row, f.name) for f in fields(row) if f.name not in TIMINGS}


def measures(run: Run[Any], row: type[FlightRow] = FlightRow) -> dict[str, Any]:
    """The fields of a row that are computed of a run."""
    return {f.name: f.metadata["of"](run) for f in fields(row) if "of" in f.metadata}


def judge_flight(run: Run[Any]) -> Outcome:
    """What came of a flight, in a word."""
    if run.crashed_s is not None:
        return "crashed"
    if run.metrics.margin_violations:
        return "margin lost"
    return "safe" if run.reached else "not reached"


def _nearest_intruder_m(run: Run[Any]) -> float | None:
    traffic = run.metrics.intruders
    return finite(traffic.min_distance_m) if traffic else None


def _decision_ms(run: Run[Any], percentile: float) -> float | None:
    elapsed_ms = 1e3 * np.array([entry.elapsed_s for entry in run.decisions])
    return float(np.percentile(elapsed_ms, percentile)) if len(elapsed_ms) else None


def _track_id(run: Run[Any]) -> str:
    """The same for the same track to the last bit."""
    digest = hashlib.sha256(np.ascontiguousarray(run.time_s).tobytes())
    digest.update(np.ascontiguousarray(run.states).tobytes())
    return digest.hexdigest()[:16]
