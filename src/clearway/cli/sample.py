"""`clearway sample`: small inputs of our own making in every format, to try all commands on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli.report import print_json, print_words, say


def sample(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="Folder to write into; what is not as it was written there stays."
        ),
    ],
    seed: Annotated[int, typer.Option(min=0, help="The same seed writes the same files.")] = 0,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Write a small file of every format that clearway reads, with a command for each."""
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.samples import write_samples

    place = ResultsFolder.check(folder, "sample", "", careful=True, option="DIR")
    written = write_samples(place, seed)
    if as_json:
        print_json(
            {
                "folder": str(folder),
                "seed": seed,
                "samples": [
                    {
                        "file": one.name,
                        "kind": one.kind,
                        "about": one.about,
                        "command": one.command or None,
                        "needs": one.needs or None,
                    }
                    for one in written.samples
                ],
                "left_out": {one.name: f"needs clearway[{one.needs}]" for one in written.left_out},
            }
        )
    else:
        width = max(len(one.name) for one in written.samples)
        print_words(
            "\n".join(
                f"{one.name:<{width}}  {one.command or f'({one.about})'}" for one in written.samples
            )
        )
    for one in written.left_out:
        say(f"{one.name} left out: pip install 'clearway[{one.needs}]'")
    say(
        f"wrote {len(written.samples)} samples, README.md and commands.txt to {folder}; "
        "go there to try them"
    )
