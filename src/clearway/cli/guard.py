"""`clearway guard`: somebody commands, and a guardian stands between, on ROS 2 or MAVLink."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import mavlink_options, ros2_bus
from clearway.cli.guard_words import GuardWatch, describe_guard, describe_link, summarize_guard
from clearway.cli.live_ends import stop_rule
from clearway.cli.report import NOT_REACHED, add_sources, leave, print_json, say
from clearway.cli.ros2_bus import BUS_CHECK_S, BusOptions, open_node, refuse_unusable

if TYPE_CHECKING:
    from clearway.live.guard.guard_session import GuardSession
    from clearway.live.link.loop import Loop, LoopReport, OnOutcome, Stop
    from clearway.ros2.node import NodeKind, NodeRun

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
    """Pass commands while an escape remains behind them, else fly the nearest safe velocity."""
    listens_s = BUS_CHECK_S if connect is None else ASKED_S
    lasts = listens_s if check and duration is None else duration
    node: NodeRun | _MavlinkNode
    if connect is None:
        refuse_unusable(backend, bag)
        bus = BusOptions(bag, backend, domain, namespace, remap or ())
        node = open_node(guard_kind(), Path(what), bus, check=check, hand=hand)
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
        node = _on_mavlink(what, options, terms, signing_key, hand=hand)
    with closing(node):
        over = partial(getattr, getattr(node.link, "bus", None), "ended", False)
        with stop_rule(lasts, ended=over) as stop:
            report = node.run(stop, GuardWatch().show)
        link: Any = node.link
        if link is None:
            say("never configured: nothing was guarded")
            leave(NOT_REACHED)
        session: GuardSession = link.session if connect is None else link.session.core
        result = summarize_guard(session, report) | describe_link(link)
        missing = link.missing() if check or connect is None else []
        relieved = (link if connect is None else link.autopilot).handing.hand.relieved
    if as_json:
        print_json(add_sources(result | {"missing": missing}))
    else:
        print(describe_guard(result))
        if check:
            print("\n".join(["missing:", *missing]) if missing else "all is there")
    if missing if check else relieved or not result["wishes"]:
        leave(NOT_REACHED)


def guard_kind() -> NodeKind:
    """The node that guards wishes."""
    from clearway.ros2.node import NodeKind
    from clearway.ros2.setup import set_up_ros2_guard

    return NodeKind(set_up_ros2_guard, {"rate": 20.0}, without=("px4", "goal", "path"))


@dataclass(frozen=True, slots=True, eq=False)
class _MavlinkNode:
    """A `ros2.node.NodeRun` on MAVLink."""

    loop: Loop
    link: Any
    key: Path | None
    hand: bool

    def run(self, stop: Stop, on_outcome: OnOutcome) -> LoopReport:
        from clearway.mavlink.hand import begin_mavlink_hand

        over = self.link.autopilot
        begin_mavlink_hand(self.loop, over, key=self.key, wanted=self.hand, log=None, notice=say)
        return self.loop.run(stop, on_outcome)

    def close(self) -> None:
        self.link.close()


def _on_mavlink(
    what: str, options: Any, terms: Any, key: Path | None, *, hand: bool
) -> _MavlinkNode:
    from clearway.mavlink.dialect import dialect
    from clearway.mavlink.guard_link import set_up_mavlink_guard
    from clearway.mavlink.setup import read_led_mission

    dialect()
    file = read_led_mission(what, say)
    loop, link = set_up_mavlink_guard(file, options, terms, say)
    return _MavlinkNode(loop, link, key, hand)
