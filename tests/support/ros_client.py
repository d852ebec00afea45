# mypy: disable-error-code="import-not-found"
"""A robot and a life-cycle client on rclpy, run by a Python that has it; prints JSON.

It goes where a Twist of the map leads it, sees a wall far away, and takes the node `clearway`
through its states.
"""

from __future__ import annotations

import json
import struct
import sys
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from sensor_msgs.msg import PointCloud2, PointField

STEP_S, CLOUD_STEPS = 0.02, 5


class Robot:
    def __init__(self) -> None:
        rclpy.init()
        self.node = rclpy.create_node("robot")
        self.odom = self.node.create_publisher(Odometry, "odom", 10)
        self.points = self.node.create_publisher(PointCloud2, "points", 10)
        self.node.create_subscription(Twist, "led", self.follow, 10)
        self.place, self.velocity = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.came, self.steps, self.due = 0, 0, time.monotonic()
        self.cloud = b"".join(struct.pack("<fff", 9.0, y / 10, z / 10)
                              for y in range(-20, 21) for z in range(-10, 11))  # fmt: skip

    def follow(self, told: Twist) -> None:
        self.came += 1
        self.velocity = [told.linear.x, told.linear.y, told.linear.z]

    def step(self) -> None:
        self.place = [
            at + STEP_S * fast for at, fast in zip(self.place, self.velocity, strict=True)
        ]
        own = Odometry(child_frame_id="base_link")
        own.header.frame_id = "map"
        own.header.stamp = self.node.get_clock().now().to_msg()
        at, linear = own.pose.pose.position, own.twist.twist.linear
        at.x, at.y, at.z = self.place
        linear.x, linear.y, linear.z = self.velocity
        self.odom.publish(own)
        if self.steps % CLOUD_STEPS == 0:
            count = len(self.cloud) // 12
            seen = PointCloud2(height=1, width=count, point_step=12, row_step=12 * count)
            seen.header.frame_id, seen.header.stamp = "base_link", own.header.stamp
            seen.data = self.cloud
            seen.fields = [PointField(name=axis, offset=4 * n, datatype=7, count=1)
                           for n, axis in enumerate("xyz")]  # fmt: skip
            self.points.publish(seen)
        self.steps += 1
        self.due += STEP_S
        while (left := self.due - time.monotonic()) > 0.0:
            rclpy.spin_once(self.node, timeout_sec=left)
        self.due = max(self.due, time.monotonic() - 1.0)

    def run(self, seconds: float) -> int:
        """How many set-points came meanwhile."""
        before, ends = self.came, time.monotonic() + seconds
        while time.monotonic() < ends:
            self.step()
        return self.came - before

    def ask(self, kind: Any, name: str, **fields: object) -> Any:
        client = self.node.create_client(kind, f"clearway/{name}")
        until = time.monotonic() + 60.0
        while not client.service_is_ready():
            if time.monotonic() > until:
                raise SystemExit(f"no service {name}")
            self.step()
        future = client.call_async(kind.Request(**fields))
        while not future.done():
            if time.monotonic() > until + 60.0:
                raise SystemExit(f"no answer of {name}")
            self.step()
        self.node.destroy_client(client)
        return future.result()

    def change(self, transition: int) -> bool:
        answer = self.ask(ChangeState, "change_state", transition=Transition(id=transition))
        return bool(answer.success)

    def state(self) -> str:
        return str(self.ask(GetState, "get_state").current_state.label)

    def set_rate(self, rate: float) -> tuple[bool, str]:
        value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=rate)
        asked = [ParameterMessage(name="rate", value=value)]
        (result,) = self.ask(SetParameters, "set_parameters", parameters=asked).results
        return result.successful, result.reason


def main() -> None:
    robot = Robot()
    told: dict[str, Any] = {}
    told["began"] = robot.state()
    told["parameters"] = list(robot.ask(ListParameters, "list_parameters").result.names)
    values = robot.ask(
        GetParameters, "get_parameters", names=["rate", "set_points.led.topic"]
    ).values
    told["values"] = [values[0].double_value, values[1].string_value]
    told["set_too_fast"] = robot.set_rate(1e6)
    told["set"] = robot.set_rate(20.0)
    told["configured"] = robot.change(Transition.TRANSITION_CONFIGURE)
    told["sent_inactive"] = robot.run(3.0)
    told["set_late"] = robot.set_rate(30.0)
    told["activated"] = robot.change(Transition.TRANSITION_ACTIVATE)
    told["sent_active"] = robot.run(5.0)
    told["flown_m"] = robot.place[0]
    told["deactivated"] = robot.change(Transition.TRANSITION_DEACTIVATE)
    robot.run(0.5)
    told["speed_after"] = sum(fast * fast for fast in robot.velocity) ** 0.5
    told["sent_after"] = robot.run(2.0)
    told["again"] = robot.change(Transition.TRANSITION_ACTIVATE)
    told["sent_again"] = robot.run(2.0)
    robot.change(Transition.TRANSITION_DEACTIVATE)
    told["cleaned"] = robot.change(Transition.TRANSITION_CLEANUP)
    robot.run(1.0)
    told["ended"] = robot.state()
    told["shut_down"] = robot.change(Transition.TRANSITION_UNCONFIGURED_SHUTDOWN)
    print(json.dumps(told))


def look_on() -> None:
    """Ask for nothing until set-points have come for a while."""
    robot, told = Robot(), {}
    until = time.monotonic() + 60.0
    while not robot.came and time.monotonic() < until:
        robot.step()
    told["sent"], told["state"] = robot.run(5.0), robot.state()
    told["flown_m"] = robot.place[0]
    told["shut_down"] = robot.change(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    print(json.dumps(told))


if __name__ == "__main__":
    look_on() if "--looks-on" in sys.argv else main()
