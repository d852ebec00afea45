"""One simulated flight as it came out: track, decisions and measures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeGuard

import numpy as np

from clearway.avoidance.plan.held_escape import Escape
from clearway.avoidance.speed_choice import Sight
from clearway.base.brief import brief, in_brief, one_line
from clearway.base.frames import FloatArray
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.provenance import provenance
from clearway.base.variants import Variants
from clearway.io.json_values import round_number
from clearway.live import FlightDecision
from clearway.live.mission import Mission, Mode, Progress
from clearway.live.preflight.escape_plan import EscapePlan
from clearway.obstacles.world import World
from clearway.sim.contact import what_stands
from clearway.sim.endings import alarms_of, reason_of
from clearway.sim.metrics import FlightMetrics
from clearway.sim.pilot import CLEARWAY, D, Steering


@dataclass(frozen=True, eq=False)
class LoggedDecision(Generic[D]):
    """A decision as it was taken in flight, and how long it took."""

    flight: D
    why_now: str
    elapsed_s: float
    """From the sensor's arrays in memory to the explained decision."""
    sight: Sight | None = None
    """What was seen to be free around; None of a vehicle without inertia."""

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Run(Generic[D]):
    """One simulated flight.

    >>> import clearway as cw
    >>> mission = cw.read_mission("static-obstacles")
    >>> run = cw.fly(mission.with_values("simulation", time_limit_s=2.0))
    >>> run.reached, run.summary()["planner"], run.to_row()["time_s"]
    (False, 'clearway', 2.0)
    """

    mission: Mission
    time_s: FloatArray
    """[n] at most 0.05 s apart."""
    states: FloatArray
    """[n, 6] true states, world frame."""
    decisions: tuple[LoggedDecision[D], ...]
    movements: tuple[str, ...]
    """Movements flown: the chained buffer of (6.3)."""
    progress: Progress
    """By the true position."""
    metrics: FlightMetrics
    safety_margin_m: float
    seed: int
    body_radius_m: float = 0.0
    """Distance from the centre within which the vehicle is."""
    intruder_tracks: dict[str, FloatArray] = field(default_factory=dict)
    """[n, 4] time and true position of each intruder, from its appearance on."""
    corrections: int = 0
    """Movements flown with corrected turn rates, since the prediction error took more than its
    share of the margin (4.2.2)."""
    counts: dict[str, int] = field(default_factory=dict)
    """Data that the system left out, by reason."""
    world: World | None = field(default=None, repr=False)
    """What was really there, for pictures."""
    planner: str = CLEARWAY
    """Who flew: clearway, the name of a baseline, or the class of a pilot of one's own."""
    ways_out: EscapePlan | None = None
    """Which escapes clearway held, and why; None for other planners."""

    def __repr__(self) -> str:
        metrics = self.metrics
        ended = "safe" if self.safe else "reached" if self.reached else "not reached"
        if self.crashed_s is not None:
            ended = f"crashed at {self.crashed_s:.1f} s"
        return one_line(
            "Run",
            (
                f"{in_brief(self.mission.name)} by {self.planner}: {ended}",
                f"{metrics.time_s:.1f} s",
                f"nearest {metrics.min_obstacle_distance_m:.2f} m of {self.safety_margin_m:g} m",
                f"{len(self.decisions)} decisions",
                f"{self.emergencies} emergencies",
            ),
        )

    def _repr_html_(self) -> str:
        """For notebooks: the summary, and the flight from above."""
        goals = self.mission.goals_m
        others = self.intruder_tracks.values()
        marks = [Marks(track[:, 1:], "#d98ad9", size=0.8) for track in others]
        marks += [Marks(self.states, "#1f5fbf"), Marks(goals, "#2e9e4f", joined=False, size=3.0)]
        facts = {key: value for key, value in self.to_row().items() if value not in (None, "")}
        return html_table(f"Run {self.mission.name}", facts, sketch_from_above(marks))

    @property
    def reached(self) -> bool:
        return self.progress.is_done(self.mission)

    @property
    def crashed_s(self) -> float | None:
        """Time of the first contact: in an obstacle, which ends a flight, or an intruder's body."""
        contact = self.nearest_surface_m <= 0.0
        return float(self.time_s[np.argmax(contact)]) if contact.any() else None

    @property
    def touched(self) -> bool:
        """Whether the body of the vehicle touched an obstacle or an intruder's body."""
        return bool(np.any(self.nearest_surface_m <= self.body_radius_m))

    @property
    def mean_mps(self) -> float:
        """Mean speed over the ground and up, along the way flown."""
        return self.metrics.path_length_m / max(self.metrics.time_s, 1e-9)

    @property
    def top_mps(self) -> float:
        """Greatest speed between two times of the track."""
        steps = np.linalg.norm(np.diff(self.states[:, :3], axis=0), axis=1)
        return float(np.max(steps / np.diff(self.time_s), initial=0.0))

    @property
    def nearest_surface_m(self) -> FloatArray:
        """[n] distance to the nearest surface at each time, of obstacles and intruders' bodies."""
        traffic = self.metrics.intruders
        if traffic is None:
            return self.metrics.obstacle_distance_m
        radius = traffic.margin_m - self.safety_margin_m
        bodies = (traffic.distance_m - radius[:, None]).min(axis=0)
        return np.asarray(np.minimum(self.metrics.obstacle_distance_m, bodies))

    @property
    def emergencies(self) -> int:
        """Decisions in which nothing kept the margin."""
        return sum(entry.flight.mode is Mode.EMERGENCY for entry in self.decisions)

    @property
    def safe(self) -> bool:
        """Reached, and never nearer than the margin."""
        return self.reached and self.metrics.margin_violations == 0

    @property
    def decision_ms(self) -> dict[str, float | None]:
        """p50, p99 and max of the time from the sensor's arrays to the explained decision."""
        elapsed = np.array([entry.elapsed_s for entry in self.decisions]) * 1e3
        if not len(elapsed):
            return {"p50": None, "p99": None, "max": None}
        return {
            "p50": round(float(np.percentile(elapsed, 50)), 4),
            "p99": round(float(np.percentile(elapsed, 99)), 4),
            "max": round(float(elapsed.max()), 4),
        }

    def summary(self) -> dict[str, Any]:
        """The flight as plain values, ready for JSON: the object that `fly --json` prints.

        Units stand in the keys; None where there is nothing to tell, such as a distance in empty
        space.
        """
        return {name: metric.of(self) for name, metric in METRICS.items()}

    def to_row(self) -> dict[str, str | float | int | bool | None]:
        """The summary as one flat row of a table, and whether the flight was safe.

        Columns as of `summary` without `provenance`, the three decision times apart
        (`decision_ms_p50` ...), and in place of the reasons the number of data left out and of
        alarms, of spans without an escape their length. A list of rows makes a DataFrame of pandas.
        """
        row = self.summary()
        row.pop("provenance")
        times, left_out = row.pop("decision_ms"), row.pop("data_left_out")
        spans = row.pop("no_guarantee_s")
        return {
            **row,
            "safe": self.safe,
            **{f"decision_ms_{name}": value for name, value in times.items()},
            "alarms": len(row["alarms"]),
            "data_left_out": sum(left_out.values()),
            "no_guarantee_s": round(sum(end - begin for begin, end in spans), 6),
        }


CERTAIN = (Escape.STRICT, Escape.MAPPED)
"""Escapes that hold what they promise in a static world."""


class Metric(NamedTuple):
    """One thing that a summary tells of a flight."""

    about: str
    of: Callable[[Run[Any]], Any]
    """A plain value, or a flat object of them; None where there is nothing to tell."""


def _in_hand(run: Run[Any]) -> list[bool]:
    """Whether there was a held escape after each decision; empty where none is asked for."""
    if run.ways_out is None or run.ways_out.flown == "off":
        return []
    ways = [entry.flight.decision.way_out for entry in run.decisions]
    return [way is not None and way.certain for way in ways]


def _way_out_from_s(run: Run[Any]) -> float | None:
    in_hand = _in_hand(run)
    return round_number(run.decisions[in_hand.index(True)].flight.time_s) if any(in_hand) else None


def _without_way_out(run: Run[Any]) -> int | None:
    in_hand = _in_hand(run)
    return in_hand[in_hand.index(True) :].count(False) if any(in_hand) else None


def _guarantee(run: Run[Any]) -> bool:
    """Whether a certain escape was held from the first decision on that found one, which came no
    later than was promised, and led on."""
    if run.ways_out is None or run.ways_out.flown not in CERTAIN or _without_way_out(run) != 0:
        return False
    return not any(alarm["breaks_promise"] for alarm in _alarms(run))


def _find_unobserved_m(run: Run[Any]) -> float | None:
    """The most metres of unobserved space that an escape crossed; None where none may."""
    if run.ways_out is None or run.ways_out.flown != Escape.BUDGETED:
        return None
    ways = [entry.flight.decision.way_out for entry in run.decisions]
    return round_number(max((way.unobserved_m for way in ways if way is not None), default=0.0))


def _no_guarantee_s(run: Run[Any]) -> list[list[float]]:
    """From when to when there was no held escape, after the first."""
    in_hand = _in_hand(run)
    spans: list[list[float]] = []
    if not any(in_hand):
        return spans
    ends = [entry.flight.time_s for entry in run.decisions[1:]] + [float(run.time_s[-1])]
    for at in range(in_hand.index(True), len(in_hand)):
        if in_hand[at]:
            continue
        begin, end = round(run.decisions[at].flight.time_s, 6), round(ends[at], 6)
        if spans and not in_hand[at - 1]:
            spans[-1][1] = end
        else:
            spans.append([begin, end])
    return spans


def _reason(run: Run[Any]) -> str | None:
    """Why a flight did not arrive; None where it did."""
    if run.reached:
        return None
    if run.crashed_s is not None:
        return f"it crashed at {run.crashed_s:.1f} s"
    flights = [entry.flight for entry in run.decisions]
    return reason_of(flights, run.mission, run.progress, run.states[-1, :3])


def _alarms(run: Run[Any]) -> list[dict[str, Any]]:
    return alarms_of([entry.flight for entry in run.decisions])


def _nearest_intruder(run: Run[Any]) -> float | None:
    traffic = run.metrics.intruders
    return round_number(traffic.min_distance_m) if traffic else None


def _hit(run: Run[Any]) -> str | None:
    """The obstacle or intruder that the vehicle's middle touched first; None without."""
    touched = run.nearest_surface_m <= 0.0
    if not touched.any():
        return None
    at, traffic = int(np.argmax(touched)), run.metrics.intruders
    if traffic is not None and run.metrics.obstacle_distance_m[at] > 0.0:
        bodies_m = traffic.margin_m - run.safety_margin_m
        return f"intruder {traffic.names[int(np.argmin(traffic.distance_m[:, at] - bodies_m))]!r}"
    return what_stands(run.world, run.states[at, :3])


def _closest_intruder(run: Run[Any]) -> str | None:
    return run.metrics.intruders.closest_name if run.metrics.intruders else None


def _straight_flight(run: Run[Any]) -> float | None:
    straight = run.metrics.straight
    return round_number(straight.min_distance_m) if straight else None


METRICS: Variants[Metric] = Variants(
    "metric",
    {
        "mission": Metric("Its name.", lambda run: run.mission.name),
        "planner": Metric("Which planner flew.", lambda run: run.planner),
        "reached": Metric("Whether it came to the last goal.", lambda run: run.reached),
        "waypoints_reached": Metric(
            "How many.", lambda run: run.progress.waypoints_reached(run.mission)
        ),
        "time_s": Metric("Time flown.", lambda run: round(run.metrics.time_s, 6)),
        "path_length_m": Metric("Length flown.", lambda run: round(run.metrics.path_length_m, 6)),
        "mean_mps": Metric("Mean speed.", lambda run: round(run.mean_mps, 6)),
        "top_mps": Metric("Greatest speed.", lambda run: round(run.top_mps, 6)),
        "min_obstacle_distance_m": Metric(
            "Smallest distance to an obstacle's surface.",
            lambda run: round_number(run.metrics.min_obstacle_distance_m),
        ),
        "min_intruder_distance_m": Metric(
            "Smallest distance to an intruder, between centres.", _nearest_intruder
        ),
        "closest_intruder": Metric("Which one came nearest.", _closest_intruder),
        "straight_flight_intruder_distance_m": Metric(
            "How near straight flight would have come to one.", _straight_flight
        ),
        "safety_margin_m": Metric("Margin to keep.", lambda run: run.safety_margin_m),
        "touched": Metric(
            "Whether the vehicle's body touched an obstacle or an intruder.",
            lambda run: run.touched,
        ),
        "margin_violations": Metric(
            "Episodes below it.", lambda run: run.metrics.margin_violations
        ),
        "emergencies": Metric(
            "Decisions in which nothing kept the margin.", lambda run: run.emergencies
        ),
        "escape_mode": Metric(
            "What was known of the held escapes: strict, budgeted, mapped, known or off.",
            lambda run: run.ways_out and run.ways_out.flown,
        ),
        "escape_asked": Metric(
            "Which of these was asked for.", lambda run: run.ways_out and run.ways_out.asked
        ),
        "escape_why": Metric("Why it was flown.", lambda run: run.ways_out and run.ways_out.why),
        "way_out_from_s": Metric("When the first escape was held.", _way_out_from_s),
        "decisions_without_escape": Metric("Decisions after that without one.", _without_way_out),
        "guarantee": Metric(
            "Whether every decision after that held one, through space seen or mapped to be free, "
            "and what the pre-flight check promised was kept.",
            _guarantee,
        ),
        "unobserved_m": Metric(
            "Most metres of unobserved space that a held escape crossed; null where none may.",
            _find_unobserved_m,
        ),
        "no_guarantee_s": Metric(
            "From when to when there was none, after the first: [[from, to], ...].",
            _no_guarantee_s,
        ),
        "reason": Metric("Why it did not arrive; null where it did.", _reason),
        "alarms": Metric(
            "What was wrong on its way: [{time_s, kind, why, breaks_promise}, ...].", _alarms
        ),
        "decisions": Metric("How many.", lambda run: len(run.decisions)),
        "decision_ms": Metric(
            "Time from the sensor's arrays to the explained decision: p50, p99, max.",
            lambda run: run.decision_ms,
        ),
        "seed": Metric("Of all noise.", lambda run: run.seed),
        "crashed": Metric("What its middle hit; null where it hit nothing.", _hit),
        "crashed_s": Metric("When.", lambda run: run.crashed_s),
        "tracking_mean_m": Metric(
            "Distance to the straight legs (6.13), on average.",
            lambda run: round_number(float(run.metrics.tracking_m.mean())),
        ),
        "tracking_max_m": Metric(
            "Distance to the straight legs at most.",
            lambda run: round_number(float(run.metrics.tracking_m.max())),
        ),
        "climb_m": Metric("Metres climbed.", lambda run: round_number(run.metrics.climb_m)),
        "effort_m2ps3": Metric(
            "Time integral of the squared acceleration across the path.",
            lambda run: round_number(run.metrics.effort_m2ps3),
        ),
        "corrections": Metric(
            "Movements flown with corrected turn rates (4.2.2).", lambda run: run.corrections
        ),
        "data_left_out": Metric(
            "Data that the system left out, by reason.",
            lambda run: dict(sorted(run.counts.items())),
        ),
        "provenance": Metric("What made it: version and surroundings.", lambda _run: provenance()),
    },
)
"""What a summary tells, in this order. Add one here: JSON, tables and the reference follow."""


OnDecision = Callable[[LoggedDecision[D], Progress], None]


def is_clearway_run(run: Run[Steering]) -> TypeGuard[Run]:
    """Whether the decisions of a flight carry what clearway's own do, as its pictures need."""
    return all(isinstance(entry.flight, FlightDecision) for entry in run.decisions)
