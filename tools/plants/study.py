"""Flights through random worlds, one line of a journal each: who is killed goes on there."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from clearway.missions.setup import FlightSetup, prepare
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld, World
from clearway.sim import Run
from tools.plants.search import way_left
from tools.plants.worlds import FAMILIES, SCALES, Scale, fault_s, mission, wall_ahead

STRAYED = "state: outside the tube of its plan"


@dataclass(frozen=True)
class Flown:
    """What came of one flight."""

    plant: str
    family: str
    seed: int
    reached: bool
    hit: bool
    """The body touched something."""
    lost: bool
    """Nearer than the margin, somewhere."""
    nearest_m: float
    time_s: float
    cpu_s: float
    decisions: int
    without: int
    """Of these, after the first way out, so many had none."""
    looks: int
    strayed: int
    """Own states outside the tube."""
    escape: str
    ended: str
    """In which mode, and why, where it did not arrive."""
    way_left: bool | None = None
    """Where it hit something after a wall appeared: whether a search finds a way clear of it."""

    def __str__(self) -> str:
        came = "arrived" if self.reached else self.ended
        touched = ", touched something" if self.hit else ""
        return (
            f"{self.plant} {self.family} {self.seed}: {came}{touched}, {self.nearest_m:g} m near, "
            f"{self.time_s:g} s flown in {self.cpu_s:g} s"
        )


def fly(scale: Scale, family: str, seed: int) -> Flown:
    """One flight."""
    kind = FAMILIES[family]
    setup = prepare(mission(scale, kind, seed))
    began = time.process_time()
    run = _with_wall(scale, setup, seed) if kind.fault == "wall" else setup.fly()
    cpu_s = time.process_time() - began
    nearest_m = float(run.nearest_surface_m.min())
    hit = nearest_m <= scale.body_m
    last, summary = run.decisions[-1].flight.mode_state, run.summary()
    ended = (
        f"{last.mode}: {last.why}" if summary["reason"] is None else f"held: {summary['reason']}"
    )
    return Flown(
        scale.plant,
        family,
        seed,
        run.reached,
        hit,
        run.metrics.margin_violations > 0,
        round(nearest_m, 3),
        round(run.metrics.time_s, 2),
        round(cpu_s, 1),
        len(run.decisions),
        summary["decisions_without_escape"] or 0,
        len(run.movements),
        run.counts.get(STRAYED, 0),
        "" if run.ways_out is None else run.ways_out.flown,
        "" if run.reached else ended,
        _way_left(scale, setup, run, seed) if hit and kind.fault == "wall" else None,
    )


def _way_left(scale: Scale, setup: FlightSetup, run: Run, seed: int) -> bool:
    """Whether a way was left when the wall appeared: the search knows all that stands there."""
    entry = next(one for one in run.decisions if one.flight.time_s >= fault_s(scale, seed))
    state = entry.flight.decision.state.vector
    wall = ObstacleMap([wall_ahead(scale, state)])
    world = CombinedWorld([setup.world, wall])
    return way_left(setup.planner.automaton, world, state, scale.body_m)


def _with_wall(scale: Scale, setup: FlightSetup, seed: int) -> Run:
    """A flight in which a wall appears ahead."""
    at_s, worlds = fault_s(scale, seed), list[World]([setup.world])

    def appear(entry: Any, _progress: Any) -> None:
        if len(worlds) == 1 and entry.flight.time_s >= at_s:
            worlds.append(ObstacleMap([wall_ahead(scale, entry.flight.decision.state.vector)]))

    return replace(setup, world=CombinedWorld(worlds)).fly(appear)


def journalled(journal: Path) -> list[Flown]:
    """What was flown up to now; a line that was torn is flown again."""
    found = []
    for line in journal.read_text(encoding="utf-8").splitlines() if journal.exists() else ():
        try:
            found.append(Flown(**json.loads(line)))
        except (ValueError, TypeError):
            continue
    return found


def tasks(
    plants: Sequence[str], families: Sequence[str], worlds: int
) -> Iterator[tuple[Scale, str, int]]:
    """A world of each kind, then the next, so that whatever was flown is spread evenly."""
    scales = [scale for scale in SCALES if scale.plant in plants]
    for seed, scale, family in product(range(worlds), scales, families):
        if seed < _most(family, worlds):
            yield scale, family, seed


def _most(family: str, worlds: int) -> int:
    """Half as many with something that goes wrong."""
    return worlds if FAMILIES[family].fault is None else (worlds + 1) // 2


def fly_all(
    journal: Path, plants: Sequence[str], families: Sequence[str], worlds: int, minutes: float
) -> None:
    """Fly what the journal lacks, for so many minutes at most."""
    until = time.monotonic() + 60.0 * minutes
    done = {(one.plant, one.family, one.seed) for one in journalled(journal)}
    journal.parent.mkdir(parents=True, exist_ok=True)
    for scale, family, seed in tasks(plants, families, worlds):
        if (scale.plant, family, seed) in done:
            continue
        if time.monotonic() > until:
            break
        flown = fly(scale, family, seed)
        with journal.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(flown)) + "\n")
        print(flown, file=sys.stderr, flush=True)
