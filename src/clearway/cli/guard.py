"""`clearway guard`: somebody commands, and a guardian stands between, on ROS 2 or MAVLink."""

from __future__ import annotations

import math
import sys
import time
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.live_ends import stop_rule
from clearway.cli.report import NOT_REACHED, leave, print_json, say, sourced
from clearway.cli.ros2_bus import (
    CHECKED_S,
    Backend,
    Bag,
    Check,
    Domain,
    Namespace,
    Remap,
    bus_for,
    refuse_other_backend,
)

if TYPE_CHECKING:
    from clearway.live.guard.guard_session import GuardSession
    from clearway.live.link.loop import Loop, LoopReport
    from clearway.live.link.outcome import TickOutcome
    from clearway.ros2.bus import TopicBus

SAY_AGAIN_S = 1.0


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
        str, typer.Option(help="MAVLink: where wishes come from, an address likewise.")
    ] = "udpin:127.0.0.1:14560",
    act: Annotated[
        bool, typer.Option("--act", help="MAVLink: send set-points; else only our heartbeat.")
    ] = False,
    check: Check = False,
    bag: Bag = None,
    backend: Backend = "auto",
    domain: Domain = None,
    namespace: Namespace = "",
    remap: Remap = None,
    rate: Annotated[
        float, typer.Option(min=1.0, max=100.0, help="MAVLink: ticks a second.")
    ] = 20.0,
    hold_s: Annotated[
        float, typer.Option(min=0.05, max=10.0, help="MAVLink: a wish is verified for so long.")
    ] = 0.5,
    acceleration_mps2: Annotated[
        float | None,
        typer.Option(min=0.01, help="MAVLink: of the vehicle; default: changes speed at once."),
    ] = None,
    signing_key: Annotated[
        Path | None,
        typer.Option(help="MAVLink: 32 bytes or 64 hex digits; frames not signed so are refused."),
    ] = None,
    system: Annotated[
        int, typer.Option(min=1, max=255, help="MAVLink: the vehicle's system id.")
    ] = 1,
    component: Annotated[
        int, typer.Option(min=1, max=255, help="MAVLink: the autopilot's id.")
    ] = 1,
    lock_step: Annotated[
        bool, typer.Option("--lock-step", help="MAVLink: a simulated vehicle waits for us.")
    ] = False,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="End after so many seconds; default: Ctrl-C.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Let commands pass while a way out is behind them, else fly the nearest that is safe."""
    lasts = CHECKED_S if check and duration is None else duration
    if connect is None:
        refuse_other_backend(backend)
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
            speedup=None if lock_step else 1.0,
            ask=check,
        )
        terms = GuardTerms(commands, hold_s=hold_s, acceleration_mps2=acceleration_mps2 or math.inf)
        loop, link = _on_mavlink(what, options, terms)
    session: GuardSession = link.session if connect is None else link.session.core
    with closing(link):
        over = partial(getattr, getattr(link, "bus", None), "ended", False)
        with stop_rule(lasts, ended=over) as stop:
            report = loop.run(stop, _GuardWatch().show)
        result = _result(session, report) | _of_link(link)
        missing = link.missing() if connect is None else []
    if as_json:
        print_json(sourced(result | {"missing": missing}))
    else:
        print(_in_words(result))
        if check:
            print("\n".join(["missing:", *missing]) if missing else "all is there")
    if missing if check else not result["wishes"]:
        leave(NOT_REACHED)


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
    from clearway.ros2.parameters import Names, read_parameters
    from clearway.ros2.setup import set_up_guard

    given = read_parameters(Path(what), namespace=namespace)
    changed: dict[str, object] = {"act": False} if check else {}
    if bag is not None:
        changed["use_sim_time"] = True
    if "rate" not in given.model_fields_set:
        changed["rate"] = 20.0

    def open_bus() -> TopicBus:
        return bus_for(bag, backend, domain, namespace)

    return set_up_guard(
        given.model_copy(update=changed), Names(namespace, remap=remap), open_bus, say
    )


def _on_mavlink(what: str, options: Any, terms: Any) -> tuple[Loop, Any]:
    from clearway.mavlink.dialect import dialect
    from clearway.mavlink.guard_link import set_up_guard
    from clearway.missions.mission_file import read_mission_file

    dialect()
    return set_up_guard(read_mission_file(what, say), options, terms, say)


class _GuardWatch:
    """Tells on standard error when the link changes, and when the guardian steps in."""

    def __init__(self) -> None:
        self._told, self._told_s = ("", ""), -math.inf

    def show(self, outcome: TickOutcome) -> None:
        at = f"{outcome.time_s:.1f} s"
        for note in outcome.notes:
            print(f"{at}  {note}", file=sys.stderr, flush=True)
        guarded = outcome.guarded
        doing = "" if guarded is None else "passed" if guarded.is_wish else "replaced"
        present, now = (str(outcome.state), doing), time.monotonic()
        again = present != self._told and now >= self._told_s + SAY_AGAIN_S
        if present[0] == self._told[0] and not again:
            return
        self._told, self._told_s = present, now
        why = f" ({outcome.why_state})" if outcome.why_state else ""
        said = "" if guarded is None else f"; {guarded.why}"
        print(f"{at}  {outcome.state}{why}{said}", file=sys.stderr, flush=True)


def _result(session: GuardSession, report: LoopReport) -> dict[str, Any]:
    tally = session.tally
    return {
        "acting": session.terms.act,
        "state": str(session.state),
        "wishes": tally["wishes"],
        "passed": tally["passed"],
        "slowed": tally["slowed"],
        "replaced": tally["replaced"],
        "without_a_wish": tally["without a wish"],
        "ticks": report.ticks,
        "late": report.late,
        "left_out": dict(session.left_out),
    }


def _of_link(link: Any) -> dict[str, Any]:
    """What came and went."""
    if hasattr(link, "topics"):
        heard = {topic: one.messages for topic, one in link.topics.items()}
        return {"heard": heard, "sent": dict(link.published)}
    received = link.autopilot.inbox.received + link.commanded.received
    refused = link.autopilot.inbox.refused + link.commanded.refused
    sent = dict(link.autopilot.outbox.sent)
    return {"heard": dict(received), "refused": dict(refused), "sent": sent}


def _in_words(result: dict[str, Any]) -> str:
    lines = [
        f"guardian   {'acting' if result['acting'] else 'read-only'}; the link at the end: "
        f"{result['state']}",
        f"wishes     {result['wishes']}; ticks: {result['passed']} passed, {result['slowed']} "
        f"slowed, {result['replaced']} replaced, {result['without_a_wish']} without a wish",
        f"ticks      {result['ticks']}, {result['late']} late",
    ]
    for title in ("heard", "refused", "left_out", "sent"):
        counts = {name: number for name, number in result.get(title, {}).items() if number}
        if counts:
            told = ", ".join(f"{number} {name}" for name, number in sorted(counts.items()))
            lines.append(f"{title.replace('_', ' '):<10} {told}")
    return "\n".join(lines)
