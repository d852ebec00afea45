"""What is kept of a flight: one row, with all that is needed to fly it again."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Literal, get_type_hints

Outcome = Literal["safe", "margin lost", "crashed", "not reached", "refused", "failed"]
"""safe: reached, never nearer than the margin; not reached: in time, but with the margin kept;
refused: the mission cannot be flown; failed: the planner raised an error."""

TIMINGS = ("decision_ms_p50", "decision_ms_p99", "wall_s", "cpu_s")
"""What differs from run to run."""


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
    reached: bool = False
    crashed: bool = False
    margin_kept: bool = False
    margin_m: float | None = None
    margin_violations: int = 0
    """Episodes below the margin."""
    nearest_m: float | None = None
    """Smallest distance to any surface, of obstacles or of intruders."""
    nearest_obstacle_m: float | None = None
    nearest_intruder_m: float | None = None
    """Between centres."""
    emergencies: int = 0
    """Decisions in which nothing kept the margin."""
    escape: str = ""
    """Which ways out were kept in hand; empty for other planners."""
    waypoints_reached: int = 0
    time_s: float | None = None
    crashed_s: float | None = None
    straight_m: float | None = None
    """Length of straight flight."""
    path_m: float | None = None
    climb_m: float | None = None
    effort_m2ps3: float | None = None
    tracking_mean_m: float | None = None
    corrections: int = 0
    decisions: int = 0
    track_id: str = ""
    """The same for the same track to the last bit."""
    decision_ms_p50: float | None = None
    decision_ms_p99: float | None = None
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


COLUMNS: dict[str, Any] = get_type_hints(FlightRow)
"""Name and type of each, in order."""


def without_timings(row: FlightRow) -> dict[str, Any]:
    """What is equal for equal flights."""
    return {f.name: getattr(row, f.name) for f in fields(row) if f.name not in TIMINGS}
