"""Fly what docs/results/promise.md holds of how often escapes held: `python -m tools.promise`.

Against the adversary of the tests, and through worlds of the campaign `dead-ends`, all judged by
geometry that only the tests have. What is flown is kept in a file, one line a flight, and not flown
again; so it may be stopped at any time, and told of with `--told`.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.intervals import wilson

TESTS = Path(__file__).parents[1] / "tests"
sys.path[:0] = [str(TESTS / "support"), str(TESTS / "sim")]
Row = dict[str, Any]


def opposed(kind: str, seed: int) -> Row:
    """A flight against the adversary; what was shown to be wrong in it."""
    from test_no_collision import BODY_M, Drawn

    from clearway.sim.faults import Faults

    at_s = float(np.random.default_rng(seed).uniform(3.0, 40.0))
    kinds: dict[str, dict[str, Any]] = {
        "other vehicles": {"usual": False},
        "dead sensor": {"faults": Faults(dead_from_s=at_s)},
        "3 s late": {"faults": Faults(late_from_s=at_s, late_s=3.0)},
        "10 % drop-outs": {"dropout": 0.1},
        "1 s latency": {"scan_latency_s": 1.0},
        "wind": {"wind_share": 0.2},
    }
    changes = kinds.get(kind, {})
    drawn = Drawn(seed, **({"usual": True} | changes))
    flown = drawn.system.escape.flown
    row: Row = {"kind": kind, "seed": seed, "flown": flown, "without": drawn.without}
    if flown != "strict" or not np.isfinite(drawn.held_from_s):
        return row | {"judged": False}
    margin = drawn.system.planner.settings.safety_margin_m
    least = drawn.least_m
    body = BODY_M * drawn.scale
    return row | {
        "judged": True,
        "least_m": least,
        "touched": bool(least < body - 1e-6),
        "margin_lost": bool(least < margin - 1e-6),
    }


def through(label: str, seed: int) -> Row:
    """A flight through a world of the campaign."""
    from dead_end_flights import BODY_M, case_of, mission_of, solids_of
    from free_way import free_way

    case = case_of(label, seed)
    run = case.setup.fly_with("clearway")
    file = mission_of(label, seed)
    solids = solids_of(file)
    nearest = float(solids.nearest_on_track_m(run.states[:, :3]))
    way = free_way(solids, file.vehicle.position_m, file.mission.waypoints_m[-1])
    told = run.summary()
    return {
        "kind": "dead ends",
        "label": label,
        "seed": seed,
        "judged": True,
        "least_m": nearest,
        "touched": bool(nearest < BODY_M),
        "margin_lost": bool(nearest < run.safety_margin_m - 1e-6),
        "without": told["decisions_without_escape"] or 0,
        "free": bool(way.exists),
        "reached": run.reached,
        "held": told["reason"],
        "time_s": told["time_s"],
        "path": told["path_length_m"] / run.mission.straight_length_m,
    }


def asked(args: argparse.Namespace) -> Iterator[tuple[str, str, int]]:
    """Flights, those of all kinds by turns."""
    from dead_end_flights import labels

    kinds = (
        *("as usual", "other vehicles", "dead sensor", "3 s late"),
        *("10 % drop-outs", "1 s latency", "wind"),
    )
    most = [args.opposed, args.opposed] + [args.faulty] * 5
    worlds = [
        ("dead ends", label, args.first + n) for n in range(args.worlds) for label in labels()
    ]
    others = [
        (kind, "", args.first + n)
        for n in range(max(most))
        for kind, count in zip(kinds, most, strict=True)
        if n < count
    ]
    for n in range(max(len(worlds), len(others))):
        yield from worlds[n : n + 1]
        yield from others[n : n + 1]


def tell(rows: list[Row]) -> None:
    """What was flown, with 95 % intervals."""
    for kind in dict.fromkeys(row["kind"] for row in rows):
        flown = [row for row in rows if row["kind"] == kind]
        judged = [row for row in flown if row["judged"]]
        words = [f"{kind}: {len(judged)} flights"]
        if len(flown) > len(judged):
            words.append(f"{len(flown) - len(judged)} in which strict could not be had")
        for what in ("touched", "margin_lost"):
            count = sum(row[what] for row in judged)
            words.append(
                f"{what.replace('_', ' ')} {count} (to {wilson(count, len(judged))[1]:.0%})"
            )
        words.append(f"decisions without an escape {sum(row['without'] for row in judged)}")
        if kind == "dead ends":
            free = [row for row in judged if row["free"]]
            arrived = sum(row["reached"] for row in free)
            low, high = wilson(arrived, len(free))
            words.append(f"arrived {arrived} of {len(free)} with a free way ({low:.0%}-{high:.0%})")
            words += [
                f"{row['label']}-{row['seed']} not{' (held)' if row['held'] else ''}"
                for row in judged
                if not row["reached"]
            ]
        print("; ".join(words))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--file", type=Path, default=Path("clearway-out/promise.jsonl"))
    parser.add_argument("--worlds", type=int, default=2, help="seeds of each world")
    parser.add_argument("--opposed", type=int, default=50, help="flights against the adversary")
    parser.add_argument("--faulty", type=int, default=20, help="of each fault")
    parser.add_argument("--first", type=int, default=6, help="first seed")
    parser.add_argument("--told", action="store_true", help="fly nothing")
    args = parser.parse_args()
    rows: list[Row] = []
    if args.file.exists():
        rows = [json.loads(line) for line in args.file.read_text().splitlines()]
    done = {(row["kind"], row.get("label", ""), row["seed"]) for row in rows}
    args.file.parent.mkdir(parents=True, exist_ok=True)
    for kind, label, seed in () if args.told else asked(args):
        if (kind, label, seed) in done:
            continue
        row = through(label, seed) if label else opposed(kind, seed)
        rows.append(row)
        with args.file.open("a") as file:
            file.write(json.dumps(row) + "\n")
        if row["judged"] and (row["touched"] or row["margin_lost"] or row["without"]):
            print(row, flush=True)
    tell(rows)


if __name__ == "__main__":
    main()
