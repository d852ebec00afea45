"""Errors that a user can meet, each naming file, place and cause."""

from __future__ import annotations

import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from clearway.base.plain_text import make_printable, shorten_problems
from clearway.base.suggest import file_nearby

MOST_SHOWN = 70
"""Characters of a source or a problem in the one line that stands for an error."""


class ClearwayError(ValueError):
    """Base of all errors raised on purpose; the command line prints it and exits 2.

    >>> import clearway as cw
    >>> try:
    ...     cw.read_scan("absent.pcd")
    ... except cw.ClearwayError as error:
    ...     print(error)
    absent.pcd: cannot be read: No such file or directory
    """


class InputError(ClearwayError):
    """A file or argument cannot be used; collects every problem found, one line each.

    As text it has at most 500 characters, none of them a control character: problems beyond that
    are counted, and stand in full in `problems`.
    """

    def __init__(self, source: str, problems: str | Sequence[str]) -> None:
        self.source = source
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__(shorten_problems(make_printable(source, ""), self.problems))

    def __repr__(self) -> str:
        """One line: the source, the first problem and how many more; `str` has all of them."""
        first = " ".join("".join(self.problems[:1]).split())
        shown = first if len(first) <= MOST_SHOWN else f"{first[:MOST_SHOWN]} ..."
        more = f" and {len(self.problems) - 1} more" if len(self.problems) > 1 else ""
        return f"{type(self).__name__}({self.source[-MOST_SHOWN:]!r}: {shown}{more})"

    def __reduce__(self) -> tuple[type[InputError], tuple[str, tuple[str, ...]]]:
        """As it was made, so that it comes back whole from another process."""
        return type(self), (self.source, self.problems)


class SeveralErrors(ClearwayError):
    """Errors of several files that were asked for at once, each with a message of its own."""

    def __init__(self, errors: Sequence[ClearwayError]) -> None:
        self.errors = tuple(errors)
        super().__init__("\n".join(map(str, errors)))

    def __reduce__(self) -> tuple[type[SeveralErrors], tuple[tuple[ClearwayError, ...]]]:
        return type(self), (self.errors,)


def special_kind(path: str | Path) -> str | None:
    """ "a pipe", "a socket" or "a device"; None for files, folders, and what may not be asked."""
    try:
        mode = Path(path).stat().st_mode
    except (OSError, ValueError):
        return None
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
        return None
    return "a pipe" if stat.S_ISFIFO(mode) else "a socket" if stat.S_ISSOCK(mode) else "a device"


def refuse_special(path: str | Path) -> None:
    """Raise InputError for what is neither a file nor a folder, which to open may block for ever.

    What is not there, or may not be asked about, is for the opening to tell.
    """
    kind = special_kind(path)
    if kind is not None:
        raise InputError(str(path), f"cannot be read: it is {kind}; a file is needed")


@contextmanager
def naming(path: str | Path, doing: Literal["read", "written"]) -> Iterator[None]:
    """What the operating system refuses in the block, told as InputError of the file.

    Pipes, sockets and devices are refused before.
    """
    if doing == "read":
        refuse_special(path)
    try:
        yield
    except OSError as cause:
        near = ""
        if doing == "read" and isinstance(cause, FileNotFoundError) and not Path(path).exists():
            near = file_nearby(path)
        problem = f"cannot be {doing}: {cause.strerror or cause}{near}"
        raise InputError(str(path), problem) from cause
    except ValueError as cause:  # a name with a null character
        if isinstance(cause, ClearwayError) or "null" not in str(cause):
            raise
        raise InputError(str(path), f"cannot be {doing}: no file has such a name") from cause


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
