"""Whoever has no key cannot end a signed link, however much they send, nor make it work more."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.live.link.link_state import LinkState
from clearway.live.link.loop import Loop
from clearway.live.link.outcome import TickOutcome
from clearway.mavlink.guard_session import COMMANDS
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.links import open_link
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.outbox import Outbox, Packer
from clearway.mavlink.signing import OLDEST_S, TICKS_PER_S, SignatureCheck, signing_time
from clearway.mavlink.wire import GARBAGE, MOST_FLAWS, MOST_FRAMES, OVERLONG, frames_in
from free_ports import free_port
from mavlink_for_tests import (
    KEY,
    OTHER_KEY,
    PEER,
    Bench,
    attitude,
    distances,
    framed,
    heartbeat,
    origin,
    position,
)

SUPPORT = Path(__file__).parents[1] / "support"
GUARDED = """
[mission]
name = "guarded"
waypoints_m = [[40, 0, 5]]

[vehicle]
kind = "inertialess"
position_m = [0, 0, 5]
speed_mps = 1.0
"""
LOST = {LinkState.LINK_LOST, LinkState.STALE, LinkState.POSITION_LOST, LinkState.SENSOR_LOST}
RATE, SECONDS = 5_000, 3.0
TOLD_S = 0.02


def signed(box: Inbox, *pieces: bytes) -> list[str]:
    return [a.message.get_type() for a in box.take([(piece, PEER) for piece in pieces])]


def keyed(**more: object) -> Inbox:
    return Inbox(1, 1, SignatureCheck(KEY), stream=False, **more)  # type: ignore[arg-type]


FORGED = {
    "unsigned": framed(heartbeat(0)),
    "wrong key": framed(heartbeat(0), key=OTHER_KEY),
    "truncated": framed(heartbeat(0), key=KEY)[:-1],
    "magic": b"\xfd\xff\x01" * 1000,
    "zeros": b"\x00" * 4096,
}


@pytest.mark.parametrize("kind", FORGED)
@pytest.mark.parametrize("behind", [False, True])
def test_what_is_not_signed_takes_no_place_of_what_is(kind: str, behind: bool) -> None:
    box, packer = keyed(), Packer(1, 1, KEY)
    good = [packer.pack(heartbeat()) for _ in range(12)]
    flood = [FORGED[kind]] * 5_000
    found = signed(box, *(good + flood if behind else flood + good))
    assert found == ["HEARTBEAT"] * 12
    assert sum(box.refused.values()) >= 5_000


def test_replays_take_no_place_either() -> None:
    box, packer = keyed(), Packer(1, 1, KEY)
    old = packer.pack(heartbeat())
    assert signed(box, old) == ["HEARTBEAT"]
    good = [packer.pack(heartbeat()) for _ in range(12)]
    assert signed(box, *good, *[old] * 5_000) == ["HEARTBEAT"] * 12
    assert box.refused["old timestamp"] == 5_000


def test_a_forged_component_of_ours_warns_of_nothing() -> None:
    box = keyed(is_ours=lambda _: False)
    assert signed(box, framed(heartbeat(), component=196)) == []
    assert box.warnings == []
    assert signed(box, framed(heartbeat(), component=196, key=KEY)) == []
    assert len(box.warnings) == 1, "with the key it is another program of ours"


@pytest.mark.parametrize(
    "piece",
    [
        b"\xfd\x00\x00" * 1300,
        b"\xfd\x00\x02" * 1300,
        b"\xfe\x01" * 2000,
        b"\xfd\x05\x00\xfd" * 1000,
        framed(*([heartbeat()] * 190)),
    ],
)
def test_one_datagram_costs_so_much_and_no_more(piece: bytes) -> None:
    refused: Counter[str] = Counter()
    frames, rest = frames_in(piece, {0: 50}, refused, stream=False)
    assert rest == b""
    assert len(frames) <= MOST_FRAMES
    assert refused.pop(OVERLONG) == 1
    garbage = refused.pop(GARBAGE, 0)
    assert sum(refused.values()) <= MOST_FLAWS + MOST_FRAMES
    assert garbage < len(piece)


@contextmanager
def flooding(
    port: int, kind: str, folder: Path, seconds: float = SECONDS + 2.0
) -> Iterator[subprocess.Popen[str]]:
    """A process of its own that sends for some seconds."""
    codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    codec.signing.secret_key, codec.signing.sign_outgoing = KEY, True
    codec.signing.timestamp = signing_time() - 2 * OLDEST_S * TICKS_PER_S
    old = [bytes(one.pack(codec)) for one in (heartbeat(0), attitude(9e5), position(9e5))]
    (folder / "old").write_bytes(b"".join(bytes([len(one)]) + one for one in old))
    running = subprocess.Popen(
        [
            *(sys.executable, SUPPORT / "flooder.py", str(port), str(seconds)),
            *(str(RATE), kind, folder / "old"),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert running.stdout is not None
        assert running.stdout.readline() == "ready\n"
        yield running
    finally:
        running.kill()
        running.communicate()


class Vehicle(threading.Thread):
    """Tells where it is and what it sees, signed, over the same port."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.port, self.done, self.told = port, threading.Event(), 0
        self.packer = Packer(1, 1, KEY)

    def run(self) -> None:
        began = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not self.done.wait(TOLD_S):
                t = 5.0 + time.monotonic() - began
                where = position(t, (0.0, t - 5.0, 0.0))
                all_of_it = (heartbeat(), origin(), attitude(t), where, distances(t))
                for message in all_of_it:
                    sender.sendto(self.packer.pack(message), ("127.0.0.1", self.port))
                self.told += 1


@pytest.mark.realtime
@pytest.mark.parametrize("kind", ["all", pytest.param("unsigned", marks=pytest.mark.nightly)])
def test_a_flood_over_a_real_socket_leaves_the_link_up(kind: str, tmp_path: Path) -> None:
    bench, counts = Bench(key=KEY), Counter[str]()
    bench.all_well(1.0)  # loads what a decision needs
    bench = Bench(key=KEY)
    frames = open_link("udpin:127.0.0.1:0", counts)
    port = int(frames.name.rpartition(":")[2])
    link = MavlinkLink(
        frames, bench.inbox, bench.session, Outbox(Packer(1, key=KEY), lambda _: True)
    )
    vehicle, outcomes = Vehicle(port), list[TickOutcome]()
    vehicle.start()
    try:
        with flooding(port, kind, tmp_path) as flooder:
            time.sleep(0.5)
            assert flooder.poll() is None
            loop = Loop(link, bench.session.core, 0.1)
            loop.run(lambda passed_s, _: passed_s > SECONDS, outcomes.append)
            assert flooder.poll() is None, "it flooded all the while"
    finally:
        vehicle.done.set()
        vehicle.join()
        link.close()
    refused = sum(bench.inbox.refused.values())
    assert refused > 0.4 * RATE * SECONDS
    flown = [one.state for one in outcomes]
    flown = flown[flown.index(LinkState.FLYING) :]
    assert len(flown) > 5
    assert not LOST & set(flown)
    assert sum(one.set_point is not None for one in outcomes) > 5
    for name in ("HEARTBEAT", "LOCAL_POSITION_NED", "ATTITUDE", "OBSTACLE_DISTANCE"):
        assert bench.inbox.received[name] > 0.5 * SECONDS / TOLD_S * 0.5, name


def test_commands_of_who_has_the_key_come_through_a_flood() -> None:
    box = keyed(kept=COMMANDS, from_any=tuple(COMMANDS))
    stick = mavlink.MAVLink_manual_control_message(1, 100, 0, 500, 0, 0)
    packer = Packer(255, 190, KEY)
    flood = [framed(stick, system=number % 256) for number in range(5_000)]
    found = signed(box, packer.pack(stick), *flood, packer.pack(stick), *flood)
    assert found == ["MANUAL_CONTROL"] * 2
    assert dict(box.refused) == {"unsigned": 10_000}


@pytest.mark.realtime
@pytest.mark.nightly
def test_a_guardian_is_flown_through_floods_on_both_of_its_links(tmp_path: Path) -> None:
    """`clearway guard` in one process, the vehicle and its pilot in another, a flood in a third."""
    (tmp_path / "key").write_bytes(KEY)
    (tmp_path / "key").chmod(0o600)
    (tmp_path / "m.toml").write_text(GUARDED)
    autopilot, commands = free_port(), free_port()
    key = ("--signing-key", tmp_path / "key")
    guard = subprocess.Popen(
        [
            *(sys.executable, "-m", "clearway", "guard", tmp_path / "m.toml", *key, "--act"),
            *("--connect", f"udpin:127.0.0.1:{autopilot}"),
            *("--commands", f"udpin:127.0.0.1:{commands}", "--json"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert guard.stderr is not None
        while "waiting" not in (line := guard.stderr.readline()):
            assert line, "ended before it listened"
        with (
            flooding(autopilot, "all", tmp_path, 30.0),
            flooding(commands, "unsigned", tmp_path, 30.0),
        ):
            vehicle = subprocess.run(
                [
                    *(sys.executable, "-m", "clearway.mavlink.simulated", tmp_path / "m.toml"),
                    *("--connect", f"udpout:127.0.0.1:{autopilot}", *key, "--duration", "15"),
                    *("--pilot", f"udpout:127.0.0.1:{commands}"),
                ],
                capture_output=True,
                text=True,
                check=False,
                timeout=200,
            )
        guard.terminate()
        output, said = guard.communicate(timeout=60)
    finally:
        guard.kill()
        guard.communicate()
    assert vehicle.stdout, vehicle.stderr
    told = json.loads(output)
    for name in ("LOCAL_POSITION_NED", "OBSTACLE_DISTANCE", "SET_POSITION_TARGET_LOCAL_NED"):
        assert told["heard"][name] > 120, name
    assert told["passed"] > 60, said
    assert told["refused"]["unsigned"] > 10_000
    seen = json.loads(vehicle.stdout)
    assert seen["refused"] == {}
    assert seen["heard"]["SET_POSITION_TARGET_LOCAL_NED"] > 60
