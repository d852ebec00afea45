"""Errors that a user can meet, each naming file, place and cause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal


class ClearwayError(ValueError):
    """Base of all errors raised on purpose; the command line prints it and exits 2."""


class InputError(ClearwayError):
    """A file or argument cannot be used; collects every problem found, one line each."""

    def __init__(self, source: str, problems: str | Sequence[str]) -> None:
        self.source = source
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(f"{source}: {problem}" for problem in self.problems))


@contextmanager
def naming(path: str | Path, doing: Literal["read", "written"]) -> Iterator[None]:
    """What the operating system refuses in the block, told as InputError of the file."""
    try:
        yield
    except OSError as cause:
        raise InputError(str(path), f"cannot be {doing}: {cause.strerror or cause}") from cause


class MissingExtraError(ClearwayError):
    """An optional dependency is absent; names the extra that brings it."""

    def __init__(self, purpose: str, extra: str) -> None:
        super().__init__(f"{purpose} needs an optional package: pip install 'clearway[{extra}]'")


class FlightRefusedError(ClearwayError):
    """A mission that cannot be flown, found before take-off."""
