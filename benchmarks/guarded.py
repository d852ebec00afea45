"""How often a guarded copter keeps its margin: `python -m benchmarks.guarded`.

Copters with inertia on the simulated autopilot, in one process: commanded straight at masts and
walls, by hostile wishes, and where an aircraft crosses. Every flight is kept in a file as soon as
it has ended: another call goes on from there.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import warnings
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

from clearway.base.intervals import wilson

SUPPORT = Path(__file__).resolve().parent.parent / "tests" / "support"
FLIGHTS = {"straight": 250, "hostile": 9, "crossing": 50}


def main() -> None:
    """Fly what is missing, and print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.guarded", description=__doc__)
    for kind, count in FLIGHTS.items():
        parser.add_argument(f"--{kind}", type=int, default=count, help="flights")
    parser.add_argument("--kept", type=Path, default=Path("guarded.jsonl"))
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wanted = [(kind, seed) for kind in FLIGHTS for seed in range(getattr(options, kind))]
    flown = _read(options.kept)
    for kind, seed in wanted:
        if (kind, seed) not in flown:
            flown[kind, seed] = _fly(kind, seed, options.kept)
    _print({key: flown[key] for key in wanted})


def _read(path: Path) -> dict[tuple[str, int], dict[str, Any]]:
    if not path.exists():
        return {}
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return {(row["kind"], row["seed"]): row for row in rows}


def _fly(kind: str, seed: int, path: Path) -> dict[str, Any]:
    sys.path.append(str(SUPPORT))
    outcome = importlib.import_module("guarded_counts").KINDS[kind](seed)
    row = {"kind": kind, "seed": seed, "is_kept": outcome.is_kept, **asdict(outcome)}
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")
    return row


def _print(flown: dict[tuple[str, int], dict[str, Any]]) -> None:
    print("| flights | wishes | margin kept | nearest | touched | near nothing, unchanged |")
    print("| --- | --- | --- | --- | --- | --- |")
    for kind in FLIGHTS:
        rows = [row for (one, _), row in flown.items() if one == kind]
        if not rows:
            continue
        sums: Counter[str] = Counter()
        for row in rows:
            sums.update({"wishes": row["tally"]["wishes"], "kept": row["is_kept"]})
            sums.update({"far": row["near_nothing"], "same": row["unchanged"]})
            sums["touched"] += row["nearest_m"] <= 0.0
        nearest = min(rows, key=lambda row: row["nearest_m"] - row["asked_m"])
        print(
            f"| {kind} | {sums['wishes']} | {_share(sums['kept'], len(rows))} "
            f"| {nearest['nearest_m']:.2f} m of {nearest['asked_m']:.1f} m "
            f"| {_share(sums['touched'], len(rows))} | {_share(sums['same'], sums['far'])} |"
        )


def _share(number: int, trials: int) -> str:
    """A count with its 95 % interval."""
    if not trials:
        return "-"
    low, high = (100.0 * one for one in wilson(number, trials))
    return f"{number} of {trials} ({low:.1f}-{high:.1f} %)"


if __name__ == "__main__":
    main()
