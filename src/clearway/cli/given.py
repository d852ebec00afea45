"""Options that were written on the command line, as against those that stand as they are."""

from __future__ import annotations

from collections.abc import Container

import typer

from clearway.base.errors import InputError


def split_names(text: str) -> list[str]:
    """Return the names of a list with commas between, as `--planners` takes it."""
    return [name.strip() for name in text.split(",")]


def refuse_given(context: typer.Context, names: Container[str], why: str) -> None:
    """Raise InputError naming the first of these parameters that was written, if as its default."""
    for param in context.command.params:
        source = context.get_parameter_source(param.name or "")
        if param.name in names and source is not None and source.name == "COMMANDLINE":
            raise InputError(param.opts[0], why)
