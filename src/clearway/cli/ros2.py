"""`clearway ros2`: a mission decided live on ROS 2 topics, with ROS or without it."""

from __future__ import annotations

import math
import sys
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import mavlink_options, ros2_bus
from clearway.cli.flight_time import FlightTime
from clearway.cli.live_ends import stop_rule
from clearway.cli.report import NOT_REACHED, add_sources, leave, print_json, say
from clearway.cli.ros2_bus import BUS_CHECK_S, BusOptions, open_node, refuse_unusable

if TYPE_CHECKING:
    from clearway.live.link.loop import LoopReport
    from clearway.live.link.outcome import TickOutcome
    from clearway.ros2.node import NodeKind


def ros2(
    parameters: Annotated[Path, typer.Argument(help="The node's parameters (YAML of ROS 2).")],
    check: ros2_bus.Check = False,
    bag: ros2_bus.Bag = None,
    backend: ros2_bus.Backend = "auto",
    domain: ros2_bus.Domain = None,
    namespace: ros2_bus.Namespace = "",
    remap: ros2_bus.Remap = None,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="End after so many seconds; default: Ctrl-C.")
    ] = None,
    end_on_arrival: Annotated[
        bool, typer.Option("--end-on-arrival", help="End at the last goal instead of holding it.")
    ] = False,
    hand: mavlink_options.Hand = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Decide live on ROS 2 topics, without ROS: sends set-points only with `act: true`."""
    refuse_unusable(backend, bag)
    options = BusOptions(bag, backend, domain, namespace, remap or ())
    node = open_node(route_kind(), parameters, options, check=check, hand=hand)
    with closing(node):
        over = partial(getattr, getattr(node.link, "bus", None), "ended", False)
        with stop_rule(
            BUS_CHECK_S if check else duration, arrival=end_on_arrival, ended=over
        ) as stop:
            report = node.run(stop, NodeWatch().show)
        link = node.link
        if link is None:
            say("never configured: nothing was decided")
            leave(NOT_REACHED)
        result, missing = summarize_node(link, report), link.missing()
        words = describe_node(result, link)
    if as_json:
        print_json(add_sources(result | {"missing": missing}))
    else:
        print(words)
        if check:
            print("\n".join(["missing:", *missing]) if missing else "all is there")
    good = not missing if check else bool(result["decisions"]) and not link.is_relieved
    if not good or (link.parameters.act and end_on_arrival and not result["reached"]):
        leave(NOT_REACHED)


def route_kind() -> NodeKind:
    """The node that flies a mission."""
    from clearway.ros2.node import NodeKind
    from clearway.ros2.setup import set_up_ros2

    return NodeKind(set_up_ros2, without=("guard", "px4"))


class NodeWatch:
    """Tells changes on standard error."""

    def __init__(self) -> None:
        self._told, self._told_s = ("", ""), -math.inf
        self._clock = FlightTime()

    def show(self, outcome: TickOutcome) -> None:
        begun = self._clock.begin(outcome.time_s)
        at = self._clock.words(outcome.time_s)
        if begun is not None:
            print(begun, file=sys.stderr, flush=True)
        for note in outcome.notes:
            print(f"{at}  left out: {note}", file=sys.stderr, flush=True)
        flight = outcome.flight
        present = (str(outcome.state), str(flight.mode) if flight else self._told[1])
        now = outcome.time_s  # A recording's own time, so that it reads the same on any machine.
        changed = present[0] != self._told[0]
        if changed or (present != self._told and now >= self._told_s + 1.0):
            self._told, self._told_s = present, now
            why = f" ({outcome.why_state})" if outcome.why_state else ""
            doing = f"; {flight.explanation}" if flight else ""
            print(f"{at}  {outcome.state}{why}{doing}", file=sys.stderr, flush=True)


def summarize_node(link: Any, report: LoopReport) -> dict[str, Any]:
    from clearway.io.json_values import round_number

    system = link.session.system
    decision = link.published[link.decision_topic]
    return {
        "mission": system.mission.name,
        "acting": link.parameters.act,
        "played_back": link.bus.recorded,
        "reached": system.progress.is_done(system.mission),
        "waypoints_reached": system.progress.waypoints_reached(system.mission),
        "state": str(report.state or link.session.state),
        **system.escape.to_json(),
        "decisions": decision,
        "ticks": report.ticks,
        "late": report.late,
        "topics": {
            topic: {
                "messages": heard.messages,
                "not_usable": heard.refused,
                "rate_hz": round(heard.rate_hz, 3),
                "age_s": round_number(heard.age_s, 3),
            }
            for topic, heard in link.topics.items()
        },
        "lost": dict(link.bus.lost),
        "published": dict(link.published),
        "left_out": dict(link.session.left_out),
    }


def _describe_reached(result: dict[str, Any]) -> str:
    """A recording flies nowhere: what it passed is all that can be stated."""
    if result["played_back"]:
        return f"played back, not flown: its vehicle passed {result['waypoints_reached']} waypoints"
    return f"{'yes' if result['reached'] else 'NO'}, {result['waypoints_reached']} waypoints"


def describe_node(result: dict[str, Any], link: Any) -> str:
    lines = [
        f"mission    {result['mission']}, {'acting' if result['acting'] else 'read-only'}",
        f"reached    {_describe_reached(result)}; the link at the end: {result['state']}",
        f"escape     {result['escape_mode']}: {result['escape_why']}",
        f"decisions  {result['decisions']}, {result['ticks']} ticks, {result['late']} late",
    ]
    lines += [
        f"heard      {heard.words(topic, link.bus)}"
        for topic, heard in link.topics.items()
        if heard.needed or heard.messages
    ]
    if link.dropped:
        lines.append(f"dropped    {link.dropped} datagrams by the kernel: buffers were full")
    lines += [f"left out   {number} x {why}" for why, number in sorted(result["left_out"].items())]
    return "\n".join(lines)
