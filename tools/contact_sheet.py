"""Every picture of every command on one page: `make pictures`, or `python -m tools.contact_sheet`.

Commands run one after the other on built-in missions and on the files of `clearway sample`, so that
it needs neither a network nor anybody's data. The sheet is one HTML file beside the pictures.
"""

from __future__ import annotations

import html
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer

REPOSITORY = Path(__file__).resolve().parent.parent
SHEET = "index.html"
SHOWN = (".png", ".svg", ".gif")
MISSIONS = REPOSITORY / "examples" / "missions"


@dataclass(frozen=True)
class Drawing:
    """A folder of the sheet and the command that fills it.

    command: SAMPLES/ stands for the folder of `clearway sample`, OUT/ for the drawing's own folder,
    SHEET/ for that of all drawings; without an OUT/, --out with the drawing's own is added.
    """

    folder: str
    command: str


DRAWINGS = (
    Drawing("fly-copter", "fly copter-columns --no-mcap"),
    Drawing("fly-static", "fly static-obstacles --no-mcap"),
    Drawing("fly-intruders", "fly intruders-collision --no-mcap"),
    Drawing("fly-mixed", "fly mixed --no-mcap"),
    Drawing("fly-rules", f"fly {MISSIONS / 'rules.toml'} --no-mcap"),
    Drawing("fly-map", "fly SAMPLES/map-mission.toml --no-mcap"),
    Drawing("fly-survey", "fly SAMPLES/survey-mission.toml --no-mcap"),
    Drawing("film", "fly mixed --no-plots --no-mcap --out OUT/run --video OUT/flight.gif"),
    Drawing("compare", "compare mixed --planners clearway,straight,vfh,velocity-obstacle,mvp"),
    Drawing("assess-scene", f"assess {REPOSITORY / 'examples' / 'scenes' / 'street.toml'}"),
    Drawing("assess-scan", "assess --scan SAMPLES/sweep.pcd --range 20"),
    Drawing("assess-recording", "assess --scan SAMPLES/velodyne --poses SAMPLES/way.csv --all"),
    Drawing("map", "map SAMPLES/terrain.tif SAMPLES/masts.csv"),
    Drawing("map-zones", "map SAMPLES/zones-ed269.json --at 2026-07-01T12:00Z"),
    Drawing("map-city", "map SAMPLES/city.json"),
    Drawing("traffic", "traffic SAMPLES/trajectories.json"),
    Drawing("alerts", "alerts SAMPLES/encounter.daa --volumes SAMPLES/volumes.toml"),
    Drawing("reach-set", "reach-set"),
    Drawing("reach-set-full", "reach-set --method harmonic"),
    Drawing("reach-compare", "reach-set compare"),
    Drawing("pursuit", "pursuit"),
    Drawing("faults", "faults blind-sector --flights 4"),
    Drawing("risk-encounter", "risk SAMPLES/model.txt --only 15 --planners clearway,mvp"),
    Drawing("risk-study", "risk SAMPLES/model.txt --vehicle copter --count 40"),
    Drawing("risk-curves", "risk --curves SHEET/risk-study/risk.json"),
    Drawing("campaign-flight", "campaign quick --replay forest/clearway/0"),
    Drawing("reproduce", "reproduce all"),
)
"""What draws, quick ones of every kind."""


def run(drawing: Drawing, folder: Path, samples: Path) -> str:
    """Run a command; what came of it in a few words."""
    out = folder / drawing.folder
    text = drawing.command.replace("SAMPLES/", f"{samples}/").replace("OUT/", f"{out}/")
    text = text.replace("SHEET/", f"{folder}/")
    if "OUT/" not in drawing.command:
        text += f" --out {out}"
    shutil.rmtree(out, ignore_errors=True)  # of an earlier sheet, maybe of another mission
    out.mkdir(parents=True)
    started = monotonic()
    done = subprocess.run(
        [sys.executable, "-m", "clearway", *text.split()],
        capture_output=True,
        text=True,
        check=False,
    )
    (out / "said.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
    ending = (
        "" if done.returncode in (0, 1, 3) else f": {(done.stderr or done.stdout)[-300:].strip()}"
    )
    return f"exit {done.returncode}, {monotonic() - started:.0f} s{ending}"


def pictures_in(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix in SHOWN)


def sheet(folder: Path, drawings: tuple[Drawing, ...]) -> str:
    """The page; pictures are named by their place beside it."""
    return "\n".join(_parts(folder, drawings)) + "\n"


def _parts(folder: Path, drawings: tuple[Drawing, ...]) -> Iterator[str]:
    yield '<!DOCTYPE html>\n<html lang="en"><meta charset="utf-8"><title>clearway: pictures</title>'
    yield (
        "<style>body{font:14px system-ui,sans-serif;margin:1.5rem}figure{display:inline-block;"
        "margin:.5rem;vertical-align:top;width:31rem}img{width:100%;border:1px solid #ccc}"
        "figcaption{color:#555}</style>"
    )
    for drawing in drawings:
        yield f"<h2>{html.escape(drawing.folder)}</h2><p><code>clearway {_command(drawing)}</code>"
        found = pictures_in(folder / drawing.folder)
        if not found:
            yield "<p>No picture."
        for path in found:
            place = html.escape(path.relative_to(folder).as_posix())
            yield (
                f'<figure><a href="{place}"><img src="{place}" alt="{place}" loading="lazy"></a>'
                f"<figcaption>{place}</figcaption></figure>"
            )
    yield "</html>"


def _command(drawing: Drawing) -> str:
    short = drawing.command.replace(f"{REPOSITORY}/", "").replace("SAMPLES/", "samples/")
    return html.escape(short.replace("OUT/", "").replace("SHEET/", ""))


def main(
    folder: Annotated[Path, typer.Argument(help="Folder of pictures and sheet.")] = Path(
        "clearway-out/pictures"
    ),
    only: Annotated[list[str] | None, typer.Option(help="Parts by name; repeatable.")] = None,
) -> None:
    """Draw every picture of every command anew, and the sheet of all."""
    samples = folder.absolute() / "samples"
    if not samples.is_dir():
        subprocess.run([sys.executable, "-m", "clearway", "sample", str(samples)], check=True)
    for drawing in DRAWINGS:
        if only and drawing.folder not in only:
            continue
        typer.echo(f"{drawing.folder}: {run(drawing, folder.absolute(), samples)}")
    (folder / SHEET).write_text(sheet(folder, DRAWINGS), encoding="utf-8")
    typer.echo(f"{folder / SHEET}: {len(pictures_in(folder))} pictures")


if __name__ == "__main__":
    typer.run(main)
