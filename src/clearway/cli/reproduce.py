"""`clearway reproduce`: figures and tables of the paper, made again and compared."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.report import print_json, say, sourced

if TYPE_CHECKING:
    from clearway.studies.reproduction.report import Made

OUTPUT = "Output"


def reproduce(
    targets: Annotated[
        list[str] | None,
        typer.Argument(help="Names of targets, such as figures-6.2-6.13, or all."),
    ] = None,
    list_them: Annotated[bool, typer.Option("--list", help="List the targets.")] = False,
    out: Annotated[
        Path,
        typer.Option(help="Folder of pictures and result.json.", rich_help_panel=OUTPUT),
    ] = Path("clearway-out/reproduce"),
    docs: Annotated[
        Path | None,
        typer.Option(help="Write the comparison as a Markdown page.", rich_help_panel=OUTPUT),
    ] = None,
    plots: Annotated[
        bool, typer.Option("--plots/--no-plots", help="Draw pictures.", rich_help_panel=OUTPUT)
    ] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Make figures and tables of the paper again: numbers, differences and pictures."""
    if list_them:
        _list(as_json)
        return
    from clearway.studies.reproduction.registry import targets_named
    from clearway.studies.reproduction.report import as_text, as_values

    made = {}
    for target in targets_named(targets or []):
        say(f"{target.name}: {target.title}")
        made[target] = target.make()
    if docs is not None:
        _write_page(made, f"clearway reproduce {' '.join(targets or [])}", docs)
    result = sourced(as_values(made))
    written = _write(made, result, out, plots)
    if as_json:
        print_json(result)
    else:
        print(as_text(made))
    say(f"wrote {', '.join(written)} to {out}")


def _list(as_json: bool) -> None:
    from clearway.studies.reproduction.registry import TARGETS

    if as_json:
        known = [{"name": target.name, "title": target.title} for target in TARGETS.values()]
        print_json({"targets": known})
        return
    for target in TARGETS.values():
        print(f"{target.name:<22}{target.title}")


def _write(made: Made, result: dict[str, Any], folder: Path, plots: bool) -> list[str]:
    """Result and pictures; all of it or nothing."""
    from clearway.io.staging import staged

    with staged(folder) as scratch:
        (scratch / "result.json").write_text(json.dumps(result, allow_nan=False) + "\n")
        for exhibits in made.values():
            for exhibit in exhibits:
                if plots and exhibit.draw is not None and exhibit.picture is not None:
                    exhibit.draw().savefig(scratch / exhibit.picture, dpi=110)
        return sorted(path.name for path in scratch.iterdir())


def _write_page(made: Made, command: str, page: Path) -> None:
    from clearway.io.staging import staged
    from clearway.studies.reproduction.report import as_page

    with staged(page.parent) as scratch:
        (scratch / page.name).write_text(as_page(made, command))
