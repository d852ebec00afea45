"""Tables on the terminal: plain, and not wider than 100 columns where names are of usual length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

# Columns of a table: those of a usual terminal. Longer cells are folded, and never cut off.
TABLE_WIDTH = 100


def plain_table(texts: Sequence[str], numbers: Sequence[str], title: str | None = None) -> Table:
    """Return an empty table with columns of texts, then columns of numbers, two blanks apart."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=title, box=SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True
    )
    for name in texts:
        table.add_column(name, overflow="fold")
    for name in numbers:
        table.add_column(name, justify="right", overflow="fold")
    return table


def print_table(table: Table) -> None:
    """Print a table between empty lines, without blanks at the ends of its lines."""
    from rich.console import Console

    console = Console(width=TABLE_WIDTH)
    with console.capture() as captured:
        console.print(table)
    lines = [line.rstrip() for line in captured.get().splitlines()]
    print("\n".join(["", *lines, ""]))
