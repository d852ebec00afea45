"""Messages with points: every layout that PointCloud2 allows, and every way in which it can lie."""

from __future__ import annotations

import struct
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.io.scans.cloud_message import (
    points_of_cloud,
    points_of_cloud2,
    points_of_voxels,
    read_message_header,
)
from robot_messages import Types, cloud2

POINTS = np.array([[1.0, 2.0, 3.0], [-4.5, 0.25, 0.0], [10.0, -2.0, 1.5], [7.0, 8.0, -9.0]])


@given(
    data=st.data(),
    types=st.tuples(*3 * [st.sampled_from(["f4", "f8", "i2", "i4", "u1", "u2", "i1", "u4"])]),
    big_endian=st.booleans(),
    height=st.sampled_from([1, 2, 4]),
    row_padding=st.integers(0, 5),
)
def test_any_layout_gives_the_points_back(
    data: Any, types: tuple[str, ...], big_endian: bool, height: int, row_padding: int
) -> None:
    order = data.draw(st.permutations(range(3)))
    gaps = data.draw(st.lists(st.integers(0, 7), min_size=4, max_size=4))
    offsets, end = [0, 0, 0], 0
    for axis in order:
        offsets[axis] = end + gaps[axis]
        end = offsets[axis] + int(types[axis][1])
    whole = np.abs(np.round(POINTS))
    message = cloud2(
        whole,
        types=types,
        offsets=offsets,
        point_step=end + gaps[3],
        height=height,
        row_padding=row_padding,
        big_endian=big_endian,
    )
    found = points_of_cloud2(message)
    np.testing.assert_array_equal(found, whole)
    assert found.flags.c_contiguous
    assert found.dtype == np.float64


def test_missing_returns_of_an_organised_cloud_stay_nan() -> None:
    points = POINTS.copy()
    points[1] = np.nan
    found = points_of_cloud2(cloud2(points, height=2, point_step=16))
    np.testing.assert_array_equal(found, points.astype(np.float32))


def test_doubles_keep_their_digits() -> None:
    points = np.array([[123456.789012345, 0.1, -0.3]])
    message = cloud2(points, types=("f8",) * 3, offsets=(0, 8, 16), point_step=24)
    np.testing.assert_array_equal(points_of_cloud2(message), points)


def test_a_cloud_without_points() -> None:
    assert points_of_cloud2(cloud2(np.zeros((0, 3)))).shape == (0, 3)


def changed(**values: Any) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(cloud2(POINTS)), **values})


@pytest.mark.parametrize(
    ("message", "problem"),
    [
        (cloud2(POINTS, names=("x", "y", "intensity")), "no field z among x, y, intensity"),
        (changed(fields=[]), "no field x, y, z among none"),
        (changed(data=cloud2(POINTS).data[:-1]), "47 bytes of data; 1 x 4 points .* need 48"),
        (changed(width=2**31), "need 25769803776"),
        (changed(point_step=11), "field z ends at byte 12 of a point, but point_step is 11"),
        (
            changed(fields=[SimpleNamespace(name=n, offset=0, datatype=9) for n in "xyz"]),
            "field x has datatype 9; valid: 1 to 8",
        ),
    ],
)
def test_messages_that_contradict_themselves(message: Any, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        points_of_cloud2(message)


@pytest.mark.parametrize("ros2", [True, False])
@pytest.mark.parametrize("frame", ["", "a", "ab", "abc", "velodyne"])
def test_the_old_cloud_of_both_serialisations(ros2: bool, frame: str) -> None:
    types = Types(ros2)
    raw = types.serialised(types.cloud(12.25, frame, POINTS))
    np.testing.assert_array_equal(points_of_cloud(raw, ros2), POINTS)
    header = read_message_header(raw, ros2)
    assert (header.time_s, header.frame) == (12.25, frame)
    with pytest.raises(ValueError, match="4 points promised, room for 3"):
        points_of_cloud(raw[:-13] if ros2 else raw[:-5], ros2)
    with pytest.raises(struct.error):
        read_message_header(raw[:9], ros2)


def test_the_old_cloud_of_a_big_endian_machine() -> None:
    frame = b"lidar\0"
    raw = b"\0\0\0\0" + struct.pack(">III", 7, 500_000_000, len(frame)) + frame + bytes(2)
    raw += struct.pack(">I6f", 2, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    np.testing.assert_array_equal(points_of_cloud(raw, True), [[1, 2, 3], [4, 5, 6]])
    assert read_message_header(raw, True).time_s == 7.5


def voxels(data: Any, size: tuple[int, int, int]) -> SimpleNamespace:
    return SimpleNamespace(
        dim=SimpleNamespace(x=float(size[0]), y=float(size[1]), z=float(size[2])),
        origin=SimpleNamespace(x=1.0, y=-2.0, z=0.5),
        resolution=0.2,
        data=np.asarray(data, dtype=np.int8),
    )


def test_occupied_voxels_are_points_in_their_middles() -> None:
    data = np.zeros((4, 3, 2), dtype=np.int8)  # z, y, x
    data[3, 1, 0] = 100
    data[0, 2, 1] = 100
    data[1, 1, 1] = -1
    found = points_of_voxels(voxels(data.ravel(), (2, 3, 4)))
    np.testing.assert_allclose(found, [[1.3, -1.5, 0.6], [1.1, -1.7, 1.2]])
    with pytest.raises(ValueError, match="24 voxels, not 2 x 3 x 5"):
        points_of_voxels(voxels(data.ravel(), (2, 3, 5)))
