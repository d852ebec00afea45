"""Numbers on the command line: what is infinite, no number or absurdly large gets no farther."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import typer

from clearway.base.errors import InputError

LARGEST = 1e9
"""As `clearway.base.checks` has it, which would bring NumPy to `--help`."""
LARGEST_WHOLE = 10**16
"""Seeds in microseconds since 1970 fit."""
MOST_COUNTED = 10_000_000
"""Flights, encounters or rounds of a study: years of flying, and their numbers still fit."""
MOST_WORKERS = 1024
"""All are started at once."""
SHOWN = 24
"""Characters of a refused number that a message repeats."""


def refuse_absurd(context: Any, params: Iterable[Any]) -> None:
    """Raise typer.BadParameter for a number that is not finite or larger than anything is."""
    for param in params:
        value = context.params.get(param.name)
        if isinstance(value, float) and not abs(value) <= LARGEST:
            wanted, largest = "a number", LARGEST
        elif isinstance(value, int) and abs(value) > LARGEST_WHOLE:
            wanted, largest = "a whole number", LARGEST_WHOLE
        else:
            continue
        shown = str(value) if len(str(value)) <= SHOWN else f"{str(value)[:SHOWN]}..."
        said = f"{shown} is not {wanted} from {-largest:g} to {largest:g}."
        raise typer.BadParameter(said, context, param)


def number_pair(option: str, text: str, example: str, most: float = LARGEST) -> tuple[float, float]:
    """Two numbers with a comma between; raises InputError that names the option."""
    try:
        first, second = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(option, f"two numbers are needed, as in {example}; got {text!r}") from None
    if not (0.0 <= first <= most and 0.0 <= second <= most):
        raise InputError(
            option, f"two numbers from 0 to {most:g} are needed, as in {example}; got {text!r}"
        )
    return first, second
