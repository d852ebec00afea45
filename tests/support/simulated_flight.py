"""Flights of the simulated autopilot within one process: no sockets, no clocks, no waiting."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.loop import Loop
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.session import Session
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.mavlink_session import MavlinkSession, MavlinkTerms
from clearway.mavlink.outbox import Outbox, Packer
from clearway.mavlink.setup import sensor_of
from clearway.mavlink.simulated_autopilot import SimulatedAutopilot
from clearway.mavlink.simulated_habits import Habits
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup

AHEAD_S = 1000.0
"""Of our clock before the vehicle's."""


class Wire:
    """Both ends of a link, as the autopilot and the inbox see them."""

    stream, name = False, "wire"

    def __init__(self) -> None:
        self.told: list[tuple[bytes, Any]] = []
        self.to_autopilot: list[tuple[bytes, Any]] = []

    def receive(self) -> list[tuple[bytes, Any]]:
        pieces, self.to_autopilot = self.to_autopilot, []
        return pieces

    def send(self, data: bytes) -> bool:
        self.told.append((data, ("127.0.0.1", 1)))
        return True

    def answer_to(self, _peer: Any) -> None: ...

    def wait(self, _seconds: float) -> None: ...

    def close(self) -> None: ...


class SimulatedFlight:
    """A mission flown for the simulated autopilot, tick by tick."""

    def __init__(
        self,
        file: MissionFile,
        setup: FlightSetup,
        habits: Habits | None = None,
        *,
        act: bool = True,
        rate_hz: float = 10.0,
        fan_deg: float = 0.0,
        **terms: Any,
    ) -> None:
        self.counts: Counter[str] = Counter()
        sensor = sensor_of(file, setup, np.radians(fan_deg))
        setup = replace(setup, sensors=() if sensor is None else (sensor,))
        self.wire, self.period_s = Wire(), 1.0 / rate_hz
        floor = FloorRule(
            file.safety.margin_m,
            file.rules.floor_m,
            stays_level=setup.planner.automaton.stays_level,
        )
        session = SessionTerms(act=act, lead_s=0.5 / rate_hz, **({"floor": floor} | terms))
        over = MavlinkTerms(asks=act, session=session)
        core = Session(setup.system(), sensor, session, self.counts)
        self.session = MavlinkSession(core, sensor, over, self.counts)
        self.inbox = Inbox(1, 1, None, stream=False)
        self.packer = Packer(1)
        self.autopilot = SimulatedAutopilot(file, setup, self.wire, None, habits)
        self._rng = np.random.default_rng(self.autopilot.habits.seed)
        self._late: list[tuple[float, bytes, Any]] = []
        self.outcomes: list[TickOutcome] = []
        self.leads_m: list[float] = []
        """How far set-points were from where the vehicle was."""
        self.hold_leads_m: list[float] = []
        """The same of those to hold, tick by tick; 0 for others, and where the mode ignores it."""

    @property
    def wall_s(self) -> float:
        return AHEAD_S + self.autopilot.time_s

    def step(self) -> TickOutcome:
        """Tell, hear, tick, answer, fly on."""
        self.autopilot.tell()
        jitter_s = self.autopilot.habits.jitter_s
        for data, peer in self.wire.told:
            late_s = float(self._rng.uniform(0.0, jitter_s)) if jitter_s else 0.0
            self._late.append((self.wall_s + late_s, data, peer))
        self.wire.told.clear()
        here = [(data, peer) for at_s, data, peer in self._late if at_s <= self.wall_s + 1e-9]
        self._late = [entry for entry in self._late if entry[0] > self.wall_s + 1e-9]
        for arrival in self.inbox.take(here):
            self.session.take(arrival, self.wall_s)
        outcome = self.session.tick(self.wall_s)
        self.outcomes.append(outcome)
        self._measure_lead(outcome)
        self._answer(outcome.messages)
        self.autopilot.fly(self.autopilot.time_s + self.period_s)
        return outcome

    def _measure_lead(self, outcome: TickOutcome) -> None:
        held_m = 0.0
        if outcome.set_point is not None:
            ahead = outcome.set_point.position_m - self.autopilot.truth.position_m
            lead_m = float(np.linalg.norm(ahead))
            if outcome.set_point.velocity_mps is not None:
                self.leads_m.append(lead_m)
            elif self.autopilot.follows:
                held_m = lead_m
        self.hold_leads_m.append(held_m)

    def end(self) -> None:
        """As the command does when it is told to end."""
        self._answer(self.session.farewell(self.wall_s))

    def run(self, until_s: float) -> None:
        """Until it has arrived, or for so long by the autopilot's time."""
        while self.autopilot.time_s < until_s and not self.autopilot.has_arrived:
            self.step()

    @property
    def states(self) -> list[str]:
        """One after the other."""
        told = [str(outcome.state) for outcome in self.outcomes]
        return [state for n, state in enumerate(told) if n == 0 or told[n - 1] != state]

    def _answer(self, messages: Any) -> None:
        for message in messages:
            self.wire.to_autopilot.append((self.packer.pack(message), ("127.0.0.1", 2)))
        self.autopilot.listen()


def looped(link: Any, bench: Any, period_s: float) -> Loop:
    """A bench's session on a link, in the command's loop."""
    over = MavlinkLink(link, bench.inbox, bench.session, Outbox(Packer(1), link.send))
    return Loop(over, bench.session.core, period_s)
