"""`clearway reproduce`: figures and tables of the paper, made again and compared."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.report import add_sources, print_json, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.reproduction.report import Made
    from clearway.view.plot.style import Pictures

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
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Compute figures and tables of the paper anew: numbers, differences and pictures."""
    if list_them:
        _list(as_json)
        return
    from clearway.io.results_folder import ResultsFolder, refuse_unwritable_file
    from clearway.studies.reproduction.registry import targets_named
    from clearway.studies.reproduction.report import as_text, summarize_reproduction

    pictures = drawn.pictures_of(form, dpi)
    folder = ResultsFolder.check(out, "reproduce", "", adds=True)
    if docs is not None:
        refuse_unwritable_file(docs, "--docs")
    made = {}
    for target in targets_named(targets or []):
        say(f"{target.name}: {target.title}")
        made[target] = target.make()
    result = add_sources(summarize_reproduction(made))
    if as_json:
        print_json(result)
    else:
        print(as_text(made))
    if docs is not None:
        _write_page(made, f"clearway reproduce {' '.join(targets or [])}", docs)
    written = _write(made, result, folder, pictures if plots else None)
    say(f"wrote {', '.join(written)} to {out}")


def _list(as_json: bool) -> None:
    from clearway.studies.reproduction.registry import TARGETS

    if as_json:
        known = [{"name": target.name, "title": target.title} for target in TARGETS.values()]
        print_json({"targets": known})
        return
    for target in TARGETS.values():
        print(f"{target.name:<22}{target.title}")


def _write(
    made: Made, result: dict[str, Any], folder: ResultsFolder, pictures: Pictures | None
) -> list[str]:
    """Result and pictures; all of it or nothing."""
    from clearway.view.plot.style import house_style

    with folder.write() as scratch:
        (scratch / "result.json").write_text(json.dumps(result, allow_nan=False) + "\n")
        for exhibits in made.values():
            for exhibit in exhibits:
                if pictures is None or exhibit.draw is None or exhibit.picture is None:
                    continue
                with house_style():
                    pictures.save(exhibit.draw(), scratch, Path(exhibit.picture).stem)
        return sorted(path.name for path in scratch.iterdir())


def _write_page(made: Made, command: str, page: Path) -> None:
    from clearway.io.staging import stage_file
    from clearway.studies.reproduction.report import as_page

    with stage_file(page) as scratch:
        scratch.write_text(as_page(made, command))
