"""How often `clearway why` names the fault of made crashes: `python -m benchmarks.crashes`.

Every crash is drawn from a seed: its fault first, then format, vehicle, speed and place. The same
flight without the fault keeps clear. What is named is kept in a journal, one line a crash, and not
asked again; so it may be stopped at any time.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import sys
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError, naming
from clearway.base.intervals import wilson
from clearway.base.version import __version__
from clearway.io.staging import stage_file
from clearway.io.toml_writing import write_toml
from clearway.studies.campaigns.journal import open_journal
from clearway.studies.why.causes import CrashCause
from clearway.studies.why.explain import explain_flight

SUPPORT = Path(__file__).resolve().parent.parent / "tests" / "support"
FRESH_SEED = 100
TUNING_SEED = 9000
"""Results are of seeds from the first on; those before it, and from the second on, were used for
tuning."""
CAUSES = tuple(str(one) for one in CrashCause if one not in (CrashCause.NONE,))


@dataclass
class CrashRow:
    """A crash and what it was named; all that the journal keeps."""

    seed: int
    cause: str
    form: str
    vehicle: str
    speed_mps: float
    named: str
    off_s: float
    """From the true end to the one that was found."""

    @property
    def right(self) -> bool:
        """Whether the fault was named."""
        return self.named == self.cause


def main(arguments: Sequence[str] | None = None) -> None:
    """Make and ask what is missing, and print or write the tables."""
    options = _options(arguments)
    warnings.simplefilter("ignore")
    seeds = range(options.first_seed, options.first_seed + options.count)
    with open_journal(options.journal, {"version": __version__}, CrashRow) as journal:
        done = {row.seed: row for row in journal.rows}
        for seed in () if options.summary else seeds:
            if seed not in done:
                done[seed] = name_cause(seed)
                journal.append(done[seed])
                print(f"{seed}: {_in_words(done[seed])}", flush=True)
    rows = [done[seed] for seed in seeds if seed in done]
    if options.docs is not None:
        write_page(options.docs, rows)
    print(f"\n{cause_table(rows)}\n\n{group_table('log', rows, lambda row: row.form)}")


def name_cause(seed: int) -> CrashRow:
    """Make the crash of a seed, write its log, and ask for its cause."""
    if str(SUPPORT) not in sys.path:
        sys.path.append(str(SUPPORT))
    made: Any = importlib.import_module("made_crashes").make_crash(seed)
    write_log: Any = importlib.import_module("made_logs").write_log
    with tempfile.TemporaryDirectory() as folder:
        with contextlib.redirect_stderr(io.StringIO()):
            log = write_log(made, Path(folder))
        mission = None
        if made.form != "run":
            mission = Path(folder) / "mission.toml"
            write_toml(made.file.effective(), mission)
        explained = explain_flight(log, mission)
    craft, ending = made.case.craft, explained.answer.ending
    off_s = ending.time_s - explained.start_s - float(made.flight.time_s[-1])
    vehicle = "copter" if craft.stops else "plane"
    named = str(explained.answer.cause)
    return CrashRow(
        seed, made.cause, made.form, vehicle, craft.speed_mps, named, round(off_s, 3)
    )  # fmt: skip


def cause_table(rows: Sequence[CrashRow]) -> str:
    """A line a cause that was made: how often it was named what."""
    lines: list[Sequence[str]] = [("made", "n", "right", *CAUSES, "none")]
    made = [cause for cause in CAUSES if any(row.cause == cause for row in rows)]
    for cause in (*made, "all"):
        own = [row for row in rows if cause in (row.cause, "all")]
        named = [sum(row.named == one for row in own) for one in (*CAUSES, "none")]
        lines.append((cause, str(len(own)), _right(own), *(str(one or "-") for one in named)))
    return _as_table(lines)


def group_table(head: str, rows: Sequence[CrashRow], group: Callable[[CrashRow], str]) -> str:
    """A line a group of crashes: how many of them were named right."""
    lines: list[Sequence[str]] = [(head, "n", "right")]
    for name in sorted({group(row) for row in rows}):
        own = [row for row in rows if group(row) == name]
        lines.append((name, str(len(own)), _right(own)))
    return _as_table(lines)


def _right(rows: Sequence[CrashRow]) -> str:
    right = sum(row.right for row in rows)
    low, high = wilson(right, len(rows))
    return f"{right} of {len(rows)} ({100.0 * low:.1f}-{100.0 * high:.1f} %)"


def _as_table(lines: Sequence[Sequence[str]]) -> str:
    head, *rest = [f"| {' | '.join(line)} |" for line in lines]
    return "\n".join([head, f"|{' --- |' * len(lines[0])}", *rest])


def write_page(page: Path, rows: Sequence[CrashRow]) -> None:
    """Put the tables between their marks; raises InputError where a mark is missing."""
    made = {
        "crashes-causes": cause_table(rows),
        "crashes-logs": group_table("log", rows, lambda row: row.form),
        "crashes-vehicles": group_table(
            "vehicle", rows, lambda row: f"{row.vehicle}, {row.speed_mps:g} m/s"
        ),
    }
    with naming(page, "written"):
        text = page.read_text(encoding="utf-8")
    for name, table in made.items():
        begin, end = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
        before, there, rest = text.partition(begin)
        _, ends, after = rest.partition(end)
        if not there or not ends:
            raise InputError(str(page), f"no {begin} ... {end}")
        text = f"{before}{begin}\n{table}\n{end}{after}"
    with stage_file(page) as scratch:
        scratch.write_text(text, encoding="utf-8")


def _in_words(row: CrashRow) -> str:
    verdict = "right" if row.right else f"WRONG, named {row.named}"
    return f"{row.cause}, {row.form}, {row.vehicle} of {row.speed_mps:g} m/s: {verdict}"


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.crashes", description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="crashes")
    parser.add_argument(
        "--first-seed",
        type=int,
        default=FRESH_SEED,
        help=f"those below {FRESH_SEED}, and from {TUNING_SEED} on, are tuned on",
    )
    parser.add_argument("--journal", type=Path, default=Path("clearway-out/crashes.jsonl"))
    parser.add_argument("--docs", type=Path, help="a page to put the tables into")
    parser.add_argument("--summary", action="store_true", help="make no further crash")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main()
