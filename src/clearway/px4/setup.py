"""From a parameter file to a loop in which clearway is one of PX4's flight modes."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from typing import Final

from clearway.base.errors import InputError
from clearway.live.guard.guard_session import GuardSession, looking_past
from clearway.live.link.loop import Loop
from clearway.live.link.session import Session
from clearway.mavlink.setup import notice_escape, sensor_of
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, Notice
from clearway.px4.link import Px4GuardLink, Px4Link
from clearway.px4.releases import RELEASES, TOPICS, Release
from clearway.px4.topics import Faces
from clearway.ros2.bus import SENSOR, TopicBus
from clearway.ros2.messages import ADDED
from clearway.ros2.parameters import Names, NodeParameters, Px4Parameters, SetPointParameters
from clearway.ros2.setup import NodeSetup, open_link_on, session_terms
from clearway.sensors import Lidar

OpenBus = Callable[[], TopicBus]
TELLING: Final = ("VehicleStatus", "VehicleLocalPosition")
"""Messages whose versions tell the releases apart."""
HIGHEST_VERSION: Final = 9
"""Newer versions of them are looked for up to here, to be named."""
LOOKS_S: Final = 0.1
SETTLES_S: Final = 1.0
"""Topics of one vehicle are found within this time of the first one."""
FAN: Final = "px4: {fan_deg: 30}"
OWN = {"own": "PX4 tells it", "set_points": "they go to PX4"}
"""Parameters of `clearway ros2` that have no meaning here."""


def set_up_px4(
    parameters: NodeParameters, names: Names, open_bus: OpenBus, notice: Notice
) -> tuple[Loop, Px4Link]:
    """A mission as a mode of PX4; raises InputError for what cannot be used."""
    if "guard" in parameters.model_fields_set:
        notice("guard: is for `clearway px4 --guard`, ignored here")
    setup = _node(parameters, notice)
    for doubt in setup.flight.doubts:
        notice(doubt)
    faces = Faces(_release(parameters.px4, open_bus, notice), notice)
    parameters = _facing(parameters, faces.release)
    system = setup.flight.system()
    notice_escape(system.escape, setup.sensor, notice, FAN)
    session = Session(system, setup.sensor, session_terms(setup, parameters), Counter())

    def link_on(bus: TopicBus) -> Px4Link:
        return Px4Link(bus, session, parameters, names, setup, faces)

    link = open_link_on(open_bus, link_on, parameters, notice)
    return Loop(link, session, 1.0 / parameters.rate, at_once=True), link


def set_up_px4_guard(
    parameters: NodeParameters, names: Names, open_bus: OpenBus, notice: Notice
) -> tuple[Loop, Px4GuardLink]:
    """A guardian as a mode of PX4: what somebody commands, as far as it may be flown."""
    given = parameters.guard
    setup = _node(parameters, notice)
    faces = Faces(_release(parameters.px4, open_bus, notice), notice)
    parameters = _facing(parameters, faces.release)
    if names(given.topic) in [names(one.topic) for one in parameters.set_points.values()]:
        raise InputError(
            "guard.topic", f"{names(given.topic)} is PX4's own: command another topic, such as "
            "/clearway/trajectory_setpoint"
        )  # fmt: skip
    guardian = setup.flight.guardian(given.hold_s, given.acceleration_mps2)
    notice(guardian.braking)
    notice_escape(guardian.escape, setup.sensor, notice, FAN)
    terms = looking_past(session_terms(setup, parameters))
    session = GuardSession(guardian, setup.sensor, terms, Counter(), wish_s=given.timeout_s)

    def link_on(bus: TopicBus) -> Px4GuardLink:
        return Px4GuardLink(bus, session, parameters, names, setup, faces)

    link = open_link_on(open_bus, link_on, parameters, notice)
    return Loop(link, session, 1.0 / parameters.rate, at_once=True), link


def _node(parameters: NodeParameters, notice: Notice) -> NodeSetup:
    for name, why in OWN.items():
        if name in parameters.model_fields_set:
            notice(f"{name}: ignored, {why}")
    given = parameters.px4
    if given.distances and parameters.clouds:
        raise InputError("px4.distances", "is in place of clouds: state one of both")

    def ring(file: MissionFile, flight: FlightSetup) -> dict[str, Lidar]:
        sensor = sensor_of(file, flight, math.radians(given.fan_deg))
        return {} if sensor is None else {sensor.name: sensor}

    return NodeSetup.of(parameters, notice, ring if given.distances else None)


def _facing(parameters: NodeParameters, release: Release) -> NodeParameters:
    """Parameters that send what is flown to PX4."""
    topic = parameters.px4.prefix.rstrip("/") + release.topic("TrajectorySetpoint")
    point = SetPointParameters(topic=topic, type="TrajectorySetpoint")
    return parameters.model_copy(update={"set_points": {"px4": point}})


def _release(given: Px4Parameters, open_bus: OpenBus, notice: Notice) -> Release:
    if given.release != "auto":
        return RELEASES[given.release]
    bus = open_bus()
    try:
        found = find_release(bus, given.prefix.rstrip("/"), given.wait_s)
    finally:
        bus.close()
    notice(f"PX4 speaks as release {found.name} does")
    return found


def find_release(bus: TopicBus, prefix: str, wait_s: float) -> Release:
    """Return the release of PX4 by the topics that it publishes; InputError where there is none."""
    topics = {
        f"{prefix}/fmu/{TOPICS[message]}" + (f"_v{version}" if version else ""): (message, version)
        for message in TELLING
        for version in range(HIGHEST_VERSION + 1)
    }
    for topic, (message, version) in topics.items():
        of_version = f"px4_msgs/msg/{message}V{version}"
        kind = of_version if of_version in ADDED else RELEASES["1.18"].kind(message)
        bus.subscribe(topic, kind, SENSOR)
    ends_s = time.monotonic() + wait_s
    first_s, found = ends_s, dict[str, int]()
    while time.monotonic() < min(ends_s, first_s + SETTLES_S) and len(found) < len(TELLING):
        time.sleep(LOOKS_S)
        found = {
            message: version
            for topic, (message, version) in topics.items()
            if bus.publishers(topic)
        }
        first_s = min(first_s, time.monotonic()) if found else first_s
    fits = [
        release
        for release in RELEASES.values()
        if found == {message: release.versions.get(message, 0) for message in TELLING}
    ]
    if fits:
        return fits[0]
    if found:
        told = ", ".join(f"{message} of version {version}" for message, version in found.items())
        raise InputError(
            "PX4", f"publishes {told} alone, which none of {', '.join(RELEASES)} does: state "
            "px4.release, or update PX4 or clearway"
        )  # fmt: skip
    raise InputError(
        "PX4", f"no {prefix}/fmu/out/vehicle_status on {bus.name} within {wait_s:g} s: is "
        "MicroXRCEAgent running, with the same ROS_DOMAIN_ID? `px4.prefix` states a namespace"
    )  # fmt: skip
