"""`clearway mavlink` as a user runs it: flights of a simulated autopilot, read-only, bad input."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from typer.testing import CliRunner

from clearway.base.errors import InputError
from clearway.cli.app import app
from clearway.live.link.outcome import TickOutcome
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.links import Address, open_link
from mavlink_for_tests import (
    KEY,
    OTHER_KEY,
    Bench,
    aircraft,
    attitude,
    distances,
    framed,
    heartbeat,
    origin,
    position,
)
from own_process import run_clearway
from repository import REPOSITORY
from simulated_flight import looped

EXAMPLE = REPOSITORY / "examples/missions/mavlink.toml"
MARGIN_M = 0.6


def command() -> str:
    found = shutil.which("clearway", path=Path(sys.executable).parent)
    assert found is not None
    return found


@contextlib.contextmanager
def listening(*arguments: str | Path) -> Any:
    """The command in its own process, and the port that it took."""
    running = subprocess.Popen(
        [command(), "mavlink", *map(str, arguments), "--connect", "udpin:127.0.0.1:0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert running.stderr is not None
        line = running.stderr.readline()
        assert line.startswith("listening on udpin:127.0.0.1:"), line
        yield running, int(line.split(":")[2].split(",")[0])
    finally:
        running.kill()
        running.communicate()


def test_a_simulated_autopilot_is_flown_round_a_pillar_and_an_aircraft(tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_text(KEY.hex())
    more = ("--act", "--lock-step", "--end-on-arrival", "--duration", "150", "--rate", "5")
    more += ("--heartbeat-s", "30")
    with listening(EXAMPLE, *more, "--signing-key", key, "--out", tmp_path / "out", "--json") as (
        running,
        port,
    ):
        # The vehicle starts once it is listened to: the flight is the same each time.
        first = ""
        while "waiting; " not in first:
            first = running.stderr.readline()
            assert first, "ended before it listened"
        assert "waiting; no autopilot heard" in first
        vehicle = subprocess.run(
            [
                *(sys.executable, "-m", "clearway.mavlink.simulated", str(EXAMPLE)),
                *("--connect", f"udpout:127.0.0.1:{port}", "--lock-step", "--rate", "5"),
                *("--signing-key", str(key), "--duration", "200"),
            ],
            capture_output=True,
            text=True,
            check=False,
            timeout=170,
        )
        output, errors = running.communicate(timeout=30)
    assert vehicle.returncode == 0, vehicle.stderr
    assert running.returncode == 0, errors
    truth, told = json.loads(vehicle.stdout), json.loads(output)
    assert truth["arrived"]
    assert truth["from_goal_m"] < 0.5
    assert truth["nearest_obstacle_m"] >= MARGIN_M
    assert truth["nearest_intruder_m"] >= MARGIN_M
    assert truth["path_m"] > 24.2
    assert truth["heard"]["COLLISION"] >= 1
    assert any("avoidance" in text for text in truth["texts"])
    for change in ("flying; armed, follows set-points", "arrived; "):
        assert change in errors
    assert told["reached"]
    assert told["state"] == "arrived"
    assert told["emergencies"] == 0
    assert told["refused"] == {}
    assert truth["refused"] == {}
    assert told["sent"]["SET_POSITION_TARGET_LOCAL_NED"] >= 100
    log = (tmp_path / "out/decisions.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in log]
    assert sum("mode" in row for row in rows) == told["decisions"]
    assert json.loads((tmp_path / "out/summary.json").read_text()) == told
    assert (tmp_path / "out/mission.toml").exists()


class Telemetry(threading.Thread):
    """A vehicle that flies straight on, slowly, and whatever else is on the link."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.port, self.done = port, threading.Event()
        self.heard: Counter[str] = Counter()

    def run(self) -> None:
        began = time.monotonic()
        codec = mavlink.MAVLink(None)
        flood = [framed(aircraft(number)) for number in range(100)]
        while not self.done.wait(0.05):
            t = 5.0 + 0.1 * (time.monotonic() - began)
            where = position(t, (0, t - 5.0, -5))
            good = framed(heartbeat(), origin(), attitude(t), where, distances(t), key=KEY)
            others = [
                framed(position(t, (900, 900, 0)), key=OTHER_KEY),
                framed(position(t, (900, 900, 0))),
                framed(heartbeat(), system=9, key=KEY),
                framed(aircraft(), key=KEY)[:-4],
                b"nothing of the kind",
                *flood,
            ]
            for piece in (good, *others):
                self.socket.sendto(piece, ("127.0.0.1", self.port))
            with contextlib.suppress(BlockingIOError):
                while True:
                    frame = bytearray(self.socket.recv(4096))
                    self.heard[codec.decode(frame).get_type()] += 1
        self.socket.close()


@pytest.mark.realtime
@pytest.mark.nightly
def test_read_only_listens_decides_and_is_silent_among_bad_frames(tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_bytes(KEY)
    # The vehicle's clock at a tenth of ours: a busy machine makes nothing stale.
    slow = ("--speedup", "0.1", "--rate", "100", "--heartbeat-s", "30")
    with listening(EXAMPLE, "--duration", "2", "--signing-key", key, *slow) as (
        running,
        port,
    ):
        vehicle = Telemetry(port)
        vehicle.start()
        output, errors = running.communicate(timeout=60)
        vehicle.done.set()
        vehicle.join()
    assert running.returncode == 0, errors
    assert set(vehicle.heard) == {"HEARTBEAT"}
    lines = {line[:10].strip(): line[11:] for line in output.splitlines()}
    assert lines["mission"] == "mavlink, read-only"
    assert lines["reached"].startswith("NO, 0 waypoints; the link at the end: ")
    for reason in ("unsigned", "wrong signature", "another system", "truncated", "bytes of no"):
        assert reason in lines["refused"]
    assert "LOCAL_POSITION_NED" in lines["received"]
    assert lines["sent"].split()[1:] == ["HEARTBEAT"]


@pytest.mark.realtime
def test_a_check_tells_what_comes_how_often_and_what_is_missing(tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_bytes(KEY)
    with listening(EXAMPLE, "--check", "--duration", "3", "--signing-key", key, "--json") as (
        running,
        port,
    ):
        vehicle = Telemetry(port)
        vehicle.start()
        output, errors = running.communicate(timeout=60)
        vehicle.done.set()
        vehicle.join()
    assert running.returncode == 1, errors
    told = json.loads(output)
    assert {"HEARTBEAT", "ATTITUDE", "LOCAL_POSITION_NED"} <= set(told["messages"])
    attitude_told = told["messages"]["ATTITUDE"]
    assert attitude_told["messages"] >= 5
    assert 1.0 < attitude_told["rate_hz"] < 25.0
    assert 0.0 <= attitude_told["age_s"] < 3.0
    assert any("was received" in words for words in told["missing"]), "no parameters were"


def run(*arguments: str | Path) -> Any:
    """A run within this process: quick, and otherwise the same."""
    return CliRunner().invoke(app, ["mavlink", *map(str, arguments)])


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--connect", "tcp:127.0.0.1:5760"], "no address; valid: udpin:HOST:PORT"),
        (["--connect", "udpin:127.0.0.1"], "no address"),
        (["--connect", "udpin:127.0.0.1:99999"], "above 65535"),
        (["--connect", "udpin:203.0.113.1:14550"], "cannot be opened"),
        (["--connect", "serial:/dev/nothing"], "cannot be opened: No such file"),
        (["--connect", "serial:/dev/null:57600"], "no serial line"),
        (["--connect", "udpin:127.0.0.1:0", "--icao", "xyz"], "six hexadecimal digits"),
        (["--connect", "udpin:127.0.0.1:0", "--signing-key", "none"], "none: cannot be read"),
        (["--connect", "udpin:127.0.0.1:0", "--rate", "0"], "--rate"),
    ],
)
def test_bad_input_is_told_in_a_line(arguments: list[str], problem: str, tmp_path: Path) -> None:
    with contextlib.chdir(tmp_path):
        done = run(EXAMPLE, *arguments)
    assert done.exit_code == 2
    assert problem in done.output
    assert "Traceback" not in done.output
    assert not list(tmp_path.iterdir())


def test_what_lets_others_steer_is_said(tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_bytes(KEY)
    key.chmod(0o644)
    at_hand = ("--connect", "udpin:127.0.0.1:0", "--duration", "0.1", "--act")
    done = run(EXAMPLE, *at_hand, "--signing-key", key)
    assert "key: others than its owner can read the key" in done.output
    assert "can mislead the vehicle" not in done.output
    everywhere = ("--connect", "udpin:0.0.0.0:0", "--duration", "0.1", "--act")
    open_to_all = run(EXAMPLE, *everywhere)
    assert "can mislead the vehicle" in open_to_all.output
    # Nobody is there, which is no good end.
    assert open_to_all.exit_code == 1
    assert "the link at the end: waiting" in open_to_all.output
    assert "sent       nothing" in open_to_all.output


def test_a_mission_that_is_none_is_refused_before_anything_is_opened() -> None:
    done = run("no-such-mission", "--connect", "udpin:127.0.0.1:0")
    assert done.exit_code == 2
    assert "no such mission" in done.output
    assert "listening" not in done.output


def test_without_pymavlink_the_extra_is_named() -> None:
    done = run_clearway("mavlink", EXAMPLE, "--connect", "udpin:127.0.0.1:0", absent="pymavlink")
    assert done.returncode == 2
    assert done.stderr == (
        "a MAVLink link needs an optional package: pip install 'clearway[mavlink]'\n"
    )


# --- the loop -----------------------------------------------------------------------------------


@pytest.mark.realtime
def test_ticks_that_come_late_are_counted_and_left_out() -> None:
    counts: Counter[str] = Counter()
    bench, link = Bench(), open_link("udpin:127.0.0.1:0", counts)
    loop = looped(link, bench, 0.01)
    outcomes: list[TickOutcome] = []

    def slow(outcome: TickOutcome) -> None:
        outcomes.append(outcome)
        time.sleep(0.035)

    report = loop.run(lambda _elapsed, _outcome: len(outcomes) == 4, slow)
    link.close()
    assert report.ticks == report.late == len(report.tick_s) == 4
    # Three later ticks follow late ones, each at least two periods after it was due.
    assert report.skipped >= 6


class SlowVehicle:
    """A link to a vehicle in lock-step, one message at a time: it goes on when it is answered."""

    stream, name = False, "slow"

    def __init__(self, *moments: tuple[Any, ...]) -> None:
        self._moments = [[framed(message) for message in moment] for moment in moments]

    def wait(self, seconds: float) -> None:
        time.sleep(min(0.005, seconds))

    def receive(self) -> list[tuple[bytes, Any]]:
        return [(self._moments[0].pop(0), None)] if self._moments[0] else []

    def answer_to(self, peer: Any) -> None: ...

    def send(self, _data: bytes) -> bool:
        if not self._moments[0] and len(self._moments) > 1:
            self._moments.pop(0)
        return True

    def close(self) -> None: ...


def test_in_lock_step_a_tick_waits_for_the_own_position_of_its_time() -> None:
    bench = Bench(speedup=None)
    link = SlowVehicle(
        (heartbeat(), origin(), attitude(10.0), distances(10.0), position(10.0)),
        (attitude(10.2), distances(10.2), position(10.2, (0.0, 0.2, 0.0))),
    )
    loop = looped(link, bench, 0.2)
    ticks: list[tuple[float, float | None]] = []
    loop.run(
        lambda _elapsed, _outcome: len(ticks) == 2,
        lambda outcome: ticks.append((outcome.time_s, bench.session.core.own_s)),
    )
    assert ticks == [(10.0, 10.0), (10.2, 10.2)]


def test_the_loop_ends_when_the_autopilot_restarts() -> None:
    bench, link = Bench(), open_link("udpin:127.0.0.1:0", Counter())
    bench.all_well(100.0)
    now = time.monotonic()
    for n in range(5):
        bench.tell(now, position(0.1 * n))
    loop = looped(link, bench, 0.01)
    report = loop.run(lambda _elapsed, _outcome: False, lambda _outcome: None)
    link.close()
    assert report.ticks == 1


# --- links --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("udpin:127.0.0.1:14550", Address("udpin", "127.0.0.1", 14550)),
        ("udpout:drone.local:14550", Address("udpout", "drone.local", 14550)),
        ("serial:/dev/ttyACM0:921600", Address("serial", "/dev/ttyACM0", 921600)),
        ("serial:/dev/ttyACM0", Address("serial", "/dev/ttyACM0", 57600)),
        ("/dev/ttyUSB0:115200", Address("serial", "/dev/ttyUSB0", 115200)),
    ],
)
def test_addresses(text: str, address: Address) -> None:
    assert Address.parse(text) == address


@pytest.mark.realtime
def test_a_serial_line_carries_frames_both_ways() -> None:
    ours, theirs = pty.openpty()
    counts: Counter[str] = Counter()
    link = open_link(f"serial:{os.ttyname(theirs)}:115200", counts)
    try:
        box = Inbox(1, 1, None, stream=link.stream)
        # Bytes that a terminal would swallow or change are in it: 3, 10, 13, 17, 19, 127.
        data = framed(heartbeat(custom_mode=0x0D0A0311), heartbeat(custom_mode=0x7F13))
        os.write(ours, b"\r\ngarbage" + data[:7])
        link.wait(2.0)
        assert box.take(link.receive()) == []
        os.write(ours, data[7:])
        link.wait(2.0)
        told = [arrival.message.custom_mode for arrival in box.take(link.receive())]
        assert told == [0x0D0A0311, 0x7F13]
        link.send(data)
        assert select.select([ours], [], [], 2.0)[0]
        assert os.read(ours, 4096) == data
        assert link.receive() == []
        assert not counts
    finally:
        link.close()
        os.close(ours)
        os.close(theirs)


def test_a_line_that_is_cut_is_counted_not_raised() -> None:
    ours, theirs = pty.openpty()
    counts: Counter[str] = Counter()
    link = open_link(f"serial:{os.ttyname(theirs)}", counts)
    os.close(theirs)
    os.close(ours)
    assert link.receive() == []
    link.send(b"x")
    link.close()
    assert counts == {"link: line is dead": 1, "link: not sent": 1}


def test_a_baud_that_there_is_not() -> None:
    ours, theirs = pty.openpty()
    with pytest.raises(InputError, match="baud 12345 is none of 9600, "):
        open_link(f"serial:{os.ttyname(theirs)}:12345", Counter())
    os.close(ours)
    os.close(theirs)


@pytest.mark.realtime
def test_udp_answers_whoever_it_is_told_to() -> None:
    counts: Counter[str] = Counter()
    link = open_link("udpin:127.0.0.1:0", counts)
    port = int(link.name.rsplit(":", 1)[1])
    link.send(b"too early")
    assert counts == {"link: nobody to send to": 1}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.settimeout(2.0)
        other.sendto(b"one", ("127.0.0.1", port))
        other.sendto(b"two", ("127.0.0.1", port))
        link.wait(2.0)
        pieces = link.receive()
        assert [data for data, _ in pieces] == [b"one", b"two"]
        link.answer_to(pieces[0][1])
        link.send(b"answer")
        assert other.recv(100) == b"answer"
    link.close()
