"""What commands print on pages: `python -m tools.transcripts` checks it, `--write` writes it anew.

Each block of language `console` that begins with `$ clearway ...` is run, page after page, in the
folder of `clearway sample`; below the command goes what it prints, without times of computing.
`2>/dev/null` leaves out its notes, ` | grep WORD` all lines but those that contain the word.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

REPOSITORY = Path(__file__).resolve().parent.parent
Run = Callable[[Sequence[str], Path], tuple[str, str]]
"""Runs clearway with some words in a folder; what it prints on standard output and error."""
BLOCK = re.compile(r"^```console\n\$ (clearway [^\n]*)\n.*?^```$", re.MULTILINE | re.DOTALL)
WIDTH = "100"
"""Columns of the terminal."""
LONGEST, LONGEST_OF_TABLES, LINES = 100, 100, 24
NUMBER = re.compile(r"\d+(?:\.\d+)?")
COLUMNS = re.compile(r"\S {3,}\S.* {3,}\S|[│┃─━]")
"""Of a line of a table: at least three, well apart."""
SLOW = re.compile(
    r"^(preparing reach sets|still working|net\.core).*\n",
    re.MULTILINE,
)
"""What is said on some machines only: of how long it takes, and of their kernels."""
TIMES = re.compile(r"( *)\b(\d+\.\d+)(?= ms\b)")
TIMED_COLUMNS = re.compile(r"( +)([\d.]+)(?=( +[\d.]+)?$)")
"""The last two of a table whose header ends with TIMED_HEADER."""
TIMED_HEADER = "p50 ms  p99 ms"


def pages() -> dict[Path, str]:
    """All pages that have transcripts, with their text."""
    every = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
    texts = {page: page.read_text(encoding="utf-8") for page in every}
    return {page: text for page, text in texts.items() if BLOCK.search(text)}


def in_a_process(words: Sequence[str], folder: Path) -> tuple[str, str]:
    """As a user runs it."""
    code = "from clearway.cli.app import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": WIDTH},
        check=False,
    )
    return done.stdout, done.stderr


def transcript(command: str, folder: Path, run: Run = in_a_process) -> str:
    """What a command prints: what it assumed, then its result."""
    command, _, word = command.partition(" | grep ")
    command, _, quiet = command.partition(" 2>/dev")
    result, notes = run(shlex.split(command)[1:], folder)
    said = SLOW.sub("", notes.replace(f"{folder}{os.sep}", ""))
    text = without_times(TIMES.sub(_left_out, result if quiet or word else said + result))
    if word:
        text = "\n".join(line for line in text.splitlines() if shlex.split(word)[0] in line)
    lines = [part for line in text.strip().splitlines() for part in _fitted(line.rstrip())]
    if len(lines) > LINES:
        lines = [*lines[: LINES - 1], f"({len(lines) - LINES + 1} more lines)"]
    return "\n".join(lines)


def without_times(text: str) -> str:
    """Rows of tables of decision times without these: they are of one machine and hour."""
    lines, timed = [], False
    for line in (one.rstrip() for one in text.splitlines()):
        timed = bool(line) and (timed or line.endswith(TIMED_HEADER))
        lines.append(TIMED_COLUMNS.sub(_left_out, line) if timed else line)
    return "\n".join(lines)


def _left_out(found: re.Match[str]) -> str:
    """Dots in place of a number, as wide as it was in a table: columns stay under their names."""
    before, number = found.groups()[:2]
    return "...".rjust(len(before + number)) if len(before) > 1 else f"{before}..."


def _fitted(line: str) -> list[str]:
    """Sentences are broken between words, as a terminal would; tables stay as they are."""
    if len(line) <= LONGEST or COLUMNS.search(line.strip()):
        return [line[:LONGEST_OF_TABLES]]
    begins = " " * (len(line) - len(line.lstrip()))
    return textwrap.wrap(line, LONGEST, subsequent_indent=f"{begins}    ", break_on_hyphens=False)


def filled(page: str, folder: Path, run: Run = in_a_process) -> str:
    """The page with all of its commands run, in order."""
    return BLOCK.sub(
        lambda found: f"```console\n$ {found[1]}\n{transcript(found[1], folder, run)}\n```", page
    )


def differences(before: str, after: str) -> list[str]:
    """Lines of a page that are not what its commands print.

    A number may be off by one in its last digit: processors differ in that.
    """
    old, new = before.splitlines(), after.splitlines()
    if len(old) != len(new):
        return [line for line in new if line not in old] or [f"{len(new)} lines, not {len(old)}"]
    return [line for one, line in zip(old, new, strict=True) if not _alike(one, line)]


def _alike(one: str, other: str) -> bool:
    if one == other:
        return True
    words = [" ".join(NUMBER.sub("#", line).split()) for line in (one, other)]
    pairs = list(zip(NUMBER.findall(one), NUMBER.findall(other), strict=False))
    return words[0] == words[1] and all(
        abs(float(a) - float(b)) <= 1.01 * 10.0 ** -len(a.partition(".")[2]) for a, b in pairs
    )


def main() -> None:
    if sys.argv[1:] not in ([], ["--write"]):
        raise SystemExit("python -m tools.transcripts [--write]")
    stale = []
    with TemporaryDirectory() as scratch:
        folder = Path(scratch).resolve() / "samples"
        in_a_process(["sample", str(folder)], Path(scratch))
        for page, text in pages().items():
            made = filled(text, folder)
            other = differences(text, made)
            if other and sys.argv[1:]:
                page.write_text(made, encoding="utf-8")
                print(f"{page.relative_to(REPOSITORY)} written")
            elif other:
                stale.append(page)
                print(f"{page.relative_to(REPOSITORY)}:", *other, sep="\n  ")
    raise SystemExit(1 if stale else 0)


if __name__ == "__main__":
    main()
