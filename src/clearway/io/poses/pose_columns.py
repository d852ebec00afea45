"""Which column of a table of poses is which, by the names in its header."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray, world_from_body
from clearway.io.poses.pose_track import quaternions_of

LONGEST_WORD = 80
UNIT = re.compile(r"\s*[\[(]\s*(\w*)[^\])]*[\])]\s*$|_(deg|rad|m|s|ns)$")
ROLES = (
    ("time", r"(time|timestamp|time_stamp|t|stamp)"),
    ("q{}", r"(?:q|quat|quaternion|orientation|q_rs)_?([wxyz])"),
    ("{}", r"(?:t|p|pos|position|p_rs_r)?_?([xyz])"),
    ("{}", r"(roll|pitch|yaw)"),
)
"""What a column is called here, by how others name it: TUM, EuRoC, ROS."""
MOST_RAD = 1e6
"""Larger angles are none."""
PLACE = ("x", "y", "z")
QUATERNION = ("qw", "qx", "qy", "qz")
ANGLES = ("roll", "pitch", "yaw")


class PoseColumns(NamedTuple):
    """Where a pose stands in a row."""

    time: int
    place: list[int]
    turn: list[int]
    """Quaternion w, x, y, z, or roll, pitch, yaw."""
    radians: bool
    """Whether angles are in radians."""

    def track(self, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times as they stand, positions [n, 3], quaternions [n, 4] w, x, y, z."""
        turn = rows[:, self.turn]
        if len(self.turn) == len(ANGLES):
            turn = _quaternions(turn if self.radians else np.radians(turn))
        return rows[:, self.time], rows[:, self.place], turn


def _quaternions(angles_rad: FloatArray) -> FloatArray:
    """[n, 4] of roll, pitch and yaw [n, 3]; NaN where they are no angles."""
    quaternions = np.full((len(angles_rad), 4), np.nan)
    with np.errstate(invalid="ignore"):
        good = np.all(np.abs(angles_rad) < MOST_RAD, axis=1)
    if good.any():
        quaternions[good] = quaternions_of(world_from_body(angles_rad[good]))
    return quaternions


TUM = PoseColumns(0, [1, 2, 3], [7, 4, 5, 6], False)
TABLE = PoseColumns(0, [1, 2, 3], [4, 5, 6], False)
"""Where there is no header: time, x, y, z, and x, y, z, w, or roll, pitch, yaw in degrees."""


def find_pose_columns(header: str) -> PoseColumns | None:
    """The columns that a header names; None where it does not name a whole pose."""
    found: dict[str, int] = {}
    units: dict[str, str] = {}
    for at, word in enumerate(words_of(header)):
        unit = UNIT.search(word.lower())
        name = UNIT.sub("", word.lower()).strip()
        role = _role(name)
        if role and role not in found:
            found[role] = at
            units[role] = (unit[1] or unit[2] or "") if unit is not None else ""
    turn = next((names for names in (QUATERNION, ANGLES) if set(names) <= found.keys()), None)
    if turn is None or not {"time", *PLACE} <= found.keys():
        return None
    radians = units[turn[-1]].startswith("rad")
    return PoseColumns(found["time"], [found[n] for n in PLACE], [found[n] for n in turn], radians)


def words_of(line: str) -> list[str]:
    """Words of a line, between commas or semicolons where it has any; of long ones the beginning,
    since no name is as long."""
    text = line.strip().lstrip("#").strip()
    return [
        word.strip()[:LONGEST_WORD]
        for word in re.split("[,;]" if re.search("[,;]", text) else r"\s+", text)
    ]


def _role(name: str) -> str:
    for role, pattern in ROLES:
        match = re.fullmatch(pattern, name)
        if match is not None:
            return role.format(match[1])
    return ""
