"""One damaged file through its command, in this process: what it prints, warns, raises, takes."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from tools.fuzz.hostile import is_intact
from tools.fuzz.judge import Outcome, faults
from tools.fuzz.seeds import FORMATS, Format

INTERRUPTED_S = 1.0
"""A flight that a damaged mission still starts is interrupted after this time, as by Ctrl-C."""


class Case:
    """A damaged file: a function of its format, the seed and its number alone."""

    def __init__(self, name: str, seed: int, number: int, seeds: list[bytes]) -> None:
        self.name, self.seed, self.number = name, seed, number
        random = Random(f"{name}:{seed}:{number}")
        whole = random.choice(seeds)
        others = tuple(one for one in seeds if one is not whole)
        self.data = FORMATS[name].damage(whole, random, others or (whole,))

    @property
    def format(self) -> Format:
        return FORMATS[self.name]


@cache
def whole_files(name: str) -> list[bytes]:
    """Of a format; none where they are real ones that are not at hand."""
    with tempfile.TemporaryDirectory() as folder:
        return FORMATS[name].make(Path(folder))


@cache
def beside(name: str) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        return FORMATS[name].beside(Path(folder))


@cache
def _command() -> Any:
    from typer.main import get_command

    from clearway.cli.app import app

    return get_command(app)


def placed(form: Format, name: str, data: bytes, folder: Path) -> tuple[list[str], tuple[str, ...]]:
    """The file and those beside it in a folder; the command line, and the names of the files."""
    path = folder / f"damaged-file{form.suffix}"
    if form.plant is not None:
        form.plant(folder, data)
        return list(form.command), (path.stem, "out")
    path.write_bytes(data)
    for suffix, content in beside(name).items():
        (folder / (f"{path.stem}{suffix}" if suffix.startswith(".") else suffix)).write_bytes(
            content
        )
    words = [word.format(path, stem=str(path.with_suffix(""))) for word in form.command]
    return words, (path.stem,)


def tried(name: str, data: bytes) -> tuple[Outcome, list[str]]:
    """What a command makes of the data of a format, and what is wrong with that."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        words, names = placed(FORMATS[name], name, data, folder)
        outcome = called(words, folder)
        found = faults(outcome, names)
        if FORMATS[name].plant is not None and not is_intact(folder):
            found.append("changed what lies outside of its folder")
    return outcome, found


def called(words: list[str], folder: Path) -> Outcome:
    """A command in this process, with all that it prints, from libraries too."""
    raised, status = "", 0
    with (
        contextlib.chdir(folder),
        warnings.catch_warnings(record=True) as warned,
        _captured() as printed,
        _flights_interrupted(),
    ):
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", ResourceWarning)
        try:
            _command()(words, prog_name="clearway")
        except SystemExit as end:
            status = int(end.code or 0)
        except BaseException as error:
            where = traceback.extract_tb(error.__traceback__)
            own = [one for one in where if "clearway" in one.filename] or list(where)
            place = f"{Path(own[-1].filename).name}:{own[-1].lineno}" if own else ""
            raised = f"{type(error).__name__} at {place}: {str(error)[:200]}"
    told = tuple(
        f"{one.category.__name__} at {Path(one.filename).name}:{one.lineno}: {one.message}"
        for one in warned
    )
    return Outcome(status, printed["output"], printed["errors"], told, raised)


@contextlib.contextmanager
def _captured() -> Iterator[dict[str, str]]:
    """Both streams below Python, so that what libraries print is seen too."""
    printed: dict[str, str] = {}
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        sys.stdout.flush()
        sys.stderr.flush()
        kept = (os.dup(1), os.dup(2), sys.stdout, sys.stderr)
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(  # noqa: SIM115
            2, "w", encoding="utf-8", errors="backslashreplace", closefd=False
        )
        try:
            yield printed
        finally:
            with contextlib.suppress(ValueError):
                sys.stdout.flush()
                sys.stderr.flush()
            os.dup2(kept[0], 1)
            os.dup2(kept[1], 2)
            os.close(kept[0])
            os.close(kept[1])
            sys.stdout, sys.stderr = kept[2], kept[3]
            for name, file in (("output", out), ("errors", err)):
                file.seek(0)
                printed[name] = file.read().decode("utf-8", "replace")


@contextlib.contextmanager
def _flights_interrupted() -> Iterator[None]:
    """Flights start, but end soon; those of campaigns and studies do not start."""
    import clearway.cli.fly as fly
    import clearway.cli.risk as risk
    import clearway.studies.campaigns.engines as engines

    flown, studied, processes = fly.fly_with_bar, risk._fly_with_bar, engines.make_process_engine

    def interrupted(*given: Any) -> Any:
        signal.setitimer(signal.ITIMER_REAL, INTERRUPTED_S)
        return flown(*given)

    def ended(*_: Any) -> Any:
        raise SystemExit(0)

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    # What is raised in a callback of the garbage collector, as hypothesis has one, goes nowhere.
    callbacks, gc.callbacks[:] = gc.callbacks[:], []
    before = signal.signal(signal.SIGALRM, interrupt)
    fly.fly_with_bar = interrupted  # type: ignore[assignment]
    risk._fly_with_bar = ended  # type: ignore[assignment]
    engines.make_process_engine = lambda _: ended  # type: ignore[assignment]
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        gc.callbacks[:] = callbacks
        fly.fly_with_bar, risk._fly_with_bar, engines.make_process_engine = (
            flown,
            studied,
            processes,
        )
