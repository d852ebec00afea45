"""Flights through made worlds and traffic, on seeds that no campaign flies, and what was rated."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from clearway.avoidance.choose.chosen import Basis
from clearway.base.frames import FloatArray
from clearway.base.provenance import sha256_of
from clearway.io.json_values import finite
from clearway.sim import Run
from clearway.studies.campaigns.families import Case, make_case
from clearway.studies.reliability.bins import BINS
from clearway.studies.reliability.record import look_at_flight

CASES: dict[str, tuple[str, dict[str, Any], int]] = {
    "balls-60": ("balls", {"balls": 60}, 6),
    "balls-140": ("balls", {"balls": 140}, 6),
    "balls-240": ("balls", {"balls": 240}, 6),
    "forest": ("forest", {}, 6),
    "street": ("street", {}, 2),
    "walls": ("walls", {}, 4),
    "pockets": ("pockets", {}, 4),
    "maze": ("maze", {}, 4),
    "mixed": ("mixed", {}, 6),
    "wires": ("wires", {}, 4),
    "head-on": ("head-on", {}, 8),
    "converging": ("converging", {}, 8),
    "overtaking": ("overtaking", {}, 8),
    "overtaken": ("overtaken", {}, 8),
    "climbing": ("climbing", {}, 8),
    "several": ("several", {}, 8),
    "random, deviating": ("random", {"deviates": True}, 8),
    "several, deviating": ("several", {"deviates": True}, 8),
}
"""Family, its parameters, and how many flights of each set of seeds."""
TABLE = Path("src/clearway/avoidance/rate/calibration.json")
CHANGES: dict[str, dict[str, dict[str, Any]]] = {
    "verified/total": {},
    "verified/calibrated": {"rating": {"name": "calibrated"}},
    "cells alone/total": {"verify": {"method": "none"}},
    "cells alone/calibrated": {"rating": {"name": "calibrated"}, "verify": {"method": "none"}},
}
"""What is flown with held-out seeds: how margins are held, and the rating."""
FIT, HELD_OUT = "fit", "held out"
FIRST_SEED = {FIT: 1_000, HELD_OUT: 2_000}
"""Campaigns count from 0."""


def flights(journal: Path, group: str) -> list[dict[str, Any]]:
    """All of a set, those of the journal not flown again; families take turns."""
    lines = journal.read_text(encoding="utf-8").splitlines() if journal.exists() else []
    known = {row["key"]: row for row in map(json.loads, lines)}
    table = sha256_of(TABLE) if group == HELD_OUT else None
    rows = []
    for name, number in wanted():
        key = f"{group}/{name}/{number}"
        if key not in known or known[key].get("table") != table:
            known[key] = {"key": key, "name": name, "table": table, **looked(group, name, number)}
            with journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps(known[key]) + "\n")
        rows.append(known[key])
    return rows


def wanted() -> Iterable[tuple[str, int]]:
    most = max(count for _, _, count in CASES.values())
    for number in range(most):
        yield from ((name, number) for name, (_, _, count) in CASES.items() if number < count)


def looked(group: str, name: str, number: int) -> dict[str, Any]:
    """A flight and all that was rated in it; with held-out seeds also what another rating makes of
    the same flight."""
    seed = FIRST_SEED[group] + number
    case, run = flown(name, seed, {})
    planner = case.setup.system().planner
    found = look_at_flight(run, planner.settings, planner.grid.range_m / planner.speed_mps)
    counts = {f"{kind}/{rating}": listed(one) for (kind, rating), one in found.counts.items()}
    flights: dict[str, Any] = {}
    if group == HELD_OUT:
        flights["verified/total"] = came_of(run)
        others = [changes for changes in CHANGES if changes != "verified/total"]
        for way in others:
            flights[way] = came_of(flown(name, seed, CHANGES[way])[1])
    return {"seed": seed, "decisions": found.decisions, "counts": counts, "flights": flights}


def flown(name: str, seed: int, changes: dict[str, dict[str, Any]]) -> tuple[Case, Run[Any]]:
    family, parameters, _ = CASES[name]
    case = make_case(family, seed, parameters, changes, Path())
    return case, case.setup.fly_with("clearway")


def came_of(run: Run[Any]) -> dict[str, Any]:
    nearest = finite(float(run.nearest_surface_m.min()))
    decision_ms = [1e3 * entry.elapsed_s for entry in run.decisions]
    return {
        "safe": run.safe,
        "reached": run.reached,
        "crashed": run.crashed_s is not None,
        "kept": run.metrics.margin_violations == 0,
        "nearest_m": nearest,
        "path_m": run.metrics.path_length_m,
        "time_s": run.metrics.time_s,
        "emergencies": run.emergencies,
        "decision_ms": float(np.median(decision_ms)),
        "by_rating": sum(
            entry.flight.decision.choice.basis in (Basis.RATED, Basis.RATED_ONLY)
            for entry in run.decisions
        ),
        "decisions": len(run.decisions),
    }


def listed(counts: Any) -> list[list[float]]:
    """Counts of a flight, as a journal has them."""
    return [[round(float(one), 6) for one in row] for row in np.asarray(counts)]


def counts_of(row: dict[str, Any], kind: str, rating: str) -> FloatArray:
    """[BINS, 5] of a flight."""
    return np.array(row["counts"].get(f"{kind}/{rating}", np.zeros((BINS, 5))))
