"""`clearway mavlink`: a mission decided live for an autopilot on a MAVLink 2 link."""

from __future__ import annotations

import json
import math
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import mavlink_options
from clearway.cli.live_ends import stop_rule
from clearway.cli.report import NOT_REACHED, add_sources, leave, print_json, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.live.link.loop import Loop, Stop
    from clearway.live.link.outcome import TickOutcome
    from clearway.live.link.session import Session
    from clearway.mavlink.mavlink_link import MavlinkLink
    from clearway.missions.mission_file import MissionFile


GOOD = ("flying", "other mode", "ageing", "arrived")
"""States of the link in which a read-only session ends well."""


def mavlink(
    connect: Annotated[
        str,
        typer.Option(
            help="udpin:HOST:PORT, udpout:HOST:PORT, serial:DEVICE[:BAUD]; port 0 takes a free one."
        ),
    ],
    mission: Annotated[
        str | None,
        typer.Argument(help="A mission by name, a mission file (TOML), or a flight plan."),
    ] = None,
    rate: mavlink_options.Rate = 10.0,
    act: mavlink_options.Act = False,
    check: Annotated[
        bool,
        typer.Option("--check", help="Listen for 10 s, tell what would keep it from flying, end."),
    ] = False,
    download: Annotated[
        Path | None,
        typer.Option(
            help="Write the autopilot's mission, fence and rally points to this file, a plan; end."
        ),
    ] = None,
    ask: Annotated[
        bool, typer.Option("--ask", help="Ask for streams and parameters even if read-only.")
    ] = False,
    signing_key: mavlink_options.SigningKey = None,
    system: mavlink_options.System = 1,
    component: mavlink_options.Component = 1,
    icao: mavlink_options.Icao = None,
    traffic_margin_m: mavlink_options.TrafficMargin = 0.0,
    fan_deg: mavlink_options.Fan = 0.0,
    heartbeat_s: mavlink_options.Heartbeat = 3.0,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="End after so many seconds; default: Ctrl-C.")
    ] = None,
    end_on_arrival: Annotated[
        bool, typer.Option("--end-on-arrival", help="End at the last goal instead of holding it.")
    ] = False,
    speedup: Annotated[
        float, typer.Option(min=0.1, help="Of a simulated vehicle's clock against ours.")
    ] = 1.0,
    lock_step: mavlink_options.LockStep = False,
    hand: mavlink_options.Hand = True,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the log of decisions and the summary.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Decide live for an autopilot over MAVLink: read-only, unless --act lets it fly."""
    from clearway.mavlink.dialect import dialect

    dialect()
    if download is not None:
        from clearway.io.results_folder import refuse_unwritable_file

        refuse_unwritable_file(download, "--download")
        _download(connect, download, signing_key, system, component)
        return
    if mission is None:
        raise typer.BadParameter("a mission is needed, but for --download")
    from clearway.mavlink.setup import SessionOptions, read_led_mission, set_up_mavlink

    file = read_led_mission(mission, say)
    folder = None
    if out is not None:
        from clearway.io.results_folder import ResultsFolder

        folder = ResultsFolder.check(out, "mavlink", file.mission.name)
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
        speedup=None if lock_step else speedup,
        ask=ask or check,
    )
    from clearway.mavlink.hand import begin_mavlink_hand

    loop, link = set_up_mavlink(file, options, say)
    if check:
        _check(loop, link, duration, as_json=as_json)
        return
    with ExitStack() as stack:
        stack.callback(link.close)
        stop = stack.enter_context(stop_rule(duration, arrival=end_on_arrival))
        begin = partial(begin_mavlink_hand, loop, link, key=signing_key, wanted=hand, notice=say)
        result = _run(loop, link, stop, file, rate, folder, stack, begin, as_json=as_json)
    if not _is_good(result):
        leave(NOT_REACHED)


def _check(
    loop: Loop, link: MavlinkLink[Session], duration: float | None, *, as_json: bool
) -> None:
    """Listen and ask for a while, and tell what is wrong; exit status 1 where anything is."""
    from clearway.mavlink.check import LINK_CHECK_S, problems

    lasts = LINK_CHECK_S if duration is None else duration
    with ExitStack() as stack:
        stack.callback(link.close)
        loop.run(lambda elapsed_s, _outcome: elapsed_s >= lasts, lambda _outcome: None)
        found = problems(link, time.monotonic())
        heard = link.inbox.report_heard(time.monotonic())
    escape = link.session.core.system.escape
    if as_json:
        print_json(add_sources({"messages": heard, "missing": found, **escape.to_json()}))
    else:
        told = [
            f"{one['messages']} {name} at {one['rate_hz']:.1f} Hz" for name, one in heard.items()
        ]
        print("\n".join([f"received   {', '.join(told) or 'nothing'}", str(escape), *found]))
        print("all is there" if not found else f"{len(found)} to be mended before --act")
    if found:
        leave(NOT_REACHED)


def _download(
    connect: str, path: Path, signing_key: Path | None, system: int, component: int
) -> None:
    """Mission, fence and rally points as a flight plan."""
    from clearway.mavlink.download import HeardOn, download, write_plan
    from clearway.mavlink.setup import frames_only

    link, inbox, outbox = frames_only(connect, signing_key, system, component)
    try:
        say(f"listening on {link.name}")
        heard = HeardOn(link, inbox)
        lists = download(heard, outbox.send, system, component, link.wait)
        heard.know_autopilot(outbox.send, (system, component), link.wait)
        write_plan(lists, path, heard.autopilot or 0, heard.home)
    finally:
        link.close()
    counted = ", ".join(f"{len(items)} {name}" for name, items in lists.items())
    print(f"{path}: {counted} items")


def _run(
    loop: Loop,
    link: MavlinkLink[Session],
    stop: Stop,
    file: MissionFile,
    rate: float,
    out: ResultsFolder | None,
    stack: ExitStack,
    begin_hand: Callable[..., None],
    *,
    as_json: bool,
) -> dict[str, Any]:
    """Run to the end and print the result; with a log in `out` if given, all of it or nothing."""
    from clearway.io.toml_writing import write_toml
    from clearway.mavlink.record import SessionRecord

    folder = None if out is None else stack.enter_context(out.write())
    log = None
    if folder is not None:
        write_toml(file.effective(), folder / "mission.toml")
        log = stack.enter_context((folder / "decisions.jsonl").open("w", encoding="utf-8"))
    begin_hand(log=None if log is None else log.fileno())
    record = SessionRecord(link.session, log, say)
    commentary = _Commentary(link.session.core)

    def take(outcome: TickOutcome) -> None:
        record.take(outcome)
        commentary.show(outcome)

    report = loop.run(stop, take)
    if sys.stderr.isatty():
        say("")
    result = add_sources(record.summary(report, link.inbox, link.outbox, rate))
    # Before the log is put in its place, which a full disk may refuse.
    if as_json:
        print_json(result)
    else:
        print(_in_words(result), flush=True)
    if folder is not None:
        (folder / "summary.json").write_text(json.dumps(result, indent=2) + "\n")
    return result


class _Commentary:
    """Tells changes in lines; on a terminal the present moment stands below them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._terminal = sys.stderr.isatty()
        self._mode, self._doing = "", ""
        self._told = ("", "")
        self._told_s = self._shown_s = -math.inf

    def show(self, outcome: TickOutcome) -> None:
        """A line where the state of the link changed, or the mode has, once a second at most."""
        for note in outcome.notes:
            print(f"{outcome.time_s:.1f} s  {note}", file=sys.stderr, flush=True)
        if outcome.flight is not None:
            self._mode, self._doing = outcome.flight.mode, outcome.flight.explanation
        now = time.monotonic()
        present = (str(outcome.state), self._mode)
        new_mode = present != self._told and now >= self._told_s + 1.0
        if present[0] != self._told[0] or new_mode:
            self._told, self._told_s = present, now
            self._print(outcome, "\n")
        elif self._terminal and now >= self._shown_s + 0.25:
            self._shown_s = now
            self._print(outcome, "")

    def _print(self, outcome: TickOutcome, end: str) -> None:
        autopilot = self._session.status or "no autopilot heard"
        why = f" ({outcome.why_state})" if outcome.why_state else ""
        doing = f"; {self._doing}" if self._doing else ""
        text = f"{outcome.time_s:.1f} s  {outcome.state}{why}; {autopilot}{doing}"
        if self._terminal:
            text = "\r\x1b[K" + text[: shutil.get_terminal_size().columns - 1]
        print(text, end=end, file=sys.stderr, flush=True)


def _is_good(result: dict[str, Any]) -> bool:
    """Acting: arrived. Read-only: decisions were taken, and the link was good to the end."""
    if result["acting"]:
        return bool(result["reached"])
    return result["decisions"] > 0 and result["state"] in GOOD


def _in_words(result: dict[str, Any]) -> str:
    counted = (
        ("received", result["received"]),
        ("refused", result["refused"]),
        ("left out", result["left_out"]),
        ("sent", result["sent"]),
    )
    decision, tick = result["decision_ms"], result["tick_ms"]
    times = "".join(f", {name} {ms} ms" for name, ms in decision.items() if ms is not None)
    lines = [
        f"mission    {result['mission']}, {'acting' if result['acting'] else 'read-only'}",
        f"reached    {'yes' if result['reached'] else 'NO'}, "
        f"{result['waypoints_reached']} waypoints; the link at the end: {result['state']}",
        f"escape     {result['escape_mode']}: {result['escape_why']}",
        f"decisions  {result['decisions']}, emergencies {result['emergencies']}{times}",
        f"ticks      {result['ticks']} at {result['rate_hz']:g} Hz, {result['late']} late, "
        f"{result['skipped']} skipped, p99 {tick['p99']} ms, max {tick['max']} ms",
    ]
    for title, counts in counted:
        told = ", ".join(f"{number} {name}" for name, number in sorted(counts.items()))
        lines.append(f"{title:<10} {told or 'nothing'}")
    return "\n".join(lines)
