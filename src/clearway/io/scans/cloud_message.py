"""ROS messages that hold points, made into arrays [n, 3] in metres of the message's frame.

sensor_msgs/PointCloud2 in all its layouts, the old sensor_msgs/PointCloud, and the VoxelMap of
planning_ros_msgs. Nothing here needs ROS or a package that reads bags.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray

FIELD_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""Of sensor_msgs/PointField: INT8 to FLOAT64."""
AXES = ("x", "y", "z")
BEYOND_M = 1e6
"""No return comes from there."""
OCCUPIED = 100
"""Of a voxel map's data; 0 is free, -1 unknown."""
FLOAT_BYTES = 4
CDR_HEAD = 4
"""Bytes before the message itself that tell its byte order."""


class Header(NamedTuple):
    """What a stamped message begins with."""

    time_s: float
    """Zero where nobody set it."""
    frame: str
    end: int
    """Bytes up to its end."""
    order: str
    """Byte order of the message: "<" or ">"."""


def read_message_header(raw: bytes, ros2: bool) -> Header:
    """std_msgs/Header at the start of a serialised message; struct.error where it is cut off."""
    order = "<" if not ros2 or raw[1] & 1 else ">"
    start = CDR_HEAD if ros2 else FLOAT_BYTES  # ROS 1 begins with a sequence number
    seconds, nanoseconds, length = struct.unpack_from(f"{order}III", raw, start)
    text = raw[start + 12 : start + 12 + length]
    frame = text.rstrip(b"\0").decode("utf-8", "replace")
    return Header(seconds + 1e-9 * nanoseconds, frame, start + 12 + length, order)


def points_of_cloud2(message: Any) -> FloatArray:
    """[n, 3] of a sensor_msgs/PointCloud2, row by row; missing returns stay NaN.

    Any field type, offset, padding and byte order. Raises ValueError saying what is wrong.
    """
    return _stack(_columns_of_cloud2(message))


def returns_of_cloud2(message: Any) -> tuple[FloatArray, BoolArray | None]:
    """[m, 3] of the [n] points of a sensor_msgs/PointCloud2 that are returns, and which these are.

    None where all are. Some drivers tell missing returns as NaN, some as zeros; nothing is 1,000 km
    away. Raises as `points_of_cloud2`.
    """
    columns = _columns_of_cloud2(message)
    # Column by column and in their own type: this is looked at at every sweep.
    x, y, z = (np.abs(column) for column in columns)
    farthest = np.maximum(np.maximum(x, y), z)  # NaN where one of them is
    good = (farthest < BEYOND_M) & (farthest > 0.0)
    if good.all():
        return _stack(columns), None
    return _stack([column[good] for column in columns]), good


def _columns_of_cloud2(message: Any) -> list[npt.NDArray[Any]]:
    """x, y and z [n] each, of the floating type that the message has."""
    if not message.width or not message.height:  # some publish no fields then either
        return [np.zeros(0)] * len(AXES)
    view = np.ndarray(
        (message.height, message.width),
        _layout(message),
        np.ascontiguousarray(message.data, dtype=np.uint8).data,
        strides=(_row_bytes(message), message.point_step),
    )
    columns = [view[name].ravel() for name in AXES]
    return [one if one.dtype.kind == "f" else one.astype(np.float64) for one in columns]


def _stack(columns: Sequence[npt.NDArray[Any]]) -> FloatArray:
    points = np.empty((len(columns[0]), 3))
    with np.errstate(invalid="ignore"):
        for axis, column in enumerate(columns):
            points[:, axis] = column
    return points


def _layout(message: Any) -> np.dtype[Any]:
    """x, y and z within a point."""
    fields = {field.name.lower(): field for field in message.fields}
    missing = [name for name in AXES if name not in fields]
    if missing:
        names = ", ".join(field.name for field in message.fields) or "none"
        raise ValueError(f"no field {', '.join(missing)} among {names}")
    order = ">" if message.is_bigendian else "<"
    formats, offsets = [], []
    for name in AXES:
        field = fields[name]
        if field.datatype not in FIELD_TYPES:
            raise ValueError(f"field {name} has datatype {field.datatype}; valid: 1 to 8")
        formats.append(order + FIELD_TYPES[field.datatype])
        offsets.append(int(field.offset))
        end = offsets[-1] + np.dtype(formats[-1]).itemsize
        if end > message.point_step:
            raise ValueError(
                f"field {name} ends at byte {end} of a point, but point_step is "
                f"{message.point_step}"
            )
    return np.dtype(
        {
            "names": AXES,
            "formats": formats,
            "offsets": offsets,
            "itemsize": int(message.point_step),
        }
    )


def _row_bytes(message: Any) -> int:
    """Bytes from row to row; ValueError where the data are shorter than the rows."""
    wide = int(message.width) * int(message.point_step)
    step = int(message.row_step) if message.height > 1 and message.row_step >= wide else wide
    needed = (message.height - 1) * step + wide if message.height and message.width else 0
    if len(message.data) < needed:
        raise ValueError(
            f"{len(message.data)} bytes of data; {message.height} x {message.width} points of "
            f"{message.point_step} bytes need {needed}"
        )
    return step


def points_of_cloud(raw: bytes, ros2: bool) -> FloatArray:
    """[n, 3] of a serialised sensor_msgs/PointCloud: three float32 a point, its channels to the
    side.

    Read as bytes, since a message object for each of 100,000 points takes a second. Raises
    ValueError where it is cut off.
    """
    header = read_message_header(raw, ros2)
    start = header.end
    if ros2:  # aligned from after the CDR head
        start += -(start - CDR_HEAD) % FLOAT_BYTES
    (count,) = struct.unpack_from(f"{header.order}I", raw, start)
    room = (len(raw) - start - FLOAT_BYTES) // (3 * FLOAT_BYTES)
    if room < count:
        raise ValueError(f"{count} points promised, room for {room}")
    values = np.frombuffer(raw, f"{header.order}f4", 3 * count, start + FLOAT_BYTES)
    return values.reshape(-1, 3).astype(np.float64)


def points_of_voxels(message: Any) -> FloatArray:
    """[n, 3] middles of the occupied voxels of a planning_ros_msgs/VoxelMap.

    Raises ValueError where the data do not fill the map's dimensions.
    """
    size = tuple(round(getattr(message.dim, axis)) for axis in AXES)
    data = np.asarray(message.data, dtype=np.int8)
    if min(size) < 0 or len(data) != size[0] * size[1] * size[2]:
        raise ValueError(f"{len(data)} voxels, not {' x '.join(map(str, size))}")
    z, y, x = np.nonzero(data.reshape(size[::-1]) >= OCCUPIED)
    origin = np.array([getattr(message.origin, axis) for axis in AXES])
    middles: FloatArray = origin + (np.stack([x, y, z], axis=-1) + 0.5) * float(message.resolution)
    return middles
