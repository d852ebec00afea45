"""PCD files: every encoding, as other programs write them, damaged anywhere."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.io.scans.scan_formats import read_points
from clouds_for_tests import PCD_HEAD, POINTS, write_pcd


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_pcd_of_each_encoding(tmp_path: Path, encoding: str) -> None:
    cloud = read_points(write_pcd(tmp_path / "scan.pcd", POINTS, encoding))
    np.testing.assert_allclose(cloud.points_m, POINTS)
    assert cloud.points_m.flags.c_contiguous
    assert (cloud.unit, cloud.classes, dict(cloud.counts)) == ("metres", None, {})
    assert not cloud.survey


def test_pcd_of_one_ascii_point(tmp_path: Path) -> None:
    cloud = read_points(write_pcd(tmp_path / "one.pcd", POINTS[:1], "ascii"))
    np.testing.assert_allclose(cloud.points_m, POINTS[:1])


PCD_ROWS = "1 2 3\n-4.5 0.25 0\n10 -2 1.5\n"


@pytest.mark.parametrize(
    ("changes", "rows"),
    [
        ({"VERSION .7": "VERSION .5", "COUNT 1 1 1\n": "", "POINTS 3\n": ""}, PCD_ROWS),
        ({"VERSION .7": "VERSION 0.6", "VIEWPOINT 0 0 0 1 0 0 0\n": ""}, PCD_ROWS),
        ({"\n": "\r\n"}, PCD_ROWS.replace("\n", "\r\n")),
        ({"FIELDS": "# a comment\nFIELDS"}, PCD_ROWS.replace(" ", "\t").replace("\n", " \n\n")),
        ({"x y z": "X Y Z"}, PCD_ROWS.replace(" ", "  ")),
        ({}, PCD_ROWS + "9 9 9\n"),
        (
            {"x y z": "ring z _ y x", "4 4 4": "2 8 1 4 4", "F F F": "U F U I F",
             "1 1 1": "1 1 3 1 1"},
            "7 3 0 0 0 2 1\n4.2e+06 0 nan 0 0 0.25 -4.5\n1 1.5 0 0 0 -2 10\n",
        ),
    ],
)  # fmt: skip
def test_pcd_as_other_programs_write_it(tmp_path: Path, changes: dict[str, str], rows: str) -> None:
    head = PCD_HEAD
    for old, new in changes.items():
        head = head.replace(old, new)
    path = tmp_path / "SCAN.PCD"
    path.write_bytes((head + rows).encode())
    cloud = read_points(path)
    np.testing.assert_allclose(cloud.points_m, POINTS)
    assert ("the rest is left out" in " ".join(cloud.notes)) == ("9 9 9" in rows)


def test_pcd_with_fields_of_several_values_between_the_axes(tmp_path: Path) -> None:
    fields = [("a", "u1", (3,)), ("x", "<f8"), ("y", "<f4"), ("fpfh", "<f4", (33,)), ("z", "<i2")]
    records = np.zeros(3, np.dtype(fields))
    points = np.array([[1.0, 2.0, 3.0], [-4.5, 0.25, 0.0], [10.0, -2.0, 1.0]])
    records["x"], records["y"], records["z"] = points.T
    head = PCD_HEAD
    for old, new in {"x y z": "a x y fpfh z", "4 4 4": "1 8 4 4 2", "F F F": "U F F F I",
                     "1 1 1": "3 1 1 33 1", "ascii": "binary"}.items():  # fmt: skip
        head = head.replace(old, new)
    path = tmp_path / "wide.pcd"
    path.write_bytes(head.encode() + records.tobytes())
    np.testing.assert_allclose(read_points(path).points_m, points)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("SIZE 4 4 4", "SIZE 4 4", "header SIZE 4 4: one whole number above 0"),
        ("TYPE F F F", "TYPE F F Q", "field z of TYPE Q SIZE 4 COUNT 1; valid: F of 4"),
        ("COUNT 1 1 1", "COUNT 1 2 1", "field y of TYPE F SIZE 4 COUNT 2"),
        ("DATA ascii", "DATA zip", "header DATA 'zip'; valid: ascii, binary, binary_compressed"),
        ("WIDTH 3", "WIDTH 4", "WIDTH 4 x HEIGHT 1 is 4, but POINTS 3"),
        ("POINTS 3", "POINTS 4e0", "header POINTS '4e0' is no whole number"),
        ("10 -2 1.5", "10 two 1.5", "line 14: 'two' is no number"),
        ("-4.5 0.25 0\n", "-4.5 0.25\n", "line 13: 2 of 3 values"),
        ("10 -2 1.5\n", "10 -2", "truncated: line 14 has 2 of 3 values"),
        ("ascii", "binary", "truncated: the header promises 3 points, the data hold 2"),
    ],
)
def test_bad_pcd_files_are_refused_with_the_place(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "bad.pcd"
    path.write_text((PCD_HEAD + PCD_ROWS).replace(old, new))
    with pytest.raises(InputError, match=re.escape(message)):
        read_points(path)


def test_pcd_that_promises_more_than_memory_holds(tmp_path: Path) -> None:
    path = write_pcd(tmp_path / "packed.pcd", np.tile(POINTS, (50, 1)), "binary_compressed")
    content = path.read_bytes()
    start = content.index(b"binary_compressed\n") + len(b"binary_compressed\n")
    path.write_bytes(content[: start + 4] + b"\xff\xff\xff\xff" + content[start + 8 :])
    with pytest.raises(InputError, match="damaged: 150 points of 24 bytes need 3600 bytes"):
        read_points(path)
    path.write_text(PCD_HEAD.replace(" 3\n", " 4000000000000\n").replace("ascii", "binary"))
    with pytest.raises(InputError, match="promises 4000000000000 points, the data hold 0"):
        read_points(path)


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_pcd_cut_at_any_byte_is_refused_or_whole(tmp_path: Path, encoding: str) -> None:
    content = write_pcd(tmp_path / "whole.pcd", POINTS, encoding).read_bytes()
    cut = tmp_path / "cut.pcd"
    for kept in range(len(content)):
        cut.write_bytes(content[:kept])
        if encoding == "ascii" and kept > content.index(b"DATA ascii") + 20:
            continue  # A cut within the digits of the last number cannot be told from the number.
        with pytest.raises(InputError):
            read_points(cut)


def test_pcd_without_z(tmp_path: Path) -> None:
    from pypcd4.pypcd4 import PointCloud

    path = tmp_path / "flat.pcd"
    PointCloud.from_points(POINTS[:, :2], ("x", "y"), (np.float32,) * 2).save(path)
    with pytest.raises(InputError, match="no z among x y"):
        read_points(path)
