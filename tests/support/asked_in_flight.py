"""What a flight asks for of compiled loops after its system was warmed up: nothing, it is held."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from clearway.base.kernels.cache import KernelCache
from clearway.base.state import State
from clearway.io.toml import parse_model
from clearway.live import AvoidanceSystem
from clearway.live.readings import Reading
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import prepare
from clearway.sensors import Scan, simulate_scan


def mission(base: str = "static-obstacles", **tables: Any) -> MissionFile:
    """A built-in mission with other sections, or keys of them."""
    sections = read_mission_file(base).model_dump(exclude_unset=True)
    for name, table in tables.items():
        sections[name] = sections.get(name, {}) | table if isinstance(table, dict) else table
    return parse_model("asked", sections, MissionFile)


def of_tables(**tables: Any) -> MissionFile:
    """A mission along 40 m of some sections."""
    way = {"name": "asked", "waypoints_m": [[0, 0, 0], [40, 0, 0]]}
    mission = way | tables.pop("mission", {})
    return parse_model("asked", {"mission": mission, **tables}, MissionFile)


@contextmanager
def told_to(asked: list[str]) -> Iterator[None]:
    """Every loop that has to be loaded or compiled meanwhile, by name and types."""
    load = KernelCache.load_overload

    def told(cache: Any, signature: Any, target: Any) -> Any:
        asked.append(f"{cache._function.__qualname__} {signature}")
        return load(cache, signature, target)

    KernelCache.load_overload = told  # type: ignore[method-assign]
    try:
        yield
    finally:
        KernelCache.load_overload = load  # type: ignore[method-assign]


def asked_in_flight(
    file: MissionFile,
    seconds: int = 5,
    told: Callable[[State], State] = lambda state: state,
    seen: Callable[[Scan], list[Scan]] = lambda scan: [scan],
    more: Callable[[State, int], list[Reading]] = lambda _state, _second: [],
    before: Callable[[AvoidanceSystem], None] = lambda _system: None,
) -> list[str]:
    """Loops asked for by a flight of some seconds, by what it is told of itself, sees, and hears.

    before: what is done to the system after it was warmed up.
    """
    setup = prepare(file)
    system, asked = setup.system(), list[str]()
    system.warm_up()
    before(system)
    here = setup.mission.start
    for second in range(seconds):
        now = float(second)
        here = replace(system.state_at(now) or here, time_s=now)
        scans = [simulate_scan(lidar, setup.world, here, second) for lidar in setup.lidars]
        readings: list[Reading] = [told(here), *more(here, second)]
        readings += [each for scan in scans for each in seen(replace(scan, time_s=now))]
        with told_to(asked):
            for reading in readings:
                system.update(reading)
            system.keep_up(now)
            system.due(now)
            system.decide(now)
            system.movement_at(now + 0.5)
            system.state_at(now + 0.5)
    return asked


def asked_apart(cases: Mapping[str, Callable[[], list[str]]], name: str) -> list[str]:
    """What a case asks for, in a process of its own, since other tests load what it needs; there
    the file of the cases is run, and its `tell` prints it."""
    file = sys.modules[next(iter(cases.values())).__module__].__file__
    assert file is not None
    run = f"import runpy; runpy.run_path({file!r}, run_name='apart')['tell']({name!r})"
    path = f"import sys; sys.path[:0] = {[str(Path(__file__).parent)]!r}; "
    done = subprocess.run(
        [sys.executable, "-c", path + run], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.partition("asked\n")[2].splitlines()
