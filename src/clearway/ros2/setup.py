"""From a parameter file to a loop that is ready to run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.live.guard.guard_session import GuardSession, looking_past
from clearway.live.link.aircraft import TrafficTerms
from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.link_state import LinkLimits
from clearway.live.link.loop import Loop
from clearway.live.link.outcome import Link
from clearway.live.link.session import Session
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import FlightSetup, Notice, prepare
from clearway.ros2.bus import TopicBus
from clearway.ros2.guard_link import GuardLink
from clearway.ros2.kernel import buffer_warnings
from clearway.ros2.parameters import Names, NodeParameters, SetPointParameters
from clearway.ros2.ros2_link import Ros2Link
from clearway.sensors import Lidar

L = TypeVar("L", bound=Link)
LidarsOf = Callable[[MissionFile, FlightSetup], dict[str, Lidar]]
CMD_VEL = {"velocity": SetPointParameters(topic="cmd_vel", type="Twist")}
"""What a guardian publishes where nothing else is stated."""


@dataclass(frozen=True, slots=True, eq=False)
class NodeSetup:
    """Of a parameter file: what both kinds of node are made of."""

    file: MissionFile
    flight: FlightSetup
    lidars: dict[str, Lidar]

    @classmethod
    def of(
        cls, parameters: NodeParameters, notice: Notice, lidars_of: LidarsOf | None = None
    ) -> NodeSetup:
        """Raises InputError for what cannot be used; lidars_of: sensors in place of clouds."""
        file = read_mission_file(str(parameters.mission), notice)
        flight = prepare(file, notice)
        for note in (*flight.notes, *buffer_warnings()):
            notice(note)
        lidars = lidars_of(file, flight) if lidars_of else _lidars(flight, parameters)
        flight = replace(flight, sensors=tuple(lidars.values()))
        flight.refuse_coarse_beams()
        return cls(file, flight, lidars)

    @property
    def sensor(self) -> Lidar | None:
        """The first one."""
        return next(iter(self.lidars.values()), None)

    @property
    def origin(self) -> FloatArray | None:
        """[3] of the map frame on Earth."""
        origin = self.file.mission.origin_geodetic
        return None if origin is None else np.array(origin)


def set_up_ros2(
    parameters: NodeParameters, names: Names, open_bus: Callable[[], TopicBus], notice: Notice
) -> tuple[Loop, Ros2Link]:
    """Everything loaded and opened; raises InputError for what cannot be used."""
    setup = NodeSetup.of(parameters, notice)
    for doubt in setup.flight.doubts:
        notice(doubt)
    if "guard" in parameters.model_fields_set:
        notice("guard: is for `clearway guard`, ignored here")
    system = setup.flight.system()
    notice(str(system.escape))
    terms = session_terms(setup, parameters)
    session = Session(system, setup.sensor, terms, Counter())

    def link_on(bus: TopicBus) -> Ros2Link:
        return Ros2Link(bus, session, parameters, names, setup.lidars, setup.origin)

    link = open_link_on(open_bus, link_on, parameters, notice)
    return Loop(link, session, 1.0 / parameters.rate, at_once=True), link


def set_up_ros2_guard(
    parameters: NodeParameters, names: Names, open_bus: Callable[[], TopicBus], notice: Notice
) -> tuple[Loop, GuardLink]:
    """The same for a guardian of what somebody commands."""
    given = parameters.guard
    if not parameters.set_points:
        parameters = parameters.model_copy(update={"set_points": CMD_VEL})
    if names(given.topic) in [names(one.topic) for one in parameters.set_points.values()]:
        raise InputError("guard.topic", f"{names(given.topic)} is what the guardian publishes")
    setup = NodeSetup.of(parameters, notice)
    guardian = setup.flight.guardian(given.hold_s, given.acceleration_mps2)
    notice(guardian.braking)
    notice(str(guardian.escape))
    terms = looking_past(session_terms(setup, parameters))
    session = GuardSession(guardian, setup.sensor, terms, Counter(), wish_s=given.timeout_s)

    def link_on(bus: TopicBus) -> GuardLink:
        return GuardLink(bus, session, parameters, names, setup.lidars, setup.origin)

    link = open_link_on(open_bus, link_on, parameters, notice)
    return Loop(link, session, 1.0 / parameters.rate, at_once=True), link


def open_link_on(
    open_bus: Callable[[], TopicBus],
    link_on: Callable[[TopicBus], L],
    parameters: NodeParameters,
    notice: Notice,
) -> L:
    """A link on a bus that is closed again where the link cannot be made."""
    bus = open_bus()
    try:
        link = link_on(bus)
    except BaseException:
        bus.close()
        raise
    what = "acting" if parameters.act else "read-only: no set-points are sent"
    notice(f"on {bus.name}, {what}")
    return link


def _lidars(setup: FlightSetup, parameters: NodeParameters) -> dict[str, Lidar]:
    """The mission's sensors that have a topic."""
    known = {lidar.name: lidar for lidar in setup.lidars}
    unknown = sorted(set(parameters.clouds) - set(known))
    if unknown:
        there = ", ".join(known) or "none"
        raise InputError("clouds", f"{unknown[0]!r} is no [[lidar]] of the mission; it has {there}")
    return {name: known[name] for name in known if name in parameters.clouds}


def session_terms(node: NodeSetup, parameters: NodeParameters) -> SessionTerms:
    """How a node's session is run."""
    file, setup = node.file, node.flight
    reach, settings = setup.planner.grid.range_m, setup.planner.settings
    return SessionTerms(
        act=parameters.act,
        lead_s=0.5 / parameters.rate,
        limits=LinkLimits(stale_s=settings.state_s, blind_s=settings.scan_s),
        speedup=None if parameters.use_sim_time else 1.0,
        traffic=TrafficTerms(
            position_std_m=file.traffic.position_sigma_m,
            velocity_std_mps=file.traffic.velocity_sigma_mps,
            reach_m=reach,
            horizon_s=reach / setup.planner.speed_mps,
            oldest_s=settings.intruder_s,
        ),
        floor=FloorRule(
            file.safety.margin_m,
            file.rules.floor_m,
            terrain=file.rules.terrain_m is not None,
            stays_level=setup.planner.automaton.stays_level,
        ),
    )
