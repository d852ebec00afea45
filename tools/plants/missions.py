"""The missions of examples/missions/plants, flown one by one."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from clearway.base.frames import FloatArray
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from tools.plants.study import STRAYED
from tools.plants.worlds import REPOSITORY

PLACES = 300
"""That are kept of a track."""
MISSIONS = REPOSITORY / "examples" / "missions" / "plants"


@dataclass(frozen=True)
class Shown:
    """What came of one mission."""

    name: str
    reached: bool
    nearest_m: float
    margin_m: float
    time_s: float
    cpu_s: float
    decisions: int
    without: int
    looks: int
    strayed: int
    ended: str
    track_m: list[list[float]] = field(default_factory=list)
    """[n, 3] what was flown, thinned out."""
    others_m: list[list[list[float]]] = field(default_factory=list)
    """The same of each intruder."""


def fly(file: Path) -> Shown:
    """One of them."""
    setup = prepare(read_mission(str(file)))
    began = time.process_time()
    run = setup.fly()
    cpu_s = time.process_time() - began
    last = run.decisions[-1].flight.mode_state
    return Shown(
        file.stem,
        run.reached,
        round(float(run.nearest_surface_m.min()), 3),
        run.safety_margin_m,
        round(run.metrics.time_s, 2),
        round(cpu_s, 1),
        len(run.decisions),
        run.summary()["decisions_without_escape"] or 0,
        len(run.movements),
        run.counts.get(STRAYED, 0),
        "" if run.reached else f"{last.mode}: {last.why}",
        _thinned(run.states[:, :3]),
        [_thinned(track[:, 1:]) for track in run.intruder_tracks.values()],
    )


def _thinned(places_m: FloatArray) -> list[list[float]]:
    """Some of them, in decimetres: as many as a picture shows."""
    every = max(1, len(places_m) // PLACES)
    kept: list[list[float]] = places_m[::every].round(1).tolist()
    return kept


def fly_all(journal: Path) -> Sequence[Shown]:
    """All of them, those in the journal not again."""
    found = {}
    for line in journal.read_text(encoding="utf-8").splitlines() if journal.exists() else ():
        one = Shown(**json.loads(line))
        found[one.name] = one
    for file in sorted(MISSIONS.glob("*.toml")):
        if file.stem in found:
            continue
        one = found[file.stem] = fly(file)
        print(f"{one.name}: {one.time_s:g} s in {one.cpu_s:g} s", file=sys.stderr, flush=True)
        journal.parent.mkdir(parents=True, exist_ok=True)
        with journal.open("a", encoding="utf-8") as out:
            out.write(json.dumps(asdict(one)) + "\n")
    return [found[name] for name in sorted(found)]
