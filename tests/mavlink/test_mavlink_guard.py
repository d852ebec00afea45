"""The guardian over MAVLink: set-points and sticks in, what may be flown of them out."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.base.state import State
from clearway.live.guard.guard_session import GuardSession
from clearway.live.guard.guardian import Guardian
from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.outcome import TickOutcome
from clearway.mavlink.dialect import EXTENDED_SYS_STATE
from clearway.mavlink.guard_link import GuardMavlinkLink
from clearway.mavlink.guard_session import COMMANDS, GuardMavlinkSession
from clearway.mavlink.inbox import Inbox, ReceivedMessage
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.mavlink_session import MavlinkTerms
from clearway.mavlink.outbox import Outbox, Packer
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from guarded_flights import planner_for
from mavlink_for_tests import (
    PEER,
    SET_POINT,
    attitude,
    framed,
    heartbeat,
    in_the_air,
    origin,
    position,
    sent,
    words,
)
from simulated_flight import Wire

WALL = ObstacleMap([Obstacle.cuboid([3.0, 0.0, 0.0], (1.0, 9.0, 9.0))])
"""In the east, from x = 2.5 on."""
VELOCITY = 0x5C7


def set_point(velocity: Any, mask: int = VELOCITY, frame: int = 1, **more: Any) -> Any:
    """Of a planner that is no component of the vehicle's."""
    fields = {"system": 1, "place": (0, 0, 0), "yaw_rate": 0.0} | more
    return mavlink.MAVLink_set_position_target_local_ned_message(
        77, fields["system"], 196, frame, mask, *map(float, fields["place"]),
        *map(float, velocity), 0.0, 0.0, 0.0, 0.0, fields["yaw_rate"],
    )  # fmt: skip


def sticks(x: int = 0, y: int = 0, z: int = 500, r: int = 0) -> Any:
    return mavlink.MAVLink_manual_control_message(1, x, y, z, r, 0)


class GuardedLink:
    """A session without a link or a clock."""

    def __init__(self, vehicle: str = "stops", act: bool = True) -> None:
        self.counts: Counter[str] = Counter()
        self.guardian = Guardian(
            planner_for(vehicle, "known"),
            State(np.zeros(3)),
            obstacle_map=WALL,
            acceleration_mps2=np.inf,
            hold_s=0.5,
        )
        terms = MavlinkTerms(session=SessionTerms(act=act, floor=FloorRule(0.6, -100.0)))
        core = GuardSession(self.guardian, None, terms.session, self.counts)
        self.session = GuardMavlinkSession(core, None, terms, self.counts)
        self.inbox = Inbox(1, 1, None, stream=False)
        self.commanded = Inbox(1, 1, None, stream=False, kept=COMMANDS, from_any=tuple(COMMANDS))
        self.session.take(ReceivedMessage(in_the_air(), EXTENDED_SYS_STATE, PEER), 0.0)

    def tick(
        self, number: int, command: Any = None, east_m: float = 0.0, mode: int = 128 | 8
    ) -> TickOutcome:
        """At rest, its nose in the east."""
        now = 1000.0 + 0.1 * number
        own = framed(
            heartbeat(mode), origin(), attitude(0.1 * number + 1.0),
            position(0.1 * number + 1.0, (0, east_m, 0), (0, 0, 0)),
        )  # fmt: skip
        for arrival in self.inbox.take([(own, PEER)]):
            self.session.take(arrival, now)
        if command is not None:
            raw = framed(command, system=255, component=190)
            for arrival in self.commanded.take([(raw, PEER)]):
                self.session.take_wish(arrival, now)
        return self.session.tick(now)


def test_a_velocity_passes_as_it_came() -> None:
    link = GuardedLink()
    assert not sent(link.tick(0), SET_POINT)
    out = link.tick(1, set_point((0.7, 0.1, 0.0), yaw_rate=0.4))
    assert out.guarded is not None
    assert out.guarded.passed
    (told,) = sent(out, SET_POINT)
    assert (told.vx, told.vy, told.yaw_rate) == pytest.approx((0.7, 0.1, 0.4))
    assert (told.type_mask, told.target_component) == (VELOCITY, 1)
    assert told.time_boot_ms != 77, "by the autopilot's clock"


def test_into_a_wall_it_does_not_and_a_sentence_says_why() -> None:
    link = GuardedLink()
    link.tick(0, east_m=1.88)
    out = link.tick(1, set_point((0.0, 1.0, 0.0)), 1.88)
    assert not out.guarded.is_wish
    (told,) = sent(out, SET_POINT)
    assert told.type_mask != VELOCITY, "a place too"
    assert told.vy <= 0.0
    assert "of the map" in words(out)
    for number in range(2, 80):
        out = link.tick(number, set_point((1.0, 0.0, 0.0)), 1.88)
        if "passes" in words(out):
            break
    assert "passes again" in words(out)


def test_commands_in_the_body_and_places() -> None:
    link = GuardedLink()
    link.tick(0, east_m=1.88)
    ahead = link.tick(1, set_point((0.5, 0.0, 0.0), frame=9), 1.88)
    assert not ahead.guarded.is_wish, "the nose is in the east"
    right = link.tick(2, set_point((0.0, 0.5, 0.0), frame=9), 1.88)
    assert right.guarded.passed
    assert right.guarded.velocity_mps == pytest.approx([0.0, -0.5, 0.0], abs=1e-6)
    place = link.tick(3, set_point((0, 0, 0), mask=0xDF8, place=(9, 0, 0)), 1.88)
    assert place.guarded.passed
    assert place.guarded.velocity_mps[1] > 0.9


def test_sticks_of_a_pilot() -> None:
    link = GuardedLink()
    link.tick(0)
    out = link.tick(1, sticks(y=-500, r=250))
    assert out.guarded.passed
    assert out.guarded.velocity_mps == pytest.approx([0.0, 0.5, 0.0], abs=1e-6)
    assert out.guarded.yaw_rate_rps == pytest.approx(-0.25)
    (told,) = sent(out, SET_POINT)
    assert (told.vx, told.vy, told.yaw_rate) == pytest.approx((0.5, 0.0, 0.25), abs=1e-6)
    assert link.tick(2, sticks(z=1000)).guarded.velocity_mps[2] > 0.1
    link.tick(3, sticks(x=32767))
    assert link.counts["wish: cannot be used"] == 1


def test_who_lets_go_of_all_is_held() -> None:
    link = GuardedLink()
    link.tick(0)
    link.tick(1, sticks(x=1000))
    for number in range(2, 20):
        out = link.tick(number)
    assert out.guarded.why.startswith("nobody wishes anything")
    assert sent(out, SET_POINT)


def test_another_mode_is_left_alone() -> None:
    """Nobody flies what is in hand: the next mode begins with nothing."""
    link = GuardedLink()
    link.tick(0)
    link.tick(1, sticks(x=300))
    assert link.guardian.held is not None
    out = link.tick(20, None, mode=128)
    assert link.guardian.held is None
    assert not sent(out, SET_POINT) or sent(out, SET_POINT)[0].type_mask & 0x38


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        (set_point((math.nan, 0, 0)), "wish: cannot be used"),
        (set_point((0, 0, 0), mask=0xFFF), "wish: cannot be used"),
        (set_point((1, 0, 0), frame=5), "wish: cannot be used"),
        (set_point((1, 0, 0), system=9), "wish: for another vehicle"),
    ],
)
def test_what_is_no_command_is_counted(command: Any, reason: str) -> None:
    link = GuardedLink()
    link.tick(0)
    out = link.tick(1, command)
    assert link.counts[reason] == 1
    assert out.guarded is None
    assert not sent(out, SET_POINT)


def test_a_vehicle_that_cannot_stop_takes_no_sticks() -> None:
    link = GuardedLink("flies on")
    link.tick(0, east_m=-40.0)
    out = link.tick(1, sticks(x=500), -40.0)
    assert link.counts["wish: sticks are not for a vehicle that cannot stop"] == 1
    assert "sticks are refused" in words(out), "the pilot is told"
    assert any('kind = "multirotor"' in note for note in out.notes)
    assert link.tick(2, set_point((1.0, 0.1, 0.0)), -40.0).guarded.velocity_mps[1] > 0.9


def test_what_is_missing_on_either_link_is_named() -> None:
    bench, wire = GuardedLink(), Wire()
    over = MavlinkLink(wire, bench.inbox, bench.session, Outbox(Packer(1), wire.send))
    link = GuardMavlinkLink(over, bench.session, wire, bench.commanded)
    assert link.missing() == ["no heartbeat of the autopilot", "no command on wire"]
    bench.tick(0, set_point((math.nan, 0, 0)))
    assert "no heartbeat of the autopilot" not in link.missing()
    assert "1 commands, none of them usable on wire" in link.missing()
    bench.tick(1, sticks(y=-500))
    assert not [words for words in link.missing() if "command" in words]


def test_read_only_sends_no_set_points() -> None:
    link = GuardedLink(act=False)
    link.tick(0)
    out = link.tick(1, set_point((0.7, 0.1, 0.0)))
    assert out.guarded.passed
    assert not sent(out, SET_POINT)
