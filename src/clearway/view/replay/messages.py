"""What a decision was derived from, as plain values for clearway's own messages.

Everything is taken from the decision itself; the ratings that it was not flown by are worked out
from its evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.rate.fusion import RATINGS, assess_cells
from clearway.base.frames import FloatArray
from clearway.base.made import Made
from clearway.base.own_code import shorten_own_name
from clearway.base.packed import voxel_centers
from clearway.io.json_values import round_number
from clearway.live import FlightDecision
from clearway.live.mission import Mode
from clearway.missions.run_files import decision_record
from clearway.reach.tree import ReachSet
from clearway.sim import LoggedDecision, Run
from clearway.sim.pilot import Steering
from clearway.traffic.volumes import AlertLevel
from clearway.view.replay.schemas import RATING

DIGITS = 3
"""Decimals of probabilities."""
SILENCE_S = 0.1
"""Without a place for longer than this, an intruder is not there: tracks have one each step."""


def decision_message(entry: LoggedDecision[Steering]) -> dict[str, Any]:
    """The record of the log, with plan, escape, and the moving that were reckoned with."""
    message = decision_record(entry)
    flight = entry.flight
    if isinstance(flight, FlightDecision):
        message["path_m"] = np.round(flight.decision.path_m, 3).tolist()
        message["way_out_m"] = np.round(flight.decision.way_out_path_m, 3).tolist()
        message["movers"] = moving(flight.decision)
    return message


def scalars_message(told: dict[str, Any]) -> dict[str, Any]:
    """What of a decision's message is a number, for plots; mode and alert by their order."""
    way_out = told.get("way_out") or {}
    level = (told.get("traffic") or {}).get("level", AlertLevel.NONE.name.lower())
    same = (
        "cost_m", "rating", "clearance_m", "kept_clearance_m", "margin_asked_m", "margin_kept_m",
        "scan_age_s",
    )  # fmt: skip
    return {
        "time_s": told["time_s"],
        "mode": list(Mode).index(Mode(told["mode"])),
        "alert": int(AlertLevel[level.upper()]),
        **{name: told.get(name) for name in same},
        "way_out_margin_m": way_out.get("margin_kept_m"),
        "candidates": told.get("candidates", 0),
        "ruled_out": sum(told.get("ruled_out_by", {}).values()),
        "elapsed_ms": told["elapsed_ms"],
    }


def moving(decision: Decision) -> list[dict[str, Any]]:
    """Intruders as the planner knew them, in the world frame, at the decision time."""
    frame, known = decision.frame, decision.hazards.moving
    places = frame.world_points(known.position_m)
    velocities = frame.world_vectors(known.velocity_mps)
    return [
        {
            "name": name,
            "position_m": np.round(place, 3).tolist(),
            "velocity_mps": np.round(velocity, 3).tolist(),
            "radius_m": round_number(radius),
            "growth_mps": round_number(growth),
        }
        for name, place, velocity, radius, growth in zip(
            decision.intruders, places, velocities, known.radius_m, known.growth_mps, strict=True
        )
    ]


def cells_message(decision: Decision, settings: AvoidanceSettings) -> dict[str, Any]:
    """Every probability and every rating of all cells at one decision, [cells] each."""
    cells, reach = decision.cells, decision.reach
    evidence = cells.evidence
    values: dict[str, FloatArray] = {
        "obstacle": cells.obstacle,
        "visibility": evidence.visibility,
        "reachability": reach.reachability,
        "detected": evidence.detected,
        "map": cells.map,
        "intruder": evidence.intruder,
    }
    for name in dict.fromkeys([*RATINGS, settings.rating]):
        rated = cells
        if name != settings.rating:
            rated = assess_cells(evidence, RATINGS[name], settings.unknown, settings.unknown_unseen)
        values[f"{RATING}{shorten_own_name(name)}"] = rated.rating
    flags = {"passed": reach.passed, "coated": evidence.coated, "seen": evidence.seen}
    message: dict[str, Any] = {"time_s": decision.state.time_s}
    message |= {name: np.round(value, DIGITS).tolist() for name, value in values.items()}
    message |= {name: flag.astype(np.int64).tolist() for name, flag in flags.items()}
    return message


def reach_set_message(reach_set: ReachSet) -> dict[str, Any]:
    """The trajectories of one start pitch, in the grid frame; whole millimetres."""
    return {
        "start_pitch_rad": reach_set.start_pitch_rad,
        "parent": reach_set.parent.tolist(),
        "complete": reach_set.complete.astype(np.int64).tolist(),
        "movement": reach_set.movement.tolist(),
        "movement_names": list(reach_set.movement_names),
        "samples": reach_set.samples_m.shape[1],
        "samples_mm": np.round(reach_set.samples_m * 1e3).astype(np.int64).ravel().tolist(),
    }


def reach_message(decision: Decision) -> dict[str, Any]:
    """How every movement of the reach set was rated, (4.22), and which one ends the plan."""
    return {
        "time_s": decision.state.time_s,
        "start_pitch_rad": decision.prepared.reach_set.start_pitch_rad,
        "chosen": decision.choice.node,
        "rating": np.round(decision.reach.node_rating, DIGITS).tolist(),
    }


def list_seen_points(decision: Decision, voxel_m: float) -> FloatArray:
    """[n, 3] centres of the voxels of the world that hold points the planner reckoned with."""
    return voxel_centers(decision.seen_m, voxel_m)


def state_messages(run: Run[Steering]) -> Sequence[dict[str, Any]]:
    """The true states step by step, and how far the nearest obstacle and intruder are."""
    traffic = run.metrics.intruders
    nearest = np.full(len(run.time_s), np.inf) if traffic is None else traffic.nearest_m
    places, attitudes = np.round(run.states[:, :3], 4), np.round(run.states[:, 3:], 5)

    def state(at: int) -> dict[str, Any]:
        return {
            "time_s": round(float(run.time_s[at]), 6),
            "position_m": places[at].tolist(),
            "attitude_rad": attitudes[at].tolist(),
            "obstacle_distance_m": round_number(float(run.metrics.obstacle_distance_m[at])),
            "intruder_distance_m": round_number(float(nearest[at])),
        }

    return Made(range(len(run.time_s)), state)


def intruders_message(run: Run[Steering], time_s: float) -> dict[str, Any]:
    """True places and velocities of the intruders that are there at a time."""
    there = []
    for name, track in run.intruder_tracks.items():
        at = int(np.searchsorted(track[:, 0], time_s + 1e-6)) - 1
        if at < 0 or time_s - track[at, 0] > SILENCE_S:
            continue
        before, after = track[max(at - 1, 0)], track[min(at + 1, len(track) - 1)]
        span = max(after[0] - before[0], 1e-9)
        there.append(
            {
                "name": name,
                "position_m": np.round(track[at, 1:], 3).tolist(),
                "velocity_mps": np.round((after[1:] - before[1:]) / span, 3).tolist(),
            }
        )
    return {"time_s": round(time_s, 6), "intruders": there}
