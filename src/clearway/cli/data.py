"""`clearway data`: public files that the documentation's flights use, and how to get them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.progress import progress_bar
from clearway.cli.report import print_json, print_words, say

if TYPE_CHECKING:
    from clearway.io.public_data import PublicFile


def data(
    fetch: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Fetch what is missing into this folder, each file checked against its sha256. "
            "CLEARWAY_DATA=DIR names their folder; else examples of a checkout look for "
            "`shared/data` beside it.",
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(help="Only files with this in their name; may be repeated."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """List the public files that examples use, with source, licence and hash; fetch them.

    With --fetch, exit status 2 if a file could not be fetched; files before it stay.
    """
    from clearway.io.public_data import is_there

    chosen = _choose_files(only or [])
    if fetch is not None:
        _fetch(chosen, fetch)
    there = {one.name: fetch is not None and is_there(one, fetch) for one in chosen}
    if as_json:
        files: list[dict[str, Any]] = [
            {**one._asdict(), "size": one.size or None}
            | ({} if fetch is None else {"there": there[one.name]})
            for one in chosen
        ]
        print_json({"files": files})
        return
    for one in chosen:
        print_words(
            f"{one.name}\n  {one.about}; for {one.used_by}\n  {one.licence}\n  {one.address}\n"
            f"  sha256 {one.sha256}"
        )


def _choose_files(parts: list[str]) -> list[PublicFile]:
    from clearway.base.errors import InputError
    from clearway.base.suggest import did_you_mean
    from clearway.io import public_data

    files = list(public_data.FILES)
    names = [one.name for one in files]
    for part in parts:
        if not any(part in name for name in names):
            near = did_you_mean(part, [Path(name).name for name in names])
            raise InputError("--only", f"no file {part!r}{near}; there are {', '.join(names)}")
    return [one for one in files if not parts or any(part in one.name for part in parts)]


def _fetch(files: list[PublicFile], folder: Path) -> None:
    """Bring all that is missing; what cannot be brought is reported at the end, each by itself."""
    from clearway.base.errors import ClearwayError, SeveralErrors
    from clearway.io.public_data import fetch_file
    from clearway.io.results_folder import refuse_unwritable

    refuse_unwritable(folder, "--fetch")
    problems: list[ClearwayError] = []
    for one in files:
        try:
            with progress_bar(one.name, one.size or None, beside=("elapsed",)) as bar:
                new = fetch_file(one, folder, bar.advance)
        except ClearwayError as error:
            problems.append(error)
        else:
            say(f"{one.name}: {'fetched' if new else 'is there already'}")
    if problems:
        raise SeveralErrors(problems)
