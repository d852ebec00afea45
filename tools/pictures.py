"""Pictures and the film of the documentation, by clearway itself: `python -m tools.pictures`."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from clearway.studies.figures.faults import Curve, Panel, draw_faults
from clearway.view.plot.style import house_style
from tools.browser import Browser
from tools.pipeline_picture import draw_pipeline

REPOSITORY = Path(__file__).resolve().parent.parent
IMAGES = REPOSITORY / "docs" / "images"
FAULTS = REPOSITORY / "docs" / "results" / "faults.md"
TOLD = ("strict", "off")
"""Settings of `escape` that have tables on that page."""
STREET = REPOSITORY / "examples" / "scenes" / "street.toml"
RULES = REPOSITORY / "examples" / "missions" / "rules.toml"
PICTURES = {
    "copter.png": (("fly", "copter-columns"), "flight.png"),
    "copter-decision.png": (("fly", "copter-columns"), "snapshot-2.png"),
    "snapshot.png": (("fly", "static-obstacles"), "snapshot-2.png"),
    "assessment.png": (("assess", str(STREET)), "reachability.png"),
    "collision-distance.png": (("fly", "intruders-collision"), "collision-distance.png"),
    "win-map.png": (("pursuit",), "win-map.png"),
    "rules.png": (("fly", str(RULES)), "traffic.png"),
}
"""Name in the documentation: the command that draws it, and what it calls it."""
FILM = ("fly", "copter-columns", "--no-plots", "--fps", "5", "--speed", "2", "--video")
"""The command that makes the film of README, before the name of its file."""
FILM_SIZE, FILM_COLOURS = (600, 338), 32
COLOURS = 192
REPLAYS = (
    ("replay.png", "mixed", "t=18"),
    ("replay-copter.png", "copter-columns", "t=10.1&plots=0"),
)
"""Name, mission and moment of pictures of the replay page."""
WINDOW = (1240, 780)


def draw(command: tuple[str, ...], drawn: str, target: Path) -> None:
    """Run a command and keep one of its pictures, with few colours for its size."""
    code = "from clearway.cli.app import main; main()"
    with TemporaryDirectory() as folder:
        arguments = [sys.executable, "-c", code, *command, "--out", folder]
        subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
        keep(Path(folder) / drawn, target)


def keep(drawn: Path, target: Path) -> None:
    with Image.open(drawn) as picture:
        few = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE, kmeans=4)
        few.save(target, optimize=True)


def keep_film(drawn: Path, target: Path) -> None:
    """Keep every second frame of a film, smaller and with few colours."""
    frames = []
    with Image.open(drawn) as film:
        for number in range(0, getattr(film, "n_frames", 1), 2):
            film.seek(number)
            frames.append(film.convert("RGB").resize(FILM_SIZE, Image.Resampling.LANCZOS))
    middle, bright = frames[len(frames) // 2], Image.Quantize.FASTOCTREE
    palette = middle.quantize(FILM_COLOURS, method=bright, dither=Image.Dither.NONE)
    few = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in frames]
    durations_ms = [400] * (len(few) - 1) + [1500]
    few[0].save(target, save_all=True, append_images=few[1:], duration=durations_ms, loop=0)


def show_page(mission: str, moment: str, target: Path) -> None:
    """Fly a mission and look at its page in a browser."""
    code = "from clearway.cli.app import main; main()"
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page, picture = Path(folder) / "page.html", Path(folder) / "page.png"
        for command in (
            ("fly", mission, "--no-plots", "--out", folder),
            ("replay", folder, "--html", str(page)),
        ):
            arguments = [sys.executable, "-c", code, *command]
            subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
        with Browser(Path(folder) / "profile", WINDOW) as browser:
            browser.open(f"{page.as_uri()}#{moment}")
            browser.screenshot(picture)
        keep(picture, target)


def faults_of(page: str, escape: str) -> tuple[list[Panel], str]:
    """What a table of the page of faults says, as panels, and the title of their picture."""
    told = page.partition(f"<!-- faults-{escape}:begin -->")[2].partition("<!-- faults")[0]
    flown = int(re.findall(r"Of (\d+) flights at each level", told)[0])
    row = re.compile(r"^\| ([^|]+) \| ([^|]+) \| ([^|]+) \| (-?[\d.]+: [^|]+) \|$", re.MULTILINE)
    level = re.compile(r"(-?[\d.]+): (\d+)(?:, (\d+) crashed)?(?:, (\d+) lost the margin)?")
    panels: dict[str, Panel] = {}
    for title, unit, label, cells in row.findall(told):
        found = level.findall(cells)
        kept, crashed, lost = ([int(each[n] or 0) for each in found] for n in (1, 2, 3))
        rest = [flown - sum(counts) for counts in zip(kept, crashed, lost, strict=True)]
        before = panels.get(title, Panel(title, unit, [float(each[0]) for each in found], ()))
        curve = Curve(label, kept, rest, lost, crashed)
        panels[title] = before._replace(curves=(*before.curves, curve))
    return list(panels.values()), f'{flown} flights at each level, escape = "{escape}"'


def draw_told_faults(escape: str, target: Path) -> None:
    """The picture of faults, from the table below it: to measure them anew takes an hour."""
    with TemporaryDirectory() as folder, house_style():
        drawn = Path(folder) / "faults.png"
        panels, title = faults_of(FAULTS.read_text(encoding="utf-8"), escape)
        draw_faults(panels, title).savefig(drawn, dpi=100)
        keep(drawn, target)


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    for escape in TOLD:
        draw_told_faults(escape, IMAGES / f"faults-{escape}.png")
    draw_pipeline(IMAGES / "pipeline.svg")
    for name, (command, drawn) in PICTURES.items():
        draw(command, drawn, IMAGES / name)
    with TemporaryDirectory() as folder:
        code = "from clearway.cli.app import main; main()"
        film = Path(folder) / "copter.gif"
        arguments = [sys.executable, "-c", code, *FILM, str(film), "--out", f"{folder}/run"]
        subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
        keep_film(film, IMAGES / film.name)
    for name, mission, moment in REPLAYS:
        show_page(mission, moment, IMAGES / name)
    for path in sorted(IMAGES.glob("*.png")):
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
