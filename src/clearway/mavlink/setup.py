"""From a mission file and the options of `clearway mavlink` to a loop that is ready to run."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from clearway.avoidance.plan.held_escape import Escape
from clearway.base.errors import InputError
from clearway.base.frames import enu_from_geodetic
from clearway.live.link.aircraft import TrafficTerms
from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.link_state import LinkLimits
from clearway.live.link.loop import Loop
from clearway.live.link.session import Session
from clearway.live.preflight.doubts import are_level
from clearway.live.preflight.escape_plan import EscapePlan
from clearway.mavlink.distances import sector_lidar
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.links import FrameLink, open_link
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.mavlink_session import MavlinkSession, MavlinkTerms
from clearway.mavlink.outbox import Outbox, Packer
from clearway.mavlink.signing import SignatureCheck, is_open, read_key
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.planned import plan_reader
from clearway.missions.setup import FlightSetup, Notice, prepare
from clearway.sensors import Lidar

ANSWERS = {"acceleration_mps2": 2.0, "lag_s": 0.3}
"""Of a copter whose mission does not state how it answers: autopilots accelerate less and later, as
they come, than a copter of `[vehicle]` does, and fly too fast where they catch up with its plan."""


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """What the command line says."""

    connect: str
    rate_hz: float = 10.0
    act: bool = False
    signing_key: Path | None = None
    system: int = 1
    component: int = 1
    icao: str | None = None
    traffic_margin_m: float = 0.0
    fan_deg: float = 0.0
    heartbeat_s: float = 3.0
    speedup: float | None = 1.0
    ask: bool = False
    """Ask for streams and parameters though read-only."""


def read_led_mission(name_or_path: str, notice: Notice) -> MissionFile:
    """Return a mission with what it leaves out of its vehicle as those fly that set-points lead.

    A plan of a ground station states no kind of vehicle. A copter keeps the heights of its
    waypoints; a plane, which files of missions mean by default, pitches on its way to them.
    """
    file = read_mission_file(name_or_path, notice)
    if plan_reader(Path(name_or_path)) is not None:
        notice(
            'note: the plan states no kind of vehicle, taken: vehicle.kind = "multirotor"; a '
            "mission that names the plan may state another"
        )
        file = file.with_values("vehicle", kind="multirotor")
    return fill_in_answers(file, notice)


def fill_in_answers(file: MissionFile, notice: Notice) -> MissionFile:
    """Return a mission that states how its copter answers, as autopilots do where it does not."""
    vehicle = file.vehicle
    left = {key: value for key, value in ANSWERS.items() if getattr(vehicle, key) is None}
    if vehicle.kind != "multirotor" or vehicle.automaton is not None or not left:
        return file
    taken = ", ".join(f"vehicle.{key} = {value:g}" for key, value in left.items())
    notice(f"note: not in the mission, so taken as autopilots answer by default: {taken}")
    return file.with_values("vehicle", **left)


def set_up_mavlink(
    file: MissionFile, options: SessionOptions, notice: Notice
) -> tuple[Loop, MavlinkLink[Session]]:
    """Everything loaded and opened; raises InputError for what cannot be used."""
    key = None if options.signing_key is None else read_key(options.signing_key)
    _address(options.icao)  # Refused at once.
    counts: Counter[str] = Counter()
    link = open_link(options.connect, counts)
    silent = "only our heartbeat is sent" if not options.ask else "our heartbeat and questions"
    what = "acting" if options.act else f"read-only: {silent}, --act sends more"
    notice(f"listening on {link.name}, {what}")
    warn(options, key, notice)
    try:
        setup = prepare(file, notice)
        sensor = sensor_of(file, setup, math.radians(options.fan_deg))
        setup = replace(setup, sensors=() if sensor is None else (sensor,))
        for note in (*setup.notes, *setup.doubts):
            notice(note)
        setup.refuse_coarse_beams()
        enu_from_geodetic(np.zeros(3), np.zeros(3))  # Loads geodesy before a message needs it.
        system = setup.system()
        notice_escape(system.escape, sensor, notice)
        terms = make_mavlink_terms(file, setup, options)
        core = Session(system, sensor, terms.session, counts)
        session = MavlinkSession(core, sensor, terms, counts)
        check = None if key is None else SignatureCheck(key)
        outbox = Outbox(Packer(options.system, key=key, check=check), link.send)
        inbox = Inbox(
            options.system,
            options.component,
            check,
            stream=link.stream,
            is_ours=outbox.is_ours,
        )
        clear(link, counts)
        over = MavlinkLink(link, inbox, session, outbox)
        return Loop(over, session.core, 1.0 / options.rate_hz), over
    except BaseException:
        link.close()
        raise


def frames_only(
    connect: str, signing_key: Path | None, system: int, component: int
) -> tuple[FrameLink, Inbox, Outbox]:
    """A link without a session."""
    key = None if signing_key is None else read_key(signing_key)
    link = open_link(connect, Counter())
    check = None if key is None else SignatureCheck(key)
    outbox = Outbox(Packer(system, key=key, check=check), link.send)
    inbox = Inbox(system, component, check, stream=link.stream, is_ours=outbox.is_ours)
    return link, inbox, outbox


def make_mavlink_terms(
    file: MissionFile, setup: FlightSetup, options: SessionOptions
) -> MavlinkTerms:
    """How a session is run, by mission and options."""
    address = _address(options.icao)
    floor = FloorRule(
        file.safety.margin_m,
        file.rules.floor_m,
        terrain=file.rules.terrain_m is not None,
        stays_level=setup.planner.automaton.stays_level,
    )
    settings = setup.planner.settings
    limits = LinkLimits(options.heartbeat_s, stale_s=settings.state_s, blind_s=settings.scan_s)
    sensor = sensor_of(file, setup, 0.0)
    if sensor is not None:
        sees_m = min(sensor.pattern.max_range_m, setup.planner.grid.range_m)
        limits = limits.seeing(sees_m, setup.planner.speed_mps)
    terms = SessionTerms(
        act=options.act,
        lead_s=0.5 / options.rate_hz,
        limits=limits,
        speedup=options.speedup,
        traffic=_traffic(file, setup, options, address),
        floor=floor,
    )
    return MavlinkTerms(
        system=options.system,
        component=options.component,
        position_std_m=file.simulation.position_sigma_m,
        mission_origin=file.mission.origin_geodetic,
        asks=options.act or options.ask,
        session=terms,
    )


def notice_escape(
    escape: EscapePlan, sensor: Lidar | None, notice: Notice, how: str = "--fan-deg 30"
) -> None:
    """Say which escape mode flies, and what to type where level distances promise nothing."""
    notice(str(escape))
    if sensor is not None and escape.flown == Escape.KNOWN and are_level((sensor,)):
        notice(
            f"if each sector reports the nearest distance in a vertical opening, state it: {how}"
        )


def warn(options: SessionOptions, key: bytes | None, notice: Notice) -> None:
    """Say what makes it easy to steer the vehicle for those who should not."""
    if options.signing_key is not None and is_open(options.signing_key):
        notice(f"{options.signing_key}: others than its owner can read the key")
    outside = options.connect.startswith("udp") and ":127." not in options.connect
    if options.act and key is None and outside:
        notice("no --signing-key: anyone who reaches this link can mislead the vehicle")


def clear(link: FrameLink, counts: Counter[str]) -> None:
    """Drop what came while we got ready: it is old. A flood does not keep us here."""
    for _ in range(50):
        pieces = link.receive()
        if not pieces:
            break
        counts["link: came before we were ready"] += len(pieces)


def sensor_of(file: MissionFile, setup: FlightSetup, fan_rad: float) -> Lidar | None:
    """The sensor behind OBSTACLE_DISTANCE: range and noise are those of the first [[lidar]]."""
    if not file.lidar:
        return None
    section = file.lidar[0]
    far = section.max_range_m or setup.planner.grid.range_m
    return sector_lidar(far, fan_rad, section.sigma_m, section.airframe_radius_m)


def _traffic(
    file: MissionFile, setup: FlightSetup, options: SessionOptions, address: int | None
) -> TrafficTerms:
    reach = setup.planner.grid.range_m
    return TrafficTerms(
        own_address=address,
        position_std_m=file.traffic.position_sigma_m,
        velocity_std_mps=file.traffic.velocity_sigma_mps,
        extra_radius_m=options.traffic_margin_m,
        reach_m=reach,
        horizon_s=reach / setup.planner.speed_mps,
        oldest_s=setup.planner.settings.intruder_s,
    )


def _address(text: str | None) -> int | None:
    if text is None:
        return None
    try:
        address = int(text, 16)
    except ValueError:
        address = -1
    if len(text) != 6 or address < 0:
        raise InputError("--icao", f"{text!r} is no address; six hexadecimal digits are needed")
    return address
