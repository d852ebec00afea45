"""Recordings with messages amid them that are empty or broken: counted, left out, read on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import InputError
from clearway.io.scans.scan_formats import read_points
from clearway.io.scans.sequences import open_scans
from clearway.io.scans.usable import LeftOut
from recordings_for_tests import (
    POINTS,
    Maker,
    bag1,
    mcap2,
    types_of,
)
from robot_messages import Message, Types

Break = Callable[[Types], Any]


def changed(**values: Any) -> Break:
    """A cloud with some of its fields as no sensor has them."""

    def make(types: Types) -> Any:
        message = types.cloud2(1.0, "lidar", POINTS)
        for name, value in values.items():
            setattr(message, name, value)
        return message

    return make


def no_fields(types: Types) -> Any:
    message = types.cloud2(1.0, "lidar", POINTS)
    message.fields = []
    return message


def odd_field(types: Types) -> Any:
    message = types.cloud2(1.0, "lidar", POINTS)
    message.fields[1].datatype = 99
    return message


KINDS: dict[str, tuple[Break, str, str]] = {
    "0 x 0": (lambda types: types.cloud2(1.0, "lidar", np.zeros((0, 3))), "without a point", ""),
    "0 x 0, no fields": (
        changed(height=0, width=0, fields=[], data=np.zeros(0, np.uint8), point_step=0),
        "without a point",
        "",
    ),
    "NaN only": (
        lambda types: types.cloud2(1.0, "lidar", np.full((4, 3), np.nan)),
        "without a point",
        "4 not finite",
    ),
    "zeros only": (
        lambda types: types.cloud2(1.0, "lidar", np.zeros((4, 3))),
        "without a point",
        "4 at the sensor's origin",
    ),
    "point_step 0": (changed(point_step=0), "damaged", "point_step is 0"),
    "no fields": (no_fields, "damaged", "no field x, y, z among none"),
    "an odd field": (odd_field, "damaged", "datatype 99"),
    "data too short": (changed(data=np.zeros(17, np.uint8)), "damaged", "17 bytes of data"),
    "width beyond all data": (changed(width=2**31), "damaged", "bytes need"),
    "another frame": (
        lambda types: types.cloud2(1.0, "rear", POINTS), "damaged", "its frame is 'rear'"
    ),
    "too wide for a scan": (
        lambda types: types.cloud2(1.0, "lidar", 1e5 * POINTS), "damaged", "more than a scan can"
    ),
}  # fmt: skip


def with_one(maker: Maker, folder: Path, broken: Break) -> Path:
    """Three scans with a broken one amid them, and own places."""
    types = types_of(maker)
    messages = []
    for n in range(4):
        cloud = broken(types) if n == 1 else types.cloud2(1.0 + n, "lidar", POINTS + n)
        cloud.header.stamp = types.stamp(1.0 + n)
        messages.append(Message("/points", 1.0 + n, cloud))
        messages.append(Message("/odom", 1.0 + n, types.odometry(1.0 + n, (float(n), 0.0, 2.0))))
    return maker(folder, messages)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("maker", [bag1, mcap2])
def test_one_broken_message_is_counted_and_the_rest_is_read(
    maker: Maker, kind: str, tmp_path: Path
) -> None:
    broken, reason, words = KINDS[kind]
    path = with_one(maker, tmp_path, broken)
    scans = cw.read_scans(path)
    assert [scan.index for scan in scans] == [0, 2, 3]
    assert scans.left_out == {reason: 1}
    assert reason in repr(scans)
    left_out = LeftOut()
    found = [left_out.read(scan) for scan in open_scans(path)]
    assert [one is not None for one in found] == [True, False, True, True]
    assert words in left_out.first[reason]
    assert "scan 1" in left_out.first[reason]
    with pytest.raises(InputError):
        cw.read_scan(path, 1)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "another frame"])
def test_the_first_one_may_be_broken_too(kind: str, tmp_path: Path) -> None:
    types = Types()
    messages = [
        Message("/points", 1.0, KINDS[kind][0](types)),
        Message("/points", 2.0, types.cloud2(2.0, "lidar", POINTS)),
    ]
    path = mcap2(tmp_path, messages)
    scan = cw.read_scan(path)
    assert scan.index == 1
    assert any("left out scan 0" in note for note in scan.notes)
    np.testing.assert_array_equal(read_points(path).points_m, POINTS)


def test_a_recording_of_which_nothing_can_be_used_is_an_error(tmp_path: Path) -> None:
    types = Types()
    broken = [KINDS[kind][0](types) for kind in ("0 x 0", "no fields", "NaN only")]
    path = mcap2(tmp_path, [Message("/points", 1.0 + n, one) for n, one in enumerate(broken)])
    for read in (cw.read_scan, cw.read_scans, read_points):
        with pytest.raises(InputError, match=r"none of its 3 scans .*2 without a point, 1 damaged"):
            read(path)


def test_a_frame_that_is_named_later_is_no_other_one(tmp_path: Path) -> None:
    types = Types()
    messages = [
        Message("/points", 1.0 + n, types.cloud2(1.0 + n, frame, POINTS))
        for n, frame in enumerate(("", "lidar", "/lidar"))
    ]
    assert len(list(cw.read_scans(mcap2(tmp_path, messages)))) == 3


def test_a_folder_is_read_past_a_broken_file(tmp_path: Path) -> None:
    for number in range(4):
        np.save(tmp_path / f"{number}.npy", POINTS + number)
    (tmp_path / "1.npy").write_bytes((tmp_path / "1.npy").read_bytes()[:-20])
    (tmp_path / "2.npy").write_bytes(b"")
    scans = cw.read_scans(tmp_path)
    assert [scan.index for scan in scans] == [0, 3]
    assert scans.left_out == {"damaged": 2}
