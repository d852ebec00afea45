"""The progress bar on standard error; nothing is drawn where that is no terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from clearway.base.plain_text import make_printable
from clearway.cli.report import say

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn, TaskID

Beside = Literal["count", "status", "elapsed", "remaining"]
"""What can stand behind the bar: m/n, words of the caller, time gone by, time expected."""
TAKEN_FOR_TERMINALS = ("FORCE_COLOR", "TTY_COMPATIBLE")
"""Variables of the environment by which rich may take for a terminal what is none."""


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar that is being shown; of nothing shown, what stands for it where none is."""

    shown: tuple[Progress, TaskID] | None = None

    def advance(self, more: float = 1.0) -> None:
        """So much more is done."""
        if self.shown:
            progress, task = self.shown
            progress.advance(task, more)

    def show(self, done: float, total: float | None = None, status: str | None = None) -> None:
        """So much is done of so much; None leaves what is shown."""
        if self.shown:
            progress, task = self.shown
            words: dict[str, Any] = {} if status is None else {"status": status}
            progress.update(task, completed=done, total=total, **words)

    def print_above(self, line: str, colour: str) -> None:
        """A line that stays; where no terminal folds it, it is one line of the file or pipe."""
        console = self.shown[0].console if self.shown else None
        if console is not None and console.is_terminal:
            from rich.text import Text

            console.print(Text(make_printable(line), style=colour))
        else:
            say(line)


@contextmanager
def progress_bar(
    name: str,
    total: float | None = None,
    beside: Sequence[Beside] = ("count", "elapsed"),
    status: str = "",
) -> Iterator[Bar]:
    """Show a bar with a name while the block runs; a total of None is not known yet."""
    terminal = sys.stderr is not None and sys.stderr.isatty()
    if not terminal and not any(map(os.environ.get, TAKEN_FOR_TERMINALS)):
        yield Bar()  # Without rich, which takes longer to load than some of what is waited for.
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), *map(_column, beside))
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as progress:
        yield Bar(
            (progress, progress.add_task(make_printable(name, ""), total=total, status=status))
        )


def _column(what: Beside) -> ProgressColumn:
    from rich.progress import MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    match what:
        case "count":
            return MofNCompleteColumn()
        case "status":
            return TextColumn("{task.fields[status]}", markup=False)
        case "elapsed":
            return TimeElapsedColumn()
        case "remaining":
            return TimeRemainingColumn()
