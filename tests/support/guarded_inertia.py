"""Flights of a simulated copter with inertia that somebody commands, guarded, in one process."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.base.frames import ned_from_enu
from clearway.live.guard.guard_session import GuardSession
from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.outcome import TickOutcome
from clearway.mavlink.guard_session import COMMANDS, GuardMavlinkSession
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.mavlink_session import MavlinkTerms
from clearway.mavlink.outbox import Packer
from clearway.mavlink.setup import sensor_of
from clearway.mavlink.simulated_autopilot import SimulatedAutopilot
from clearway.mavlink.simulated_habits import Habits
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from simulated_flight import AHEAD_S, Wire

VELOCITY = 0x5C7
"""Type mask: velocity and yaw rate count."""
TILTS = Habits(tilt_s=0.15, acceleration_mps2=4.5)
"""A copter that is a little stronger than it is taken to be."""


class GuardedCopter:
    """A wish a tick, by where the vehicle is."""

    def __init__(
        self,
        file: MissionFile,
        setup: FlightSetup,
        wish: Callable[[float, np.ndarray], np.ndarray],
        habits: Habits = TILTS,
        rate_hz: float = 20.0,
    ) -> None:
        self.counts: Counter[str] = Counter()
        sensor = sensor_of(file, setup, np.radians(30.0))
        setup = replace(setup, sensors=() if sensor is None else (sensor,))
        self.wire, self.period_s, self.wish = Wire(), 1.0 / rate_hz, wish
        floor = FloorRule(file.safety.margin_m, file.rules.floor_m)
        terms = SessionTerms(act=True, lead_s=0.5 / rate_hz, floor=floor)
        self.guardian = setup.guardian(0.5, None)
        core = GuardSession(self.guardian, sensor, terms, self.counts)
        self.session = GuardMavlinkSession(
            core, sensor, MavlinkTerms(asks=True, session=terms), self.counts
        )
        self.inbox, self.packer = Inbox(1, 1, None, stream=False), Packer(1)
        self.commanded = Inbox(1, 1, None, stream=False, kept=COMMANDS, from_any=tuple(COMMANDS))
        self.pilot = Packer(255)
        self.autopilot = SimulatedAutopilot(file, setup, self.wire, None, habits)
        self.outcomes: list[TickOutcome] = []
        self.track: list[np.ndarray] = []

    @property
    def wall_s(self) -> float:
        return AHEAD_S + self.autopilot.time_s

    def step(self) -> TickOutcome:
        self.autopilot.tell()
        told, self.wire.told = self.wire.told, []
        for arrival in self.inbox.take(told):
            self.session.take(arrival, self.wall_s)
        command = self._command()
        for arrival in self.commanded.take([(self.pilot.pack(command), ("127.0.0.1", 3))]):
            self.session.take_wish(arrival, self.wall_s)
        outcome = self.session.tick(self.wall_s)
        self.outcomes.append(outcome)
        for message in outcome.messages:
            self.wire.to_autopilot.append((self.packer.pack(message), ("127.0.0.1", 2)))
        self.autopilot.listen()
        self.autopilot.fly(self.autopilot.time_s + self.period_s)
        self.track.append(self.autopilot.truth.position_m)
        return outcome

    def run(self, until_s: float) -> None:
        while self.autopilot.time_s < until_s:
            self.step()

    def _command(self) -> Any:
        velocity = self.wish(self.autopilot.time_s, self.autopilot.truth.position_m)
        return mavlink.MAVLink_set_position_target_local_ned_message(
            77, 1, 196, 1, VELOCITY, 0.0, 0.0, 0.0,
            *ned_from_enu(velocity).tolist(), 0.0, 0.0, 0.0, 0.0, 0.0,
        )  # fmt: skip
