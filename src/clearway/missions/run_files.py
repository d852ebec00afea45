"""What a flight leaves behind: track.csv, decisions.jsonl, summary.json, and the JSON of a run."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.provenance import provenance
from clearway.io.json_values import rounded
from clearway.live import FlightDecision
from clearway.sim import LoggedDecision, Run
from clearway.sim.pilot import Steering

TRACK_COLUMNS = ("time_s", "x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")


def summary(run: Run[Steering], planner: str = "clearway") -> dict[str, Any]:
    """The object that `fly --json` prints."""
    distance, traffic = run.metrics.min_obstacle_distance_m, run.metrics.intruders
    straight = run.metrics.straight
    return {
        "mission": run.mission.name,
        "planner": planner,
        "reached": run.reached,
        "waypoints_reached": run.progress.waypoints_reached(run.mission),
        "time_s": round(run.metrics.time_s, 6),
        "path_length_m": round(run.metrics.path_length_m, 6),
        "min_obstacle_distance_m": rounded(distance),
        "min_intruder_distance_m": rounded(traffic.min_distance_m) if traffic else None,
        "closest_intruder": traffic.closest_name if traffic else None,
        "straight_flight_intruder_distance_m": rounded(straight.min_distance_m)
        if straight
        else None,
        "safety_margin_m": run.safety_margin_m,
        "margin_violations": run.metrics.margin_violations,
        "emergencies": run.emergencies,
        "decisions": len(run.decisions),
        "decision_ms": decision_times_ms(run),
        "seed": run.seed,
        "crashed_s": run.crashed_s,
        "tracking_mean_m": rounded(float(run.metrics.tracking_m.mean())),
        "tracking_max_m": rounded(float(run.metrics.tracking_m.max())),
        "climb_m": rounded(run.metrics.climb_m),
        "effort_m2ps3": rounded(run.metrics.effort_m2ps3),
        "corrections": run.corrections,
        "data_left_out": dict(sorted(run.counts.items())),
        "provenance": provenance(),
    }


def decision_times_ms(run: Run[Steering]) -> dict[str, float | None]:
    """Time from the sensor's arrays in hand to the explained decision."""
    elapsed = np.array([entry.elapsed_s for entry in run.decisions]) * 1e3
    if not len(elapsed):
        return {"p50": None, "p99": None, "max": None}
    return {
        "p50": round(float(np.percentile(elapsed, 50)), 4),
        "p99": round(float(np.percentile(elapsed, 99)), 4),
        "max": round(float(elapsed.max()), 4),
    }


def write_track(run: Run[Steering], path: Path) -> None:
    """The true track, one row per step, at most 0.05 s apart."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(TRACK_COLUMNS)
        for time_s, state in zip(run.time_s, run.states, strict=True):
            writer.writerow([f"{time_s:.6f}", *(f"{value:.6f}" for value in state)])


def write_intruders(run: Run[Steering], path: Path) -> None:
    """True tracks of the intruders, one row per step and intruder."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("name", *TRACK_COLUMNS[:4]))
        for name, track in run.intruder_tracks.items():
            for time_s, *place in track:
                writer.writerow([name, f"{time_s:.6f}", *(f"{value:.6f}" for value in place)])


def write_decisions(run: Run[Steering], path: Path) -> None:
    """One JSON object per decision, with its reasons."""
    with path.open("w") as file:
        for entry in run.decisions:
            file.write(json.dumps(decision_record(entry)) + "\n")


def decision_record(entry: LoggedDecision[Steering]) -> dict[str, Any]:
    """A decision as plain values: of clearway's with all its reasons, of others what all have."""
    if isinstance(entry.flight, FlightDecision):
        return _assessed_record(entry.flight, entry)
    flight = entry.flight
    return {
        **_when_and_why(entry),
        "position_m": _list(flight.state.position_m),
        "attitude_rad": _list(flight.state.attitude_rad),
        "movements": list(flight.movements),
        "data_left_out": dict(flight.counts),
        "elapsed_ms": round(entry.elapsed_s * 1e3, 4),
    }


def _when_and_why(entry: LoggedDecision[Steering]) -> dict[str, Any]:
    flight = entry.flight
    return {
        "time_s": round(flight.time_s, 6),
        "why_now": entry.why_now,
        "mode": str(flight.mode),
        "goal": flight.goal,
        "explanation": flight.explanation,
    }


def _assessed_record(flight: FlightDecision, entry: LoggedDecision[Steering]) -> dict[str, Any]:
    decision, choice = flight.decision, flight.decision.choice
    movements_to = decision.prepared.reach_set.movements_to
    return {
        **_when_and_why(entry),
        "basis": choice.basis.name.lower(),
        "position_m": _list(decision.state.position_m),
        "attitude_rad": _list(decision.state.attitude_rad),
        "movements": list(decision.movements),
        "cost_m": rounded(choice.cost_m),
        "rating": rounded(choice.rating),
        "feasibility": rounded(choice.feasibility),
        "continuations": rounded(choice.continuations),
        "clearance_m": rounded(choice.clearance_m),
        "limited_by": choice.limited_by.name.lower(),
        "margin_asked_m": rounded(decision.margin_m),
        "margin_kept_m": rounded(choice.margin_m),
        "side": str(choice.side),
        "candidates": choice.candidates,
        "below_threshold": choice.below_threshold,
        "ruled_out_by": choice.ruled_out_by,
        "ruled_out": [
            {
                "movements": list(movements_to(other.node)),
                "cost_m": rounded(other.cost_m),
                "cause": other.cause.name.lower(),
                "clearance_m": rounded(other.clearance_m),
            }
            for other in choice.ruled_out
        ],
        "rules": [asdict(note) for note in choice.rules],
        "scan_age_s": rounded(flight.scan_age_s),
        "data_left_out": flight.counts,
        "decide_within_s": rounded(decision.decide_within_s),
        "elapsed_ms": round(entry.elapsed_s * 1e3, 4),
    }


def _list(values: np.ndarray[Any, np.dtype[np.float64]]) -> list[float]:
    return [round(float(value), 6) for value in values]
