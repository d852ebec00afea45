"""Clouds from another process into a node: `python -m benchmarks.ros2 --minutes 10`.

A robot publishes clouds at a rate, and own places, on the loopback interface, and flies down a
street as the node, `clearway ros2`, tells it. Printed is how many clouds were lost and where, how
long it took from the stamp of a cloud to the path that was decided on it, and the node's CPU and
memory.

Over real rclpy it runs by a Python of ROS, which `make ros` sets up and which does not find
clearway by itself: `PYTHONPATH=src .venv-ros/kilted/bin/python -m benchmarks.ros2 --node rclpy
--robot rclpy`.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/>"
    "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers>"
    "</Discovery></Domain></CycloneDDS>"
)
MISSION = """
[mission]
name = "clouds"
waypoints_m = [[2000.0, 0.0, 0.0]]

[vehicle]
kind = "inertialess"
speed_mps = 1.0

[safety]
margin_m = 0.6

[[lidar]]
name = "front"
beams_per_cell = [20, 10]
max_range_m = 10.0
"""
PARAMETERS = """
/**:
  ros__parameters:
    mission: mission.toml
    act: true
    ground_m: -4.0
    set_points: {{target: {{topic: target, type: Twist, frame: map}}}}
    clouds: {{front: {{topic: points, reliable: {reliable}}}}}
"""
ON_THIS_MACHINE = {
    "CYCLONEDDS_URI": LOOPBACK,
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "ROS_STATIC_PEERS": "127.0.0.1",
}
OWN_HZ = 100.0
STEP_M, ROWS = 0.016, 100
"""Of the street's returns, along it; and how many rows of them there are."""
CLOUD, ODOMETRY = "sensor_msgs/msg/PointCloud2", "nav_msgs/msg/Odometry"
PATH, DIAGNOSTICS = "nav_msgs/msg/Path", "diagnostic_msgs/msg/DiagnosticArray"
STRING, TARGET = "std_msgs/msg/String", "geometry_msgs/msg/Twist"


def main() -> None:
    """Measure one or both ways, and print a line of JSON for each."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ros2", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--hz", type=float, default=10.0)
    parser.add_argument("--domain", type=int, default=98)
    parser.add_argument("--only", choices=("reliable", "best-effort"))
    for side in ("node", "robot"):
        parser.add_argument(f"--{side}", choices=("dds", "rclpy"), default="dds")
    options = parser.parse_args()
    os.environ |= ON_THIS_MACHINE | {"ROS_DOMAIN_ID": str(options.domain)}
    for way in ("reliable", "best-effort"):
        if options.only in (None, way):
            print(json.dumps(measured(options, way == "reliable")), flush=True)


def measured(options: argparse.Namespace, reliable: bool) -> dict[str, Any]:
    """One run."""
    load, drops = os.getloadavg()[0], _dropped()
    with tempfile.TemporaryDirectory() as name, _node(Path(name), options, reliable) as node:
        listener = _Listener(_open_bus(options.node, options, "listener"))
        spawn = multiprocessing.get_context("spawn")  # DDS does not survive a fork.
        heard, over = spawn.Event(), spawn.Event()
        robot = spawn.Process(target=_fly, args=(options, reliable, heard, over), daemon=True)
        robot.start()
        if not heard.wait(400.0):
            raise SystemExit("the node does not listen")
        cpu, began = _cpu_s(node.pid), time.monotonic()
        while robot.is_alive() and not over.is_set():
            listener.take(0.05)
        lasted_s = time.monotonic() - began
        if node.poll() is not None:
            raise SystemExit("the node ended before the clouds did; above, it says why")
        cpu, memory = _cpu_s(node.pid) - cpu, _peak_mb(node.pid)
        time.sleep(1.0)
        node.send_signal(signal.SIGINT)
        told = json.loads(node.communicate(timeout=60)[0])
        robot.join(10.0)
        listener.bus.close()
    points = told["topics"]["/points"]
    sent = round(60.0 * options.minutes * options.hz)
    came = points["messages"]
    return {
        "way": "reliable" if reliable else "best effort",
        "robot": options.robot,
        "node": options.node,
        "points": options.points,
        "sent": sent,
        "came": came,
        "lost_percent": round(100.0 * (1.0 - came / sent), 3),
        "not_usable": points["not_usable"],
        "lost_on_the_way": told["lost"].get("/points", 0),
        "datagrams_dropped": _dropped() - drops,
        "stamp_to_path_ms": _spread(listener.path_ms),
        "cloud_age_at_decision_ms": _spread(listener.age_ms),
        "decisions": len(listener.path_ms),
        "ticks": told["ticks"],
        "node_cpu_percent": round(100.0 * cpu / lasted_s, 1),
        "node_memory_mb": memory,
        "load_before": round(load, 2),
        "load_after": round(os.getloadavg()[0], 2),
        "cores": os.cpu_count(),
    }


@contextmanager
def _node(
    folder: Path, options: argparse.Namespace, reliable: bool
) -> Iterator[subprocess.Popen[str]]:
    (folder / "mission.toml").write_text(MISSION)
    (folder / "p.yaml").write_text(PARAMETERS.format(reliable=str(reliable).lower()))
    words = ["-m", "clearway", "ros2", str(folder / "p.yaml"), "--backend", options.node, "--json"]
    node = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True)
    try:
        yield node
    finally:
        node.kill()
        node.communicate()


def _open_bus(side: str, options: argparse.Namespace, name: str) -> Any:
    from clearway.ros2.dds import DdsBus
    from clearway.ros2.rclpy_bus import RclpyBus

    return DdsBus(options.domain) if side == "dds" else RclpyBus.on_own_node(name, "")


class _Listener:
    """Hears what the node decides."""

    def __init__(self, bus: Any) -> None:
        from clearway.ros2.bus import LATCHED

        self.bus = bus
        self.bus.subscribe("/clearway/plan", PATH, LATCHED)
        self.bus.subscribe("/clearway/decision", STRING, LATCHED)
        self._path_s: dict[float, float] = {}
        self.path_ms: list[float] = []
        self.age_ms: list[float] = []

    def take(self, seconds: float) -> None:
        from clearway.ros2.messages import unpack_cdr

        self.bus.wait(seconds)
        now = time.time()
        for one in self.bus.take():
            if one.type == PATH:
                stamp = unpack_cdr(one.raw, one.type).header.stamp
                self._path_s[round(stamp.sec + 1e-9 * stamp.nanosec, 3)] = now
                continue
            row = json.loads(unpack_cdr(one.raw, one.type).data)
            if row["scan_age_s"] is None:
                continue
            came_s = self._path_s.pop(round(row["time_s"], 3), now)
            self.path_ms.append(1e3 * (came_s - (row["time_s"] - row["scan_age_s"])))
            self.age_ms.append(1e3 * row["scan_age_s"])


def _fly(options: argparse.Namespace, reliable: bool, heard: Any, over: Any) -> None:
    """Clouds and own places, from when the node listens on; it is wherever it is led."""
    from clearway.ros2.bus import SENSOR, USUAL, Quality
    from clearway.ros2.messages import make_message, pack_message, unpack_cdr
    from clearway.ros2.told import header, make_stamp, point

    bus = _open_bus(options.robot, options, "robot")
    bus.advertise("/odom", ODOMETRY, SENSOR)
    bus.advertise("/points", CLOUD, Quality(reliable=reliable, depth=5))
    bus.subscribe("/target", TARGET, USUAL)
    bus.subscribe("/diagnostics", DIAGNOSTICS, USUAL)
    cloud, table = _cloud(options.points)
    along_m = table[:, 0].copy()
    own = make_message(
        "nav_msgs/msg/Odometry", header=header(0.0, "map"), child_frame_id="base_link"
    )
    own.pose.pose.orientation.w = 1.0
    place, velocity = np.zeros(3), np.zeros(3)
    while not any(one.topic == "/diagnostics" for one in bus.take()):
        time.sleep(0.05)  # It ticks: before, it starts its second process.
    heard.set()
    due, every = time.monotonic(), round(OWN_HZ / options.hz)
    clouds = round(60.0 * options.minutes * options.hz)
    for number in range(every * clouds):
        for one in bus.take():
            if one.topic == "/target":
                fast = unpack_cdr(one.raw, one.type).linear
                velocity = np.array([fast.x, fast.y, fast.z])
        place = place + velocity / OWN_HZ
        stamp = make_stamp(time.time())
        if number % every == 0:
            table[:, 0] = along_m - place[0] % STEP_M
            cloud.header.stamp = stamp
            bus.publish("/points", pack_message(cloud))
        own.header.stamp = stamp
        own.pose.pose.position = point(place)
        own.twist.twist.linear.x = float(np.linalg.norm(velocity))
        bus.publish("/odom", pack_message(own))
        due += 1.0 / OWN_HZ
        time.sleep(max(0.0, due - time.monotonic()))
    over.set()
    bus.close()


def _cloud(points: int) -> tuple[Any, Any]:
    """The walls of a street, 16 bytes a return, and the [n, 4] table behind the message."""
    from clearway.ros2.messages import make_message
    from clearway.ros2.told import header

    columns = points // ROWS
    along, up = np.meshgrid(
        STEP_M * (np.arange(columns) - columns // 2), np.linspace(-3.0, 3.0, ROWS), indexing="ij"
    )
    table = np.zeros((columns * ROWS, 4), dtype="<f4")
    table[:, 0], table[:, 2] = along.ravel(), up.ravel()
    table[:, 1] = np.where(np.arange(len(table)) % 2, 5.0, -5.0)
    fields = [
        make_message("sensor_msgs/msg/PointField", name=name, offset=4 * at, datatype=7, count=1)
        for at, name in enumerate("xyz")
    ]
    message = make_message(
        CLOUD, header=header(0.0, "base_link"), height=1, width=len(table), fields=fields,
        point_step=16, row_step=16 * len(table), data=table.view(np.uint8).reshape(-1),
    )  # fmt: skip
    return message, table


def _spread(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    return {f"p{p}": round(float(np.percentile(values, p)), 1) for p in (50, 95, 100)}


def _dropped() -> int:
    from clearway.ros2.kernel import count_dropped_datagrams

    return count_dropped_datagrams() or 0


def _cpu_s(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _peak_mb(process: int) -> float:
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    peak = next(line for line in lines if line.startswith("VmHWM"))
    return round(int(peak.split()[1]) / 1024.0, 1)


if __name__ == "__main__":
    main()
