"""`clearway warm-up`: whatever the first runs would compile, compiled now, on all cores."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from clearway.cli.numbers import MOST_WORKERS
from clearway.cli.progress import progress_bar
from clearway.cli.report import print_json, say, show


def warm_up(
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, max=MOST_WORKERS, help="Processes side by side; default: one per core."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Compile all there is for this machine, once, so that later runs start at once."""
    import os
    import time

    from clearway.base.kernels.folders import written_folder
    from clearway.studies import warm_up as work

    began = time.perf_counter()
    folder, names = written_folder(), tuple(work.pieces())
    if folder is None:
        say("compiled code cannot be kept anywhere; CLEARWAY_CACHE names a folder for it")
    done = []
    with progress_bar("compiling", len(names), beside=("count", "status", "elapsed")) as bar:
        for piece in work.warm_up(workers or os.cpu_count() or 1):
            done.append(piece)
            bar.show(len(done), status=f"{sum(one.compiled for one in done)} loops compiled")
    result: dict[str, Any] = {
        "pieces": len(done),
        "compiled": sum(one.compiled for one in done),
        "loaded": sum(one.loaded for one in done),
        "seconds": round(time.perf_counter() - began, 2),
        "kept_in": None if folder is None else str(folder),
    }
    if as_json:
        print_json(result)
    else:
        show("\n".join(f"{name:<10} {value}" for name, value in result.items()))
