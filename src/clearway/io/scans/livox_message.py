"""Livox's own message (CustomMsg of livox_ros_driver, livox_ros_driver2, livox_interfaces).

std_msgs/Header header          uint32 offset_time  (ns after timebase)
uint64 timebase (ns)            float32 x, y, z     (metres, sensor frame)
uint32 point_num                uint8 reflectivity
uint8 lidar_id, uint8[3] rsvd   uint8 tag, uint8 line
CustomPoint[] points
"""

from __future__ import annotations

import struct

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.scans.cloud_message import CDR_HEAD, read_message_header

TYPES = tuple(
    f"{package}/msg/CustomMsg"
    for package in ("livox_ros_driver", "livox_ros_driver2", "livox_interfaces")
)
POINT_BYTES = 19
ALIGNED_BYTES = 20
PLACE_AT = 4
"""In ROS 1 points follow one another, in CDR each begins at a multiple of four."""
BEFORE_COUNT = 16
"""From `timebase` to the number of points."""


def points_of_livox(raw: bytes, ros2: bool) -> FloatArray:
    """[n, 3] of a serialised message; beams without a return are 0, 0, 0.

    Read as bytes, as `points_of_cloud` does. Raises ValueError where it is cut off.
    """
    header = read_message_header(raw, ros2)
    start = header.end
    if ros2:  # aligned from after the CDR head
        start += -(start - CDR_HEAD) % 8
    (count,) = struct.unpack_from(f"{header.order}I", raw, start + BEFORE_COUNT)
    first = start + BEFORE_COUNT + 4
    step = ALIGNED_BYTES if ros2 else POINT_BYTES
    if not count:  # an array may not begin behind its buffer
        return np.zeros((0, 3))
    needed = (count - 1) * step + POINT_BYTES
    if len(raw) - first < needed:
        raise ValueError(f"{count} points promised, room for {(len(raw) - first) // step}")
    view = np.ndarray(
        (count, 3), f"{header.order}f4", raw, offset=first + PLACE_AT, strides=(step, 4)
    )
    return view.astype(np.float64)
