"""What the commands of the tutorials print: `python -m tools.transcripts` writes it into the pages.

Each block of language `console` that begins with `$ clearway ...` is run, page after page, in the
folder of `clearway sample`; below the command goes what it says, without times of computing.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path
from tempfile import TemporaryDirectory

PAGES = Path(__file__).resolve().parent.parent / "docs" / "tutorials"
BLOCK = re.compile(r"^```console\n\$ (clearway [^\n]*)\n.*?^```$", re.MULTILINE | re.DOTALL)
LONGEST, LONGEST_OF_TABLES, LINES = 110, 150, 24
COLUMNS = re.compile(r"\S {3,}\S.* {3,}\S|[│┃─━]")
"""Of a line of a table: at least three, well apart."""
SLOW = re.compile(
    r"^(preparing reach sets|still working|compiling|clearway compiles|warming up|net\.core).*\n",
    re.MULTILINE,
)
"""What is said on some machines only: of how long it takes, and of their kernels."""
TIMES = re.compile(r"( *)\b(\d+\.\d+)(?= ms\b)")
TIMED_COLUMNS = re.compile(r"( +)([\d.]+)(?=( +[\d.]+)?$)")
"""The last two of a table whose header ends with TIMED_HEADER."""
TIMED_HEADER = "p50 ms   p99 ms"


def transcript(command: str, folder: Path) -> str:
    """What a command prints: what it assumed, then its result."""
    code = "from clearway.cli.app import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, *shlex.split(command)[1:]],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": "110"},
        check=False,
    )
    said = SLOW.sub("", done.stderr.replace(f"{folder}{os.sep}", ""))
    text = without_times(TIMES.sub(_left_out, said + done.stdout))
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


def filled(page: str, folder: Path) -> str:
    """The page with all of its commands run, in order."""
    return BLOCK.sub(
        lambda found: f"```console\n$ {found[1]}\n{transcript(found[1], folder)}\n```", page
    )


def main() -> None:
    with TemporaryDirectory() as scratch:
        folder = Path(scratch).resolve() / "samples"
        transcript(f"clearway sample {folder}", Path(scratch))
        for page in sorted(PAGES.glob("*.md")):
            text = page.read_text(encoding="utf-8")
            made = filled(text, folder)
            if made != text:
                page.write_text(made, encoding="utf-8")
                print(f"{page.name} written")


if __name__ == "__main__":
    main()
