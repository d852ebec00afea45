"""Files that are one long run of a character are refused, and soon."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import clearway
from clearway.base.errors import ClearwayError
from clearway.io.poses.pose_file import read_poses

READERS: dict[str, tuple[Callable[..., object], str]] = {
    "scan": (clearway.read_scan, "scan.csv"),
    "poses": (read_poses, "poses.txt"),
    "obstacles": (clearway.read_map, "obstacles.csv"),
    "traffic": (clearway.read_traffic, "traffic.csv"),
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("mark", ["[", "(", " ", "_", "0", "\n"])
def test_a_long_run_is_no_long_wait(kind: str, mark: str, tmp_path: Path) -> None:
    """Where time grows with the square of the length, this takes minutes."""
    read, name = READERS[kind]
    (tmp_path / name).write_text("a" + mark * 100_000 + "!")
    with pytest.raises(ClearwayError):
        read(tmp_path / name)
