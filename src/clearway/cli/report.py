"""What all commands share: exit status, messages apart from results, JSON alone on output."""

from __future__ import annotations

import functools
import json
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, ParamSpec, TypeVar

from clearway.base.errors import ClearwayError, InputError
from clearway.base.verdict import DemandVerdict, worst_of

if TYPE_CHECKING:
    from rich.console import Console

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

NOT_REACHED = 1
BAD_INPUT = 2
NOT_SHOWN = 3
"""Neither shown nor missed, or something that was asked for was skipped."""
INTERRUPTED = 130


def run_guarded(command: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """The command with errors that a user can meet told in a message, exit status 2.

    Ctrl-C ends with 130, and a reader that has gone away (`| head`) with the usual 141.
    """

    @functools.wraps(command)
    def guarded(*args: Parameters.args, **options: Parameters.kwargs) -> Result:
        try:
            return command(*args, **options)
        except ClearwayError as error:
            say(str(error))
            leave(BAD_INPUT)
        except KeyboardInterrupt:
            say("interrupted")
            leave(INTERRUPTED)
        except BrokenPipeError:
            # Python would else complain once more when it flushes on its way out.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            leave(141)

    return guarded


def number_pair(option: str, text: str, example: str) -> tuple[float, float]:
    """Two numbers with a comma between; raises InputError that names the option."""
    try:
        first, second = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(option, f"two numbers are needed, as in {example}; got {text!r}") from None
    return first, second


def folder_of_file(name_or_path: str) -> Path | None:
    """Where modules of the user may lie beside the current folder: with a file that was given."""
    path = Path(name_or_path)
    return path.parent if path.is_file() else None


def leave(status: int) -> NoReturn:
    """End the command with an exit status."""
    raise SystemExit(status)


def leave_by(verdicts: Iterable[DemandVerdict]) -> None:
    """End the command if any demand is missed, or not shown."""
    worst = worst_of(verdicts)
    if worst is not DemandVerdict.SHOWN:
        leave(NOT_REACHED if worst is DemandVerdict.MISSED else NOT_SHOWN)


def say(message: str) -> None:
    """A message to the user: on standard error, so that results stay alone on output."""
    print(message, file=sys.stderr)


def table_console() -> Console:
    """Where tables are printed: as wide as the terminal, and wide where there is none."""
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=160)


def sourced(result: dict[str, Any], inputs: Iterable[str | Path] = ()) -> dict[str, Any]:
    """The result with where it comes from; inputs: files it is made of."""
    from clearway.base.provenance import provenance

    return result if "provenance" in result else {**result, "provenance": provenance(inputs)}


def print_json(result: dict[str, Any]) -> None:
    """One JSON object on standard output, with where it comes from."""
    print(json.dumps(sourced(result), allow_nan=False))
    sys.stdout.flush()
