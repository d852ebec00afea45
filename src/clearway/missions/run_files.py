"""What a flight leaves behind: track.csv, intruders.csv and decisions.jsonl."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from clearway.avoidance.long_range.resolve import LongRangeChoice
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.speed_choice import Sight, SpeedChoice
from clearway.base.version import SCHEMA_VERSION
from clearway.io.json_values import round_number
from clearway.live import FlightDecision
from clearway.live.outputs.kept_clearance import KeptClearance
from clearway.sim import LoggedDecision, Run
from clearway.sim.pilot import Steering

TRACK_COLUMNS = ("time_s", "x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")


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
    """One JSON object per decision, with the version of its form and its reasons."""
    with path.open("w") as file:
        for entry in run.decisions:
            told = {"schema_version": SCHEMA_VERSION, **decision_record(entry)}
            file.write(json.dumps(told) + "\n")


def decision_record(entry: LoggedDecision[Steering]) -> dict[str, Any]:
    """A decision as plain values: of clearway's with all its reasons, of others what all have."""
    if isinstance(entry.flight, FlightDecision):
        return _make_assessed_record(entry.flight, entry)
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


def _describe_kept(kept: KeptClearance) -> dict[str, Any]:
    """The clearance that is kept with 95 % until the next decision, and what it is made of."""
    return {
        "kept_clearance_m": round_number(kept.bound_m),
        "kept_predicted_m": round_number(kept.predicted_m),
        "kept_level": round_number(kept.level),
    }


def _way_out(way: WayOut | None) -> dict[str, Any] | None:
    """The held escape after a decision's first movement."""
    if way is None:
        return None
    return {
        "movements": list(way.begins),
        "loop": list(way.loop),
        "margin_kept_m": round_number(way.margin_m),
        "certain": way.certain,
    }


def _afar(choice: LongRangeChoice) -> dict[str, Any]:
    """What a decision comes to in the next minute."""
    return {
        "side": str(choice.side),
        "sense": str(choice.sense),
        "speed_mps": round_number(choice.speed_mps),
        "volumes_ahead": choice.tier,
        "volumes_ahead_as_wanted": choice.wanted_tier,
        "risk": [round_number(one) for one in choice.risk],
        "reason": choice.reason,
    }


def _speed(speed: SpeedChoice) -> dict[str, Any]:
    """Speeds of a plan, and what limits them."""
    return {
        "now_mps": round_number(speed.now_mps),
        "next_mps": round_number(speed.next_mps),
        "plan_mps": [round_number(each) for each in speed.plan_mps],
        "greatest_mps": round_number(speed.greatest_mps),
        "limit": speed.limit.name.lower(),
        "why": str(speed.limit),
    }


def _sight(sight: Sight) -> dict[str, Any]:
    """How far space was seen to be free, all round and ahead, and the speed that allows."""
    return {
        "ahead_m": round_number(sight.ahead_m),
        "cap_mps": round_number(sight.cap_mps),
        "free_m": [round_number(each) for each in sight.free_m.tolist()],
    }


def _make_assessed_record(
    flight: FlightDecision, entry: LoggedDecision[Steering]
) -> dict[str, Any]:
    decision, choice, mode = flight.decision, flight.decision.choice, flight.mode_state
    movements_to = decision.prepared.reach_set.movements_to
    return {
        **_when_and_why(entry),
        "mode_before": None if mode.before is None else str(mode.before),
        "why_mode": mode.why,
        "basis": choice.basis.name.lower(),
        "position_m": _list(decision.state.position_m),
        "attitude_rad": _list(decision.state.attitude_rad),
        "movements": list(decision.movements),
        "cost_m": round_number(choice.cost_m),
        "rating": round_number(choice.rating),
        "feasibility": round_number(choice.feasibility),
        "continuations": round_number(choice.continuations),
        "clearance_m": round_number(choice.clearance_m),
        "limited_by": choice.limited_by.name.lower(),
        **({} if flight.kept is None else _describe_kept(flight.kept)),
        "way_out": _way_out(decision.way_out),
        "no_way_out": list(decision.no_way_out),
        **({"tube_m": _list(decision.tube_m)} if decision.tube_m.any() else {}),
        **({} if decision.speed is None else {"speed": _speed(decision.speed)}),
        **({} if entry.sight is None else {"sight": _sight(entry.sight)}),
        "margin_asked_m": round_number(decision.margin_m),
        "margin_kept_m": round_number(choice.margin_m),
        "side": str(choice.side),
        "candidates": choice.candidates,
        "below_threshold": choice.below_threshold,
        "ruled_out_by": choice.ruled_out_by,
        "ruled_out": [
            {
                "movements": list(movements_to(other.node)),
                "cost_m": round_number(other.cost_m),
                "cause": other.cause.name.lower(),
                "clearance_m": round_number(other.clearance_m),
            }
            for other in choice.ruled_out
        ],
        "rules": [asdict(note) for note in choice.rules],
        **({} if flight.traffic is None else {"traffic": flight.traffic.as_dict()}),
        **({} if decision.long_range is None else {"long_range": _afar(decision.long_range)}),
        **({"alarms": [alarm.why for alarm in flight.alarms]} if flight.alarms else {}),
        "scan_age_s": round_number(flight.scan_age_s),
        "data_left_out": flight.counts,
        "decide_within_s": round_number(decision.decide_within_s),
        "elapsed_ms": round(entry.elapsed_s * 1e3, 4),
    }


def _list(values: np.ndarray[Any, np.dtype[np.float64]]) -> list[float]:
    return [round(float(value), 6) for value in values]
