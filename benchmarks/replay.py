"""A long run as a file and as a page: how large, how quickly made, how quickly drawn."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from tools.browser import Browser, chromium

from benchmarks.table import Benchmark, Row, Target
from benchmarks.timing import Times, in_words, timed
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, prepare
from clearway.sim import Run
from clearway.view.replay.page import page_of
from clearway.view.replay.reading import read_run
from clearway.view.replay.writing import write_mcap

ROWS, LENGTH_M, APART_M = 13, 45.0, 6.0
PAGE_MB = 10.0
MOMENTS = 40


def ten_minutes() -> MissionFile:
    """Up and down along rows of balls at 1 m/s, for more than ten minutes."""
    waypoints, balls = [], []
    for row in range(ROWS):
        ends = (0.0, LENGTH_M) if row % 2 == 0 else (LENGTH_M, 0.0)
        waypoints += [[along, APART_M * row, 0.0] for along in ends]
        balls += [[along, APART_M * row + 0.4, 0.0] for along in (12.0, 24.0, 36.0)]
    tables = {
        "mission": {"name": "ten-minutes", "waypoints_m": waypoints[1:]},
        "lidar": [{"beams_per_cell": [20, 10], "sigma_m": 0.03}],
        "obstacle": [{"shape": "ball", "position_m": place, "radius_m": 1.2} for place in balls],
    }
    return parse_model("benchmark", tables, MissionFile)


@cache
def flown() -> tuple[FlightSetup, Run]:
    setup = prepare(ten_minutes())
    return setup, setup.fly()


def written(folder: str) -> Path:
    path = Path(folder) / "run.mcap"
    path.unlink(missing_ok=True)
    setup, run = flown()
    write_mcap(run, setup, "", path)
    return path


def run_written(quick: bool) -> Row:
    with TemporaryDirectory() as folder:
        times = timed(lambda: written(folder), quick, seconds=8.0, warm_up=1)
        size = (Path(folder) / "run.mcap").stat().st_size / 1e6
    _, run = flown()
    minutes = run.metrics.time_s / 60.0
    what = f"a run of {minutes:.1f} minutes, {len(run.decisions)} decisions, written as MCAP"
    return Row(what, in_words(times.median_s), f"{times.spread}; {size:.2f} MB")


def page_made(quick: bool) -> Row:
    with TemporaryDirectory() as folder:
        path = written(folder)
        times = timed(lambda: page_of(read_run(path)), quick, seconds=8.0, warm_up=1)
        size = len(page_of(read_run(path)).encode()) / 1e6
    return Row(
        f"its page for the browser, made from that file: {size:.2f} MB",
        in_words(times.median_s),
        times.spread,
        Target(f"<= {PAGE_MB:.0f} MB", size <= PAGE_MB),
    )


def frames_drawn(quick: bool) -> Row:
    """Moments all over the run: the work of the page's script, without that of the graphics."""
    what = "a frame of that page: its script in headless Chromium"
    if chromium() is None:
        return Row(what, "no Chromium here")
    moments = MOMENTS // 4 if quick else MOMENTS
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        (Path(folder) / "page.html").write_text(page_of(read_run(written(folder))))
        with Browser(Path(folder) / "profile") as browser:
            browser.open((Path(folder) / "page.html").as_uri())
            times_ms = browser.evaluate(
                f"Array.from({{ length: {moments} }}, (_, n) => {{"
                f"  player.time = player.run.start + n / {moments} * player.run.end;"
                "   const before = performance.now();"
                "   player.draw();"
                "   return performance.now() - before; })"
            )
    times = Times(np.array(times_ms) / 1e3)
    return Row(what, in_words(times.median_s), times.spread)


BENCHMARKS = (
    Benchmark("replay, written", run_written),
    Benchmark("replay, page", page_made, headline=True),
    Benchmark("replay, frame", frames_drawn),
)
