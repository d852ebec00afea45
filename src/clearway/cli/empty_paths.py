"""Names of files and folders on the command line that are empty: Python reads them as `.`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer

SAID = "it names nothing; this folder is ."


def refuse_empty(context: Any, command: Any, args: Sequence[str]) -> None:
    """Raise typer.BadParameter for a file or folder whose name was given as ''.

    args: as they were written, since nobody can tell an empty path from `.` once it is one.
    """
    if not any(arg == "" or arg.endswith("=") for arg in args):
        return
    paths = {name: param for param in _paths(command) for name in param.opts}
    argument = next((param for name, param in paths.items() if not name.startswith("-")), None)
    for before, arg in pairwise(("", *args)):
        if arg.endswith("="):
            param = paths.get(arg.removesuffix("=")) if arg.startswith("-") else None
        elif arg == "":
            param = paths.get(before) if before.startswith("-") else argument
        else:
            continue
        if param is not None:
            raise typer.BadParameter(SAID, context, param)


def _paths(command: Any) -> Iterator[Any]:
    """The parameters of a command that are paths, one or many, needed or not."""
    if command.callback is None:  # A group that does nothing without a command below it.
        return
    hints = get_type_hints(command.callback)
    for param in command.params:
        kind = hints.get(param.name)
        inner = get_args(kind)
        if Path in (kind, *inner, *(one for part in inner for one in get_args(part))):
            yield param
