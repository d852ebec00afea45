"""What all commands share: exit status, messages apart from results, JSON alone on output."""

from __future__ import annotations

import errno
import functools
import json
import logging
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn, ParamSpec, TypeVar

from clearway.base.errors import (
    ClearwayError,
    InputError,
    MissingExtraError,
    SeveralErrors,
    refuse_special,
)
from clearway.base.plain_text import LONGEST_MESSAGE, in_full, make_printable, shorten, some_lines
from clearway.base.verdict import DemandVerdict, worst_of
from clearway.base.version import SCHEMA_VERSION
from clearway.cli.output import READER_GONE, take_over_output

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

NOT_REACHED = 1
BAD_INPUT = 2
BROKEN = 70
NOT_SHOWN = 3
"""Neither shown nor missed, or something that was asked for was skipped."""
INTERRUPTED = 130
LONGEST_NAME = 250
"""Of a file, in a message."""
REFUSED = (errno.EACCES, errno.EPERM, errno.ENAMETOOLONG, errno.ELOOP, errno.EIO, errno.ESTALE)
"""What the system may answer who only asks whether a file is there."""
WRITTEN = ("out", "video", "html", "layout", "docs", "download", "fetch", "folder")
"""Options of files and folders that commands leave."""
COMMANDS = {"show_map": "map", "mavlink": "fly", "compare": "fly", "alerts": "traffic"}
"""By the name of their function: what their files are taken by too."""


def run_guarded(command: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """The command with errors that a user can meet told in a message, exit status 2.

    Ctrl-C ends with 130, and a reader of messages that has gone away with the usual 141.
    """

    @functools.wraps(command)
    def guard_command(*args: Parameters.args, **options: Parameters.kwargs) -> Result:
        given = [*args, *options.values()]
        try:
            for name in _names(given):
                _check_name(name)
            # What is written is looked at by who writes it.
            read = [value for option, value in options.items() if option not in WRITTEN]
            for name in _names([*args, *read]):
                if isinstance(name, Path):
                    refuse_special(name)
            return command(*args, **options)
        except ClearwayError as error:
            told = [
                _write_message(one)
                if isinstance(one, MissingExtraError)
                else _with_file(_write_message(one), given)
                for one in (error.errors if isinstance(error, SeveralErrors) else (error,))
            ]
            hints = tuple(_other_kinds(told, options, command.__name__))
            for message in (*_with_room(told, hints), *hints):
                say(message)
            leave(BAD_INPUT)
        except (MemoryError, RecursionError) as error:
            what = "memory" if isinstance(error, MemoryError) else "depth"
            files = ", ".join(str(name) for name in _names(given) if os.path.isfile(name))
            files = files or "what was asked for"
            say(some_lines(f"{files}: takes more {what} than there is", LONGEST_MESSAGE))
            leave(BAD_INPUT)
        except KeyboardInterrupt:
            _leave_interrupted()
        except BrokenPipeError:
            # Python would else complain once more when it flushes on its way out.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            leave(READER_GONE)
        except OSError as error:  # Asking whether a file is there may be refused already.
            if error.errno not in REFUSED:
                raise
            what = "what was asked for" if error.filename is None else str(error.filename)
            say(
                some_lines(
                    f"{shorten(what, LONGEST_NAME)}: cannot be read: {error.strerror}",
                    LONGEST_MESSAGE,
                )
            )
            leave(BAD_INPUT)

    return guard_command


def run_program(app: Callable[[], object]) -> None:
    """The whole program: what nobody foresaw is reported in a line too, exit status 70.

    CLEARWAY_TRACEBACK=1 shows where it came from, and `python -W` the warnings of libraries.
    """
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    output = take_over_output()
    # Pictures go to files, whatever a notebook or a desktop asks for in the environment.
    os.environ["MPLBACKEND"] = "agg"
    # What matplotlib logs of axes and fonts is no news to who asked for a picture.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        app()
    except SystemExit as end:
        if output is not None and output.refused:
            say(f"standard output cannot be written: {output.refused}")
            leave(BAD_INPUT)
        if output is not None and output.reader_gone and not end.code:
            leave(READER_GONE)
        raise
    except KeyboardInterrupt:
        _leave_interrupted()
    except Exception as error:
        if os.environ.get("CLEARWAY_TRACEBACK"):
            raise
        given = " ".join(sys.argv[1:])
        say(
            some_lines(
                f"{given}: an error inside clearway ({type(error).__name__}: {error}); please "
                "report it with what CLEARWAY_TRACEBACK=1 shows",
                LONGEST_MESSAGE,
            )
        )
        leave(BROKEN)


def _names(given: Iterable[object]) -> Iterator[str | Path]:
    """The paths and names among the arguments of a command."""
    for value in given:
        if isinstance(value, (str, Path)):
            yield value
        elif isinstance(value, (list, tuple)):
            yield from _names(value)


def _write_message(error: ClearwayError) -> str:
    """The message, with all problems of a file that has several."""
    if isinstance(error, InputError):
        return in_full(make_printable(error.source, ""), error.problems)
    return str(error)


def _with_file(message: str, given: Iterable[object]) -> str:
    """The message, after the first file that was given where it names none of them."""
    names = [str(name) for name in _names(given)]
    files = [name for name in names if os.path.isfile(name)]
    if not files or message.startswith("-") or any(_is_named(one, message) for one in files):
        return message
    if any(message.startswith(f"{name}: ") for name in names):  # of one that is not there
        return message
    return f"{make_printable(files[0], '')}: {message}"


def _is_named(file: str, message: str) -> bool:
    """Whether a message names a file, or one beside it that is called the same but for the end.

    The name of a mission, which is mostly that of its file, names none.
    """
    path = Path(file)
    return path.name in message or f"{path.stem}." in message


def _other_kinds(told: list[str], options: Mapping[str, object], command: str) -> Iterator[str]:
    """What files look like that a command could not read, where another one takes them."""
    from clearway.io.what_file import LOOKS_LIKE, what_file

    commands = {command, COMMANDS.get(command, command)}
    read = [key for key in options if key != "out"]
    for option, name in ((key, str(name)) for key in read for name in _names([options[key]])):
        places = {make_printable(name, ""), make_printable(os.path.abspath(name), "")}
        begins = tuple(f"{place}{end}" for place in places for end in ": ")
        about = [message for message in told if message.startswith(begins)]
        if not about or any(f"; {LOOKS_LIKE} " in message for message in about):
            continue
        hint = what_file(name, likely=True).removeprefix("; ")
        taken = [f"`clearway {one}{end}`" for one in commands for end in ("", f" --{option}")]
        if hint and not any(one in hint for one in taken):
            yield f"{make_printable(name, '')}: {hint}"


def _with_room(told: list[str], hints: tuple[str, ...]) -> Iterator[str]:
    """Messages that are not too long together with the hints about the same files."""
    for message in told:
        source = message.split(": ", 1)[0]
        beside = sum(len(hint) + 1 for hint in hints if source.startswith(hint.split(": ", 1)[0]))
        several = message.startswith(f"{source}: ") and f"\n{source}: " in message
        yield (
            message
            if several
            else some_lines(message, max(LONGEST_MESSAGE // 2, LONGEST_MESSAGE - beside))
        )


def _check_name(name: str | Path) -> None:
    """Refuse names that cannot be written into the results."""
    try:
        str(name).encode()
    except UnicodeEncodeError:
        raise InputError(str(name), "this name is not UTF-8: rename the file") from None


def folder_of_file(name_or_path: str) -> Path | None:
    """Where modules of the user may lie beside the current folder: with a file that was given."""
    path = Path(name_or_path)
    return path.parent if path.is_file() else None


def _leave_interrupted() -> NoReturn:
    """End as Ctrl-C asks for, though it is pressed again."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    say("interrupted")
    leave(INTERRUPTED)


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
    if sys.stderr is not None:  # Without a file to print to, print takes standard output.
        with suppress(OSError):  # What cannot be said is no reason to end otherwise.
            print(make_printable(message), file=sys.stderr, flush=True)


def print_words(words: str) -> None:
    """A result in words, without the control characters that names in files may have."""
    print(make_printable(words))


def add_sources(result: dict[str, Any], inputs: Iterable[str | Path] = ()) -> dict[str, Any]:
    """The result with the version of its form and where it comes from; inputs: files behind it."""
    from clearway.base.provenance import provenance

    stated = result if "provenance" in result else {**result, "provenance": provenance(inputs)}
    return {"schema_version": SCHEMA_VERSION, **stated}


def print_json(result: dict[str, Any]) -> None:
    """One JSON object on standard output, with where it comes from."""
    print(json.dumps(add_sources(result), allow_nan=False).replace("\x7f", "\\u007f"))
    sys.stdout.flush()
