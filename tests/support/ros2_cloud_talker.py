"""Publishes clouds of many points at a rate, with odometry: python ... DOMAIN POINTS HZ SECONDS."""

from __future__ import annotations

import sys
import time

import numpy as np

from clearway.ros2.bus import SENSOR, USUAL
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import pack_message
from clearway.ros2.told import make_stamp
from ros2_for_tests import cloud


def main() -> None:
    domain, points, rate, seconds = (float(word) for word in sys.argv[1:5])
    bus = DdsBus(int(domain))
    kind = "sensor_msgs/msg/PointCloud2"
    bus.advertise("/loose", kind, SENSOR)
    bus.advertise("/sure", kind, USUAL)
    message = cloud(0.0, np.random.default_rng(1).uniform(1.0, 9.0, (int(points), 3)))
    until = time.monotonic() + 60.0
    while time.monotonic() < until and not (bus.subscribers("/loose") and bus.subscribers("/sure")):
        time.sleep(0.05)
    time.sleep(1.0)
    due = time.monotonic()
    for number in range(int(rate * seconds)):
        message.header.stamp = make_stamp(time.time())
        message.header.frame_id = str(number)
        bus.publish("/loose" if number % 2 else "/sure", pack_message(message))
        due += 1.0 / rate
        time.sleep(max(0.0, due - time.monotonic()))
    time.sleep(2.0)
    bus.close()


if __name__ == "__main__":
    main()
