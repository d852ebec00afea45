"""The autopilot's mission, fence and rally points as a flight plan, and what a check tells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.base.errors import InputError
from clearway.mavlink.check import problems
from clearway.mavlink.download import HeardOn, download, write_plan
from clearway.mavlink.inbox import Inbox, ReceivedMessage
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.outbox import Outbox, Packer
from clearway.missions.mission_file import read_mission_file
from mavlink_for_tests import (
    Bench,
    attitude,
    distances,
    framed,
    heartbeat,
    in_the_air,
    origin,
    position,
)
from simulated_flight import Wire


def item(kind: int, seq: int, command: int, place: Any, *params: float) -> Any:
    told = [*params, 0.0, 0.0, 0.0, 0.0][:4]
    frame = 0 if kind == 0 and seq == 0 else 3
    return mavlink.MAVLink_mission_item_int_message(
        255, 196, seq, frame, command, 0, 1, *told,
        round(place[0] * 1e7), round(place[1] * 1e7), place[2], kind,
    )  # fmt: skip


HOME = (52.0, 4.3, 10.0)
LISTS = {
    0: [
        item(0, 0, 16, HOME),
        item(0, 1, 22, (52.0, 4.3, 20.0)),
        item(0, 2, 16, (52.002, 4.3, 30.0)),
        item(0, 3, 16, (52.002, 4.304, 30.0)),
    ],
    1: [
        *(
            item(1, n, 5001, place, 4.0)
            for n, place in enumerate(
                [(51.99, 4.29, 0), (52.01, 4.29, 0), (52.01, 4.32, 0), (51.99, 4.32, 0)]
            )
        ),
        item(1, 4, 5004, (52.001, 4.302, 0), 30.0),
    ],
    2: [item(2, 0, 5100, (52.0005, 4.3005, 25.0))],
}


class Autopilot:
    """Its side of the mission protocol; every third question is lost."""

    def __init__(self, lists: Any = LISTS) -> None:
        self.lists, self.asked, self.time_s = lists, 0, 0.0
        self.acknowledged: list[int] = []
        self._answers: list[Any] = []

    def send(self, messages: list[Any]) -> None:
        for message in messages:
            self.asked += 1
            kind = message.mission_type
            if message.get_type() == "MISSION_ACK":
                self.acknowledged.append(kind)
            elif self.asked % 3 == 0:
                continue
            elif message.get_type() == "MISSION_REQUEST_LIST":
                count = len(self.lists[kind])
                told = mavlink.MAVLink_mission_count_message(255, 196, count, kind)
                self._answers.append(ReceivedMessage(told, 44, None))
            else:
                self._answers.append(ReceivedMessage(self.lists[kind][message.seq], 73, None))

    def receive(self) -> list[ReceivedMessage]:
        answers, self._answers = self._answers, []
        return answers

    def wait(self, seconds: float) -> None:
        self.time_s += seconds


def test_what_an_autopilot_has_becomes_a_mission_that_can_be_flown(tmp_path: Path) -> None:
    autopilot = Autopilot()
    lists = download(
        autopilot.receive, autopilot.send, 1, 1, autopilot.wait, lambda: autopilot.time_s
    )
    assert {name: len(items) for name, items in lists.items()} == {
        "mission": 4, "fence": 5, "rally": 1,
    }  # fmt: skip
    assert autopilot.acknowledged == [0, 1, 2]
    path = tmp_path / "taken.plan"
    write_plan(lists, path)
    mission = read_mission_file(str(path))
    assert mission.mission.origin_geodetic[:2] == pytest.approx(HOME[:2])
    goals = np.array(mission.mission.waypoints_m)
    assert goals[-1] == pytest.approx([274.6, 222.6, 30.0], abs=1.0)
    assert len(mission.obstacle) >= 5


def test_a_mission_of_px4_has_no_home_and_counts_from_0(tmp_path: Path) -> None:
    unstated = -(2**31) * 1e-7
    lists = {
        "mission": [
            item(0, 0, 22, (unstated, unstated, 20.0)),
            item(0, 1, 16, (52.002, 4.3, 30.0)),
            item(0, 2, 16, (52.002, 4.304, 30.0)),
            item(0, 3, 177, (0.0, 0.0, float("nan")), 1.0, 1.0),
        ],
        "fence": [],
        "rally": [],
    }
    lists["mission"][0].frame, lists["mission"][3].frame = 3, 2
    path = tmp_path / "taken.plan"
    write_plan(lists, path, 12, [*HOME])
    mission = read_mission_file(str(path)).mission
    assert mission.origin_geodetic == pytest.approx(HOME)
    assert len(mission.waypoints_m) == 4, "the jump leads from the last place to the second item"
    write_plan(lists, path, 12)
    assert read_mission_file(str(path)).mission.origin_geodetic[:2] == (52.002, 4.3)


def test_which_autopilot_it_is_and_its_home_are_heard() -> None:
    class Port(Wire):
        def answer_to(self, peer: Any) -> None:
            del peer

    port, asked, time_s = Port(), [], 0.0

    def send(messages: list[Any]) -> None:
        asked.extend(messages)
        home = mavlink.MAVLink_home_position_message(
            520_000_000, 43_000_000, 10_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0
        )
        port.to_autopilot.append((framed(home), ("127.0.0.1", 1)))

    def wait(seconds: float) -> None:
        nonlocal time_s
        time_s += seconds

    heard = HeardOn(port, Inbox(1, 1, None, stream=False))
    port.to_autopilot = [(framed(heartbeat(autopilot=12)), ("127.0.0.1", 1))]
    heard.know_autopilot(send, (1, 1), wait, lambda: time_s)
    assert heard.autopilot == 12
    assert heard.home == pytest.approx(HOME)
    assert [one.get_type() for one in asked] == ["COMMAND_LONG"]
    silent = HeardOn(Port(), Inbox(1, 1, None, stream=False))
    silent.know_autopilot(send, (1, 1), wait, lambda: time_s)
    assert silent.autopilot is None


def test_an_autopilot_without_a_mission_is_told() -> None:
    empty = Autopilot({0: [], 1: [], 2: []})
    with pytest.raises(InputError, match="gives no mission"):
        download(empty.receive, empty.send, 1, 1, empty.wait, lambda: empty.time_s)
    silent = Autopilot()
    silent.send = lambda _messages: None  # type: ignore[method-assign]
    with pytest.raises(InputError, match="gives no mission"):
        download(silent.receive, silent.send, 1, 1, silent.wait, lambda: silent.time_s)


def test_a_check_names_what_is_missing_and_nothing_where_all_is_there() -> None:
    bench = Bench(sensor=False, act=False, asks=True, airborne=False)
    wire = Wire()
    link = MavlinkLink(wire, bench.inbox, bench.session, Outbox(Packer(1), wire.send))
    assert problems(link, 1000.0) == ["no heartbeat of the autopilot"]
    bench.tick(1.0, heartbeat(), attitude(1.0))
    said = problems(link, 1001.0)
    assert any("LOCAL_POSITION_NED" in words for words in said)
    assert any("GUID_TIMEOUT" in words for words in said)
    home = mavlink.MAVLink_home_position_message(
        520_000_000, 43_000_000, -90_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0
    )
    timeout = mavlink.MAVLink_param_value_message(b"GUID_TIMEOUT", 1.0, 9, 1, 0)
    all_there = (heartbeat(), origin(), home, in_the_air(1), timeout)
    bench.tick(1.1, *all_there, attitude(1.1), position(1.1))
    assert problems(link, 1001.1) == []


def test_questions_go_to_the_autopilot_whoever_else_sends_to_the_port() -> None:
    class Port(Wire):
        def __init__(self) -> None:
            super().__init__()
            self.peers: list[Any] = []

        def answer_to(self, peer: Any) -> None:
            self.peers.append(peer)

    port, autopilot, sensor = Port(), ("127.0.0.1", 1), ("127.0.0.1", 2)
    port.to_autopilot = [
        (framed(heartbeat()), autopilot),
        (framed(distances(1.0), component=158), sensor),
    ]
    told = HeardOn(port, Inbox(1, 1, None, stream=False))()
    assert len(told) == 2
    assert port.peers == [autopilot]
