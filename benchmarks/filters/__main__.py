"""`python -m benchmarks.filters`: the guardian beside other safety filters.

Every filter stands between the same pilots and the same copter with inertia, in the same made-up
worlds, and knows what the same LiDAR shows. The flights go on where they were stopped. Methods of
other people's packages need `--python` of the peers' environment; they never run beside ours.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

from benchmarks.filters.flight import FlightRow, fly
from benchmarks.filters.methods import METHODS, Peers
from benchmarks.filters.page import flown_by_all, method_table, pilot_table, write_page
from benchmarks.filters.pilots import PILOTS
from benchmarks.filters.worlds import EMPTY, SMALLEST_M
from clearway.base.errors import ClearwayError
from clearway.base.version import __version__
from clearway.studies.campaigns.journal import Journal, open_journal

TUNING_SEED = 9000
"""Seeds from here on were used for tuning; results are of smaller ones."""


def cases(options: argparse.Namespace) -> list[FlightRow]:
    """Return the flights that are asked for, those of one course one after the other."""
    found = []
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        for world in options.world:
            if world == EMPTY and seed != options.first_seed:
                continue  # One is as empty as the other.
            for pilot in options.pilot:
                found += [FlightRow(world, seed, pilot, name) for name in options.method]
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Fly what is not flown yet, and print or write the tables."""
    options = _options(arguments)
    warnings.simplefilter("ignore")
    peers = Peers(options.python)
    asked = cases(options)
    with ExitStack() as stack:
        stack.callback(peers.end)
        journals = {
            name: stack.enter_context(_journal(options.out, name)) for name in options.method
        }
        done = {row.key: row for journal in journals.values() for row in journal.rows}
        for number, row in enumerate(asked, start=1):
            if row.key in done or options.summary:
                continue
            done[row.key] = _flown(row, peers)
            journals[row.method].append(done[row.key])
            print(f"{number}/{len(asked)} {_in_words(done[row.key])}", flush=True)
    rows = flown_by_all(done[row.key] for row in asked if row.key in done)
    if options.docs is not None:
        write_page(options.docs, rows)
    print(f"\n{method_table(rows)}\n\n{pilot_table(rows)}")


def _journal(folder: Path, method: str) -> AbstractContextManager[Journal[FlightRow]]:
    """Open the journal of a method, whose rows have its tuning in common."""
    settings = {"version": __version__, "tuning": METHODS[method].tuning}
    return open_journal(folder / f"{method}.jsonl", settings, FlightRow)


def _flown(row: FlightRow, peers: Peers) -> FlightRow:
    try:
        return fly(row, METHODS[row.method].make(peers))
    except ClearwayError as cause:
        row.failed = str(cause)
        return row


def _in_words(row: FlightRow) -> str:
    came = "contact" if row.contact else "arrived" if row.arrived else "not arrived"
    near = "" if row.nearest_m is None else f", nearest {row.nearest_m:.2f} m"
    return f"{row.world}/{row.seed}/{row.pilot}/{row.method}: {row.failed or came}{near}"


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.filters", description=__doc__)
    parser.add_argument("--seeds", type=int, default=2, help="of each kind of world")
    parser.add_argument("--first-seed", type=int, default=0, help=f"{TUNING_SEED} on are tuned on")
    parser.add_argument("--world", action="append", choices=SMALLEST_M, help="all by default")
    parser.add_argument("--pilot", action="append", choices=PILOTS, help="all by default")
    parser.add_argument("--method", action="append", choices=METHODS, help="all by default")
    parser.add_argument("--python", type=Path, help="of the peers' environment")
    parser.add_argument("--out", type=Path, default=Path("clearway-out/filters"))
    parser.add_argument("--docs", type=Path, help="a page to put the tables into")
    parser.add_argument("--summary", action="store_true", help="fly nothing")
    options = parser.parse_args(arguments)
    options.world = options.world or list(SMALLEST_M)
    options.pilot = options.pilot or list(PILOTS)
    all_known = options.summary or options.python
    known = [name for name, one in METHODS.items() if all_known or not one.needs_peers]
    options.method = options.method or known
    return options


if __name__ == "__main__":
    main()
