"""From a parameter file to a loop that is ready to run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from clearway.base.errors import InputError
from clearway.live.link.aircraft import TrafficTerms
from clearway.live.link.floor import FloorRule
from clearway.live.link.link_state import LinkLimits
from clearway.live.link.loop import Loop
from clearway.live.link.session import Session, SessionTerms
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import FlightSetup, Notice, prepare
from clearway.ros2.bus import TopicBus
from clearway.ros2.parameters import Names, NodeParameters
from clearway.ros2.ros2_link import Ros2Link
from clearway.sensors import Lidar

CORE_RMEM = Path("/proc/sys/net/core/rmem_max")
WANTED_BYTES = 16 << 20
"""Of a socket's buffer: a cloud of 100,000 points is 1.6 MB, and several wait."""


def set_up(
    parameters: NodeParameters, names: Names, open_bus: Callable[[], TopicBus], notice: Notice
) -> tuple[Loop, Ros2Link]:
    """Everything compiled, loaded and opened; raises InputError for what cannot be used."""
    file = read_mission_file(str(parameters.mission), notice)
    setup = prepare(file, notice)
    for note in (*setup.notes, *buffer_warnings()):
        notice(note)
    lidars = _lidars(setup, parameters)
    setup = replace(setup, sensors=tuple(lidars.values()))
    setup.refuse_coarse_beams()
    system = setup.system()
    notice(str(system.escape))
    notice("warming up; the first run compiles, which takes a while")
    system.warm_up()
    counts: Counter[str] = Counter()
    first = next(iter(lidars.values()), None)
    session = Session(system, first, _terms(file, setup, parameters), counts)
    origin = file.mission.origin_geodetic
    bus = open_bus()
    try:
        link = Ros2Link(
            bus, session, parameters, names, lidars, None if origin is None else np.array(origin)
        )
    except BaseException:
        bus.close()
        raise
    what = "acting" if parameters.act else "read-only: no set-points are sent"
    notice(f"on {bus.name}, {what}")
    return Loop(link, session, 1.0 / parameters.rate), link


def _lidars(setup: FlightSetup, parameters: NodeParameters) -> dict[str, Lidar]:
    """The mission's sensors that have a topic."""
    known = {lidar.name: lidar for lidar in setup.lidars}
    unknown = sorted(set(parameters.clouds) - set(known))
    if unknown:
        there = ", ".join(known) or "none"
        raise InputError("clouds", f"{unknown[0]!r} is no [[lidar]] of the mission; it has {there}")
    return {name: known[name] for name in known if name in parameters.clouds}


def _terms(file: MissionFile, setup: FlightSetup, parameters: NodeParameters) -> SessionTerms:
    reach, limits = setup.planner.grid.range_m, setup.limits
    return SessionTerms(
        act=parameters.act,
        lead_s=0.5 / parameters.rate,
        limits=LinkLimits(stale_s=limits.state_s, blind_s=limits.scan_s),
        speedup=None if parameters.use_sim_time else 1.0,
        traffic=TrafficTerms(
            position_std_m=file.traffic.position_sigma_m,
            velocity_std_mps=file.traffic.velocity_sigma_mps,
            reach_m=reach,
            horizon_s=reach / setup.planner.speed_mps,
            oldest_s=limits.intruder_s,
        ),
        floor=FloorRule(
            file.safety.margin_m,
            file.rules.floor_m,
            terrain=file.rules.terrain_m is not None,
            stays_level=setup.planner.automaton.stays_level,
        ),
    )


def buffer_warnings() -> list[str]:
    """What of the machine's settings loses clouds."""
    try:
        most = int(CORE_RMEM.read_text())
    except (OSError, ValueError):
        return []
    if most >= WANTED_BYTES:
        return []
    return [
        f"net.core.rmem_max is {most} bytes: clouds of best effort get lost; "
        f"sudo sysctl -w net.core.rmem_max={WANTED_BYTES}"
    ]
