"""`python -m benchmarks`: measure everything and print one table."""

from __future__ import annotations

import argparse
import fnmatch
import os
import sys
import traceback
from dataclasses import replace
from functools import partial
from pathlib import Path

from benchmarks.pace import Pace
from benchmarks.table import (
    Benchmark,
    Results,
    Row,
    as_markdown,
    machine,
    middle_of,
    print_table,
    replace_first_page_form,
    replace_short_form,
)

BUSY = 0.7
REPOSITORY = Path(__file__).resolve().parent.parent
PAGE = REPOSITORY / "docs" / "results" / "speed.md"


def main() -> None:
    options = _options()
    chosen = _chosen(options.only)
    if options.first_page:
        chosen = [each for each in chosen if each.first_page]
    load = os.getloadavg()[0]
    if load > BUSY:
        print(
            f"others keep this machine busy (load {load:.1f}): times will be long", file=sys.stderr
        )
    pace = Pace()
    rows, failed = _measured(chosen, options.quick, options.runs, pace, options.calm)
    results = Results(rows, f"{machine(load)}; {pace}")
    print_table(results)
    if options.markdown is not None:
        options.markdown.write_text(as_markdown(results), encoding="utf-8")
    if failed:
        raise SystemExit(f"failed, and left out of the table: {', '.join(failed)}")
    if options.readme:
        replace_short_form(PAGE, results)
    if options.first_page:
        replace_first_page_form(PAGE, results)


def _measured(
    chosen: list[Benchmark], quick: bool, runs: int, pace: Pace, calm: int
) -> tuple[list[tuple[Benchmark, Row]], list[str]]:
    """A row each, of several runs the one in the middle, and the names of those that failed: one
    does not take the others with it. All are done once before any is done again."""
    rows: dict[str, list[Row]] = {benchmark.name: [] for benchmark in chosen}
    failed: list[str] = []
    for run in range(runs):
        for number, benchmark in enumerate(chosen, start=1):
            again = f", run {run + 1} of {runs}" if runs > 1 else ""
            print(f"{number} of {len(chosen)}{again}: {benchmark.name}", file=sys.stderr)
            if benchmark.name in failed:
                continue
            try:
                row = pace.calmest(partial(benchmark.measure, quick), calm)
                rows[benchmark.name].append(replace(row, load=os.getloadavg()[0]))
            except Exception:
                traceback.print_exc()
                failed.append(benchmark.name)
    done = [benchmark for benchmark in chosen if benchmark.name not in failed]
    return [(benchmark, middle_of(rows[benchmark.name])) for benchmark in done], failed


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
        help="put the headlines of what was measured into docs/results/speed.md",
    )
    parser.add_argument(
        "--runs", type=int, default=1, metavar="N", help="show the median of so many runs"
    )
    parser.add_argument(
        "--calm",
        type=int,
        default=1,
        metavar="N",
        help="measure a row up to N times, until a loop of Python is as quick before and after it "
        "as when nothing else slows the machine down",
    )
    parser.add_argument(
        "--first-page",
        action="store_true",
        help="measure what README quotes, for the same page; the published one is of five --runs",
    )
    options = parser.parse_args()
    if (options.readme or options.first_page) and options.quick:
        parser.error("--readme and --first-page take a full run, without --quick")
    for name, times in (("--runs", options.runs), ("--calm", options.calm)):
        if times < 1:
            parser.error(f"{name}: {times}; at least 1 is needed")
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
        sizes,
        traffic,
        worst,
    )

    rooms = (
        decisions,
        sizes,
        worst,
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
