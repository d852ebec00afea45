"""Errors that a user can meet, each naming file, place and cause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

MOST_SHOWN = 70
"""Characters of a source or a problem in the one line that stands for an error."""


class ClearwayError(ValueError):
    """Base of all errors raised on purpose; the command line prints it and exits 2."""


class InputError(ClearwayError):
    """A file or argument cannot be used; collects every problem found, one line each."""

    def __init__(self, source: str, problems: str | Sequence[str]) -> None:
        self.source = source
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(f"{source}: {problem}" for problem in self.problems))

    def __repr__(self) -> str:
        """One line: the source, the first problem and how many more; `str` has all of them."""
        first = " ".join("".join(self.problems[:1]).split())
        shown = first if len(first) <= MOST_SHOWN else f"{first[:MOST_SHOWN]} ..."
        more = f" and {len(self.problems) - 1} more" if len(self.problems) > 1 else ""
        return f"{type(self).__name__}({self.source[-MOST_SHOWN:]!r}: {shown}{more})"

    def __reduce__(self) -> tuple[type[InputError], tuple[str, tuple[str, ...]]]:
        """As it was made, so that it comes back whole from a worker process."""
        return type(self), (self.source, self.problems)


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
        self.purpose, self.extra = purpose, extra
        super().__init__(f"{purpose} needs an optional package: pip install 'clearway[{extra}]'")

    def __reduce__(self) -> tuple[type[MissingExtraError], tuple[str, str]]:
        return type(self), (self.purpose, self.extra)


class OwnCodeError(InputError):
    """A user's own function, named `module:name`, is not there or does not do what it should."""


class FlightRefusedError(ClearwayError):
    """A mission that cannot be flown, found before take-off."""
