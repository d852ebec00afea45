"""The guardian's two links: the autopilot on one, the commander on the other."""

from __future__ import annotations

import math
import select
import time
from collections import Counter
from dataclasses import dataclass, replace

from clearway.live.guard.guard_session import GuardSession, looking_past
from clearway.live.link.loop import Loop
from clearway.live.link.outcome import TickOutcome
from clearway.mavlink.check import problems
from clearway.mavlink.guard_session import COMMANDS, GuardMavlinkSession
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.links import FrameLink, open_link
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.outbox import Outbox, Packer
from clearway.mavlink.setup import (
    SessionOptions,
    clear,
    make_mavlink_terms,
    notice_escape,
    sensor_of,
    warn,
)
from clearway.mavlink.signing import SignatureCheck, read_key
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import Notice, prepare


@dataclass(frozen=True, slots=True)
class GuardTerms:
    """What the command line says of wishes."""

    commands: str
    """Where they come from: an address as for --connect."""
    wish_s: float = 0.5
    """A wish counts for so long after it came."""
    hold_s: float = 0.5
    """For so long it is verified to be flown on."""
    acceleration_mps2: float | None = None
    """At which the vehicle changes its velocity; None for its own, or a cautious one."""


@dataclass(slots=True)
class GuardMavlinkLink:
    """A `live.link.outcome.Link`."""

    autopilot: MavlinkLink[GuardSession]
    session: GuardMavlinkSession
    commands: FrameLink
    commanded: Inbox

    def hear(self, wall_s: float) -> None:
        self.autopilot.hear(wall_s)
        for arrival in self.commanded.take(self.commands.receive()):
            self.session.take_wish(arrival, wall_s)

    def tick(self, wall_s: float) -> TickOutcome:
        outcome = self.autopilot.tick(wall_s)
        guarded = outcome.guarded
        if guarded is None:
            return outcome
        return replace(outcome, why_now=guarded.why)

    def missing(self) -> list[str]:
        """What keeps it from guarding, in words: of the autopilot's link, and of commands."""
        found = problems(self.autopilot, time.monotonic())
        if not self.session.core.tally["wishes"]:
            came = sum(self.commanded.received.values())
            none = f"{came} commands, none of them usable" if came else "no command"
            found.append(f"{none} on {self.commands.name}")
        return found

    def wait(self, seconds: float) -> None:
        ends = [self.autopilot.frames, self.commands]
        select.select(ends, [], [], max(0.0, seconds))

    def end(self, *, crashed: bool = False) -> None:
        self.autopilot.end(crashed=crashed)

    def close(self) -> None:
        self.commands.close()
        self.autopilot.close()


def set_up_mavlink_guard(
    file: MissionFile, options: SessionOptions, terms: GuardTerms, notice: Notice
) -> tuple[Loop, GuardMavlinkLink]:
    """Everything loaded and opened; raises InputError for what cannot be used."""
    key = None if options.signing_key is None else read_key(options.signing_key)
    counts: Counter[str] = Counter()
    frames = open_link(options.connect, counts)
    try:
        commands = open_link(terms.commands, counts, "--commands")
    except BaseException:
        frames.close()
        raise
    try:
        acting = "acting" if options.act else "read-only: --act sends set-points"
        notice(f"autopilot on {frames.name}, commands on {commands.name}, {acting}")
        warn(options, key, notice)
        setup = prepare(file, notice)
        for note in setup.notes:
            notice(note)
        sensor = sensor_of(file, setup, math.radians(options.fan_deg))
        setup = replace(setup, sensors=() if sensor is None else (sensor,))
        setup.refuse_coarse_beams()
        guardian = setup.guardian(terms.hold_s, terms.acceleration_mps2)
        notice(guardian.braking)
        notice_escape(guardian.escape, sensor, notice)
        over = make_mavlink_terms(file, setup, options)
        over = replace(over, session=looking_past(over.session))
        core = GuardSession(guardian, sensor, over.session, counts, wish_s=terms.wish_s)
        session = GuardMavlinkSession(core, sensor, over, counts)
        check = None if key is None else SignatureCheck(key)
        outbox = Outbox(Packer(options.system, key=key, check=check), frames.send)
        ids = (options.system, options.component)
        inbox = Inbox(*ids, check, stream=frames.stream, is_ours=outbox.is_ours)
        commanded = Inbox(
            *ids,
            None if key is None else SignatureCheck(key),
            stream=commands.stream,
            kept=COMMANDS,
            from_any=tuple(COMMANDS),
        )
        clear(frames, counts)
        clear(commands, counts)
        link = GuardMavlinkLink(
            MavlinkLink(frames, inbox, session, outbox), session, commands, commanded
        )
        return Loop(link, core, 1.0 / options.rate_hz, at_once=True), link
    except BaseException:
        frames.close()
        commands.close()
        raise
