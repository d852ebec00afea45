"""`clearway guard`: somebody commands, and a guardian stands between, on ROS 2 or MAVLink."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import mavlink_options, ros2_bus
from clearway.cli.guard_words import GuardWatch, describe_guard, summarize_guard, told_by
from clearway.cli.live_ends import stop_rule
from clearway.cli.report import NOT_REACHED, leave, print_json, say, sourced
from clearway.cli.ros2_bus import BUS_CHECK_S, bus_for, refuse_unusable

if TYPE_CHECKING:
    from clearway.live.guard.guard_session import GuardSession
    from clearway.live.link.loop import Loop
    from clearway.ros2.bus import TopicBus

ASKED_S = 10.0
"""For so long --check listens to an autopilot, which takes its time to tell its parameters."""


def guard(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT",
            help="Parameters of a ROS 2 node (YAML); with --connect, a mission: its vehicle, "
            "sensors, margin and map.",
        ),
    ],
    connect: Annotated[
        str | None,
        typer.Option(help="MAVLink: the autopilot's udpin:HOST:PORT, udpout:HOST:PORT, serial:..."),
    ] = None,
    commands: Annotated[
        str, typer.Option(help="MAVLink: the address that commands come to, of the same forms.")
    ] = "udpin:127.0.0.1:14560",
    act: mavlink_options.Act = False,
    check: ros2_bus.Check = False,
    bag: ros2_bus.Bag = None,
    backend: ros2_bus.Backend = "auto",
    domain: ros2_bus.Domain = None,
    namespace: ros2_bus.Namespace = "",
    remap: ros2_bus.Remap = None,
    rate: mavlink_options.Rate = 20.0,
    hold_s: Annotated[
        float,
        typer.Option(min=0.05, max=10.0, help="MAVLink: seconds for which a command is verified."),
    ] = 0.5,
    acceleration_mps2: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            help="MAVLink: the vehicle's greatest; default: the mission's, or a cautious 3.",
        ),
    ] = None,
    timeout_s: Annotated[
        float, typer.Option(min=0.05, max=10.0, help="MAVLink: seconds for which a command counts.")
    ] = 0.5,
    signing_key: mavlink_options.SigningKey = None,
    system: mavlink_options.System = 1,
    component: mavlink_options.Component = 1,
    icao: mavlink_options.Icao = None,
    traffic_margin_m: mavlink_options.TrafficMargin = 0.0,
    fan_deg: mavlink_options.Fan = 0.0,
    heartbeat_s: mavlink_options.Heartbeat = 3.0,
    lock_step: mavlink_options.LockStep = False,
    hand: mavlink_options.Hand = True,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="End after so many seconds; default: at Ctrl-C.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Let commands pass while a way out is behind them, else fly the nearest that is safe."""
    listens_s = BUS_CHECK_S if connect is None else ASKED_S
    lasts = listens_s if check and duration is None else duration
    if connect is None:
        refuse_unusable(backend, bag)
        loop, link = _on_topics(what, bag, backend, domain, namespace, remap or (), check=check)
    else:
        from clearway.base.errors import InputError

        if bag is not None:
            raise InputError("--bag", "is for topics: leave --connect out")
        from clearway.mavlink.guard_link import GuardTerms
        from clearway.mavlink.setup import SessionOptions

        options = SessionOptions(
            connect=connect,
            rate_hz=rate,
            act=act and not check,
            signing_key=signing_key,
            system=system,
            component=component,
            icao=icao,
            traffic_margin_m=traffic_margin_m,
            fan_deg=fan_deg,
            heartbeat_s=heartbeat_s,
            speedup=None if lock_step else 1.0,
            ask=check,
        )
        terms = GuardTerms(
            commands,
            wish_s=timeout_s,
            hold_s=hold_s,
            acceleration_mps2=acceleration_mps2,
        )
        loop, link = _on_mavlink(what, options, terms)
    session: GuardSession = link.session if connect is None else link.session.core
    with closing(link):
        _begin_hand(loop, link, signing_key, wanted=hand, on_mavlink=connect is not None)
        over = partial(getattr, getattr(link, "bus", None), "ended", False)
        with stop_rule(lasts, ended=over) as stop:
            report = loop.run(stop, GuardWatch().show)
        result = summarize_guard(session, report) | told_by(link)
        missing = link.missing() if check or connect is None else []
    if as_json:
        print_json(sourced(result | {"missing": missing}))
    else:
        print(describe_guard(result))
        if check:
            print("\n".join(["missing:", *missing]) if missing else "all is there")
    if missing if check else not result["wishes"]:
        leave(NOT_REACHED)


def _begin_hand(
    loop: Loop, link: Any, signing_key: Path | None, *, wanted: bool, on_mavlink: bool
) -> None:
    if on_mavlink:
        from clearway.mavlink.hand import begin_mavlink_hand

        over = link.autopilot
        begin_mavlink_hand(loop, over, key=signing_key, wanted=wanted, log=None, notice=say)
    else:
        from clearway.ros2.hand import TopicEncoding, begin_ros2_hand

        begin_ros2_hand(loop, TopicEncoding(link), wanted=wanted, notice=say)


def _on_topics(
    what: str,
    bag: Path | None,
    backend: str,
    domain: int | None,
    namespace: str,
    remap: list[str] | tuple[()],
    *,
    check: bool,
) -> tuple[Loop, Any]:
    from clearway.ros2.parameter_file import read_parameters
    from clearway.ros2.parameters import Names
    from clearway.ros2.setup import set_up_ros2_guard

    given = read_parameters(Path(what), namespace=namespace)
    changed: dict[str, object] = {"act": False} if check else {}
    if bag is not None:
        changed["use_sim_time"] = True
    if "rate" not in given.model_fields_set:
        changed["rate"] = 20.0

    def open_bus() -> TopicBus:
        return bus_for(bag, backend, domain, namespace)

    return set_up_ros2_guard(
        given.model_copy(update=changed), Names(namespace, remap=remap), open_bus, say
    )


def _on_mavlink(what: str, options: Any, terms: Any) -> tuple[Loop, Any]:
    from clearway.mavlink.dialect import dialect
    from clearway.mavlink.guard_link import set_up_mavlink_guard
    from clearway.missions.mission_file import read_mission_file

    dialect()
    return set_up_mavlink_guard(read_mission_file(what, say), options, terms, say)
