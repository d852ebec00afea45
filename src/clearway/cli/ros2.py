"""`clearway ros2`: a mission decided live on ROS 2 topics, with ROS or without it."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.report import NOT_REACHED, leave, print_json, say, sourced

if TYPE_CHECKING:
    from clearway.live.link.loop import LoopReport, Stop
    from clearway.live.link.session import TickOutcome
    from clearway.ros2.bus import TopicBus
    from clearway.ros2.ros2_link import Ros2Link

ENDED_BY = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
CHECKED_S = 5.0
BACKENDS = ("auto", "dds", "rclpy")


def ros2(
    parameters: Annotated[Path, typer.Argument(help="The node's parameters (YAML of ROS 2).")],
    check: Annotated[
        bool,
        typer.Option("--check", help="Listen for 5 s, tell what comes and what is missing, end."),
    ] = False,
    bag: Annotated[
        Path | None, typer.Option(help="Play a ROS 2 bag or MCAP file in place of live topics.")
    ] = None,
    backend: Annotated[
        str, typer.Option(help="auto (rclpy where ROS is there, else dds), dds, or rclpy.")
    ] = "auto",
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="DDS domain; default: ROS_DOMAIN_ID, or 0.")
    ] = None,
    namespace: Annotated[str, typer.Option(help="Namespace of the node.")] = "",
    remap: Annotated[list[str] | None, typer.Option(help="FROM:=TO, as often as needed.")] = None,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="End after so many seconds; default: Ctrl-C.")
    ] = None,
    end_on_arrival: Annotated[
        bool, typer.Option("--end-on-arrival", help="End at the last goal instead of holding it.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Decide live on ROS 2 topics; needs no ROS. Set-points with `act: true` in the parameters."""
    from clearway.base.errors import InputError
    from clearway.ros2.parameters import Names, read_parameters
    from clearway.ros2.setup import set_up

    if backend not in BACKENDS:
        raise InputError("--backend", f"{backend!r} is none of {', '.join(BACKENDS)}")
    given = read_parameters(parameters, namespace=namespace)
    if check:
        given = given.model_copy(update={"act": False})
    if bag is not None:
        given = given.model_copy(update={"use_sim_time": True})
    names = Names(namespace, remap=remap or ())

    def open_bus() -> TopicBus:
        return _bus(bag, backend, domain, namespace)

    loop, link = set_up(given, names, open_bus, say)
    try:
        with _stop_rule(link, CHECKED_S if check else duration, arrival=end_on_arrival) as stop:
            report = loop.run(stop, _NodeWatch().show)
        result, missing = _result(link, report), link.missing()
        words = _in_words(result, link)
    finally:
        link.close()
    if as_json:
        print_json(sourced(result | {"missing": missing}))
    else:
        print(words)
        if check:
            print("\n".join(["missing:", *missing]) if missing else "all is there")
    good = not missing if check else bool(result["decisions"])
    if not good or (given.act and end_on_arrival and not result["reached"]):
        leave(NOT_REACHED)


def _bus(bag: Path | None, backend: str, domain: int | None, namespace: str) -> TopicBus:
    from clearway.ros2.bag_bus import BagBus
    from clearway.ros2.dds import DdsBus, domain_id
    from clearway.ros2.parameters import NODE
    from clearway.ros2.rclpy_bus import RclpyBus, rclpy_is_there

    if bag is not None:
        return BagBus(bag)
    if backend == "rclpy" or (backend == "auto" and domain is None and rclpy_is_there()):
        return RclpyBus(NODE, namespace)
    return DdsBus(domain_id() if domain is None else domain)


@contextmanager
def _stop_rule(link: Ros2Link, duration: float | None, *, arrival: bool) -> Iterator[Stop]:
    told: list[int] = []

    def note(number: int, _frame: object) -> None:
        told.append(number)

    def stop(elapsed_s: float, outcome: TickOutcome | None) -> bool:
        arrived = arrival and outcome is not None and outcome.state == "arrived"
        ended = getattr(link.bus, "ended", False)
        return bool(told) or arrived or ended or (duration is not None and elapsed_s >= duration)

    before = {number: signal.signal(number, note) for number in ENDED_BY}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _NodeWatch:
    """Tells changes on standard error."""

    def __init__(self) -> None:
        self._told, self._told_s = ("", ""), 0.0

    def show(self, outcome: TickOutcome) -> None:
        for note in outcome.notes:
            print(f"{outcome.time_s:.1f} s  left out: {note}", file=sys.stderr, flush=True)
        flight = outcome.flight
        present = (str(outcome.state), str(flight.mode) if flight else self._told[1])
        now = time.monotonic()
        changed = present[0] != self._told[0]
        if changed or (present != self._told and now >= self._told_s + 1.0):
            self._told, self._told_s = present, now
            why = f" ({outcome.why_state})" if outcome.why_state else ""
            doing = f"; {flight.explanation}" if flight else ""
            print(
                f"{outcome.time_s:.1f} s  {outcome.state}{why}{doing}", file=sys.stderr, flush=True
            )


def _result(link: Ros2Link, report: LoopReport) -> dict[str, Any]:
    system = link.session.system
    decision = link.published[link.decision_topic]
    return {
        "mission": system.mission.name,
        "acting": link.parameters.act,
        "reached": system.progress.done(system.mission),
        "waypoints_reached": system.progress.waypoints_reached(system.mission),
        "state": str(link.session.state),
        "decisions": decision,
        "ticks": report.ticks,
        "late": report.late,
        "topics": {
            topic: {
                "messages": heard.messages,
                "not_usable": heard.refused,
                "rate_hz": round(heard.rate_hz, 3),
            }
            for topic, heard in link.topics.items()
        },
        "published": dict(link.published),
        "left_out": dict(link.left_out),
    }


def _in_words(result: dict[str, Any], link: Ros2Link) -> str:
    lines = [
        f"mission    {result['mission']}, {'acting' if result['acting'] else 'read-only'}",
        f"reached    {'yes' if result['reached'] else 'NO'}, {result['waypoints_reached']} "
        f"waypoints; the link at the end: {result['state']}",
        f"decisions  {result['decisions']}, {result['ticks']} ticks, {result['late']} late",
    ]
    lines += [
        f"heard      {heard.words(topic, link.bus.publishers(topic))}"
        for topic, heard in link.topics.items()
        if heard.needed or heard.messages
    ]
    lines += [f"left out   {number} x {why}" for why, number in sorted(result["left_out"].items())]
    return "\n".join(lines)
