"""`python -m tools.reliability --journal reliability.jsonl`: goes on where it was cut off.

`--of clearances` looks at the clearance that decisions keep until the next one, `--of traffic` at
places of recorded aircraft, instead of at ratings. `--fit` makes the table of
the calibrated rating, or of clearances, from the first set of seeds; `--write` puts tables of the
held-out seeds into docs/results/calibration.md, and draws its picture.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from clearway.avoidance.rate.calibration import CLASSES
from clearway.studies.reliability.bins import BINS
from clearway.studies.reliability.fit import fit_knots
from clearway.studies.reliability.record import FITTED
from tools.reliability import kept_flights, kept_page, traffic_page
from tools.reliability.flights import FIT, HELD_OUT, TABLE, counts_of, flights
from tools.reliability.page import PAGE, write


def fit(rows: list[dict[str, Any]]) -> None:
    """The table of the calibrated rating."""
    knots, passages = {}, {}
    for name in CLASSES:
        counts = sum((counts_of(row, name, FITTED) for row in rows), np.zeros((BINS, 5)))
        knots[name] = [[round(float(x), 4), round(float(y), 4)] for x, y in fit_knots(counts)]
        passages[name] = int(counts[:, 0].sum())
    told = {
        "made_by": "python -m tools.reliability --fit",
        "flights": len(rows),
        "decisions": sum(row["decisions"] for row in rows),
        "passages": passages,
    }
    rows_of = [f'  "{name}": {json.dumps(table)}' for name, table in knots.items()]
    head = json.dumps(told, indent=1).removesuffix("\n}")
    text = head + ',\n "knots": {\n' + ",\n".join(rows_of) + "\n }\n}\n"
    TABLE.write_text(text, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--journal", type=Path, default=Path("reliability.jsonl"))
    parser.add_argument("--fit", action="store_true", help=f"make {TABLE} of the first set")
    parser.add_argument("--write", action="store_true", help=f"tables into {PAGE}, and its picture")
    parser.add_argument("--of", choices=("ratings", "clearances", "traffic"), default="ratings")
    parser.add_argument("recordings", type=Path, nargs="*", help="of aircraft, with --of traffic")
    given = parser.parse_args()
    if given.of == "traffic":
        traffic_page.write(given.recordings)
        return
    if given.of == "clearances":
        rows = kept_flights.flights(given.journal, FIT if given.fit else HELD_OUT)
        if given.fit:
            kept_page.fit(rows)
        elif given.write:
            kept_page.write(rows)
        return
    if given.fit:
        fit(flights(given.journal, FIT))
        return
    rows = flights(given.journal, HELD_OUT)
    if given.write:
        write(rows)


if __name__ == "__main__":
    main()
