"""`python -m benchmarks`: measure everything and print one table."""

from __future__ import annotations

import argparse
import fnmatch
import os
import sys
import traceback
from pathlib import Path

from benchmarks.table import (
    Benchmark,
    Results,
    Row,
    as_markdown,
    machine,
    print_table,
    replace_short_form,
)

BUSY = 0.7
PAGE = Path(__file__).resolve().parent.parent / "docs" / "measured.md"


def main() -> None:
    options = _options()
    chosen = _chosen(options.only)
    load = os.getloadavg()[0]
    if load > BUSY:
        print(
            f"others keep this machine busy (load {load:.1f}): times will be long", file=sys.stderr
        )
    rows, failed = _measured(chosen, options.quick)
    results = Results(rows, machine(load))
    print_table(results)
    if options.markdown is not None:
        options.markdown.write_text(as_markdown(results), encoding="utf-8")
    if failed:
        raise SystemExit(f"failed, and left out of the table: {', '.join(failed)}")
    if options.readme:
        replace_short_form(PAGE, results)


def _measured(
    chosen: list[Benchmark], quick: bool
) -> tuple[list[tuple[Benchmark, Row]], list[str]]:
    """A row each, and the names of those that failed: one does not take the others with it."""
    rows: list[tuple[Benchmark, Row]] = []
    failed = []
    for number, benchmark in enumerate(chosen, start=1):
        print(f"{number} of {len(chosen)}: {benchmark.name}", file=sys.stderr)
        try:
            rows.append((benchmark, benchmark.measure(quick)))
        except Exception:
            traceback.print_exc()
            failed.append(benchmark.name)
    return rows, failed


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer repeats, fewer flights")
    parser.add_argument(
        "--only",
        metavar="PATTERN",
        action="append",
        default=[],
        help="names that contain it, with * for anything; may be given again",
    )
    parser.add_argument("--markdown", metavar="FILE", type=Path, help="write the table to a file")
    parser.add_argument(
        "--readme",
        action="store_true",
        help="put the headlines of what was measured into docs/measured.md",
    )
    options = parser.parse_args()
    if options.readme and options.quick:
        parser.error("--readme takes a full run, without --quick")
    return options


def _chosen(patterns: list[str]) -> list[Benchmark]:
    """Benchmarks by name, or all; those that fly take long and come last."""
    from benchmarks import (
        campaign,
        decisions,
        encounters,
        flights,
        intruders,
        maps,
        reach,
        replay,
        scans,
        sensors,
        traffic,
    )

    rooms = (
        decisions,
        sensors,
        reach,
        maps,
        intruders,
        scans,
        traffic,
        campaign,
        flights,
        encounters,
        replay,
    )
    everything = [benchmark for room in rooms for benchmark in room.BENCHMARKS]
    if not patterns:
        return everything
    names = [each.name for each in everything]
    found = {pattern: fnmatch.filter(names, f"*{pattern}*") for pattern in patterns}
    for pattern, matches in found.items():
        if not matches:
            known = "\n  ".join(names)
            raise SystemExit(f"no benchmark is called *{pattern}*; there are\n  {known}")
    wanted = {name for matches in found.values() for name in matches}
    return [each for each in everything if each.name in wanted]


if __name__ == "__main__":
    main()
