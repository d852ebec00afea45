"""Transforms by TF: which frame lies where in which, at what time."""

from __future__ import annotations

import bisect
import math
from collections import Counter
from typing import Any, NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.poses.pose_track import convert_quaternion

KEPT_S = 10.0
MOST_FRAMES = 500
MOST_KEPT = 2000
LATE_S = 0.5
"""How far from the time asked for a moving transform may be."""
NO_TRANSFORM = "no transform"
MOST_GAPS = 16
LONGEST_NAME = 60
"""Gaps that are told by name, and the characters of a name."""


class RigidTransform(NamedTuple):
    """Of a frame in another: rotation [3, 3] and place [3]."""

    rotation: FloatArray
    position_m: FloatArray

    def points(self, points_m: FloatArray) -> FloatArray:
        moved: FloatArray = points_m @ self.rotation.T + self.position_m
        return moved

    def then(self, outer: RigidTransform) -> RigidTransform:
        """The same in the frame that the other one is of."""
        return RigidTransform(
            outer.rotation @ self.rotation, outer.rotation @ self.position_m + outer.position_m
        )

    @property
    def inverse(self) -> RigidTransform:
        return RigidTransform(self.rotation.T, -self.rotation.T @ self.position_m)


HERE = RigidTransform(np.eye(3), np.zeros(3))


def transform_of(place: Any, turn: Any) -> RigidTransform | None:
    """Of a translation and a quaternion message; None where they are none."""
    position = np.array([place.x, place.y, place.z], dtype=np.float64)
    quaternion = np.array([turn.w, turn.x, turn.y, turn.z], dtype=np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        size = float(np.sqrt((quaternion**2).sum()))
    if not (np.all(np.abs(position) < 1e9) and 0.5 < size < 2.0):
        return None
    return RigidTransform(convert_quaternion(quaternion / size), position)


class Transforms:
    """Takes TFMessages; `of` says where a frame lies."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._parent: dict[str, str] = {}
        self._static: dict[str, RigidTransform] = {}
        self._moving: dict[str, list[tuple[float, RigidTransform]]] = {}
        self._gaps: set[str] = set()

    @property
    def frames(self) -> set[str]:
        return set(self._parent) | set(self._parent.values())

    def take(self, message: Any, *, static: bool) -> None:
        """A tf2_msgs/TFMessage."""
        for one in message.transforms:
            child, parent = one.child_frame_id.lstrip("/"), one.header.frame_id.lstrip("/")
            found = transform_of(one.transform.translation, one.transform.rotation)
            if found is None or not child or not parent or child == parent:
                self._counts["tf: no transform"] += 1
                continue
            if child not in self._parent and len(self._parent) >= MOST_FRAMES:
                self._counts["tf: more frames than can be used"] += 1
                continue
            self._parent[child] = parent
            if static:
                self._static[child] = found
                continue
            self._add(child, one.header.stamp.sec + 1e-9 * one.header.stamp.nanosec, found)

    def _add(self, child: str, time_s: float, found: RigidTransform) -> None:
        kept = self._moving.setdefault(child, [])
        if kept and time_s < kept[-1][0] - KEPT_S:
            self._counts["tf: time runs back, older ones forgotten"] += 1
            kept.clear()
        bisect.insort(kept, (time_s, found), key=lambda entry: entry[0])
        while len(kept) > MOST_KEPT or kept[0][0] < kept[-1][0] - KEPT_S:
            kept.pop(0)

    def of(self, frame: str, within: str, time_s: float) -> RigidTransform | None:
        """Where a frame lies in another at a time; None where nothing tells."""
        up, down = self._to_root(frame, time_s), self._to_root(within, time_s)
        for name, found in up.items():
            if name in down:
                return found.then(down[name].inverse)
        return None

    def locate(self, frame: str, within: str, time_s: float, what: str) -> RigidTransform | None:
        """Where a frame lies in another; None, and counted for what asks, where nothing tells.

        A frame without a name is the one asked for.
        """
        found = HERE if frame in ("", within) else self.of(frame, within, time_s)
        if found is None:
            self._counts[f"{what}: {self.describe_gap(frame, within, time_s)}"] += 1
        return found

    def describe_gap(self, frame: str, within: str, time_s: float) -> str:
        """Why a frame's place in another is unknown at a time, with the frames' names."""
        frame, within = frame.lstrip("/"), within.lstrip("/")
        ends = f"from {_quote(frame)} to {_quote(within)}"
        gap = f"{NO_TRANSFORM} {ends}: {self._gap(frame, within, time_s)}"
        if gap not in self._gaps and len(self._gaps) >= MOST_GAPS:
            return f"{NO_TRANSFORM}, between other frames than those named"
        self._gaps.add(gap)
        return gap

    def _gap(self, frame: str, within: str, time_s: float) -> str:
        ends = []
        for name in (frame, within):
            if name not in self.frames:
                return f"{_quote(name)} comes on neither /tf nor /tf_static"
            ends.append(list(self._to_root(name, time_s))[-1])
        for name in ends:
            if name in self._parent:
                parent = _quote(self._parent[name])
                return f"{_quote(name)} in {parent} comes, but not within {LATE_S} s of the stamp"
        first, second = map(_quote, ends)
        return f"one is in {first} at last, the other in {second}, and nothing joins them"

    def _to_root(self, frame: str, time_s: float) -> dict[str, RigidTransform]:
        """A frame in itself, in its parent, and so on, as far as transforms lead."""
        at, found = frame.lstrip("/"), HERE
        chain = {at: found}
        while at in self._parent:
            step = self._at(at, time_s)
            at = self._parent[at]
            if step is None or at in chain:
                break
            found = found.then(step)
            chain[at] = found
        return chain

    def _at(self, child: str, time_s: float) -> RigidTransform | None:
        if child in self._static:
            return self._static[child]
        kept = self._moving.get(child, [])
        if not kept:
            return None
        after = bisect.bisect_left(kept, time_s, key=lambda entry: entry[0])
        first, last = kept[max(0, after - 1)], kept[min(after, len(kept) - 1)]
        if min(abs(first[0] - time_s), abs(last[0] - time_s)) > LATE_S:
            return None
        span = last[0] - first[0]
        share = 0.0 if span <= 0.0 else min(1.0, max(0.0, (time_s - first[0]) / span))
        return _between(first[1], last[1], share)


def _quote(name: str) -> str:
    return repr(name[:LONGEST_NAME])


def _between(first: RigidTransform, last: RigidTransform, share: float) -> RigidTransform:
    """Part of the way from one to another, turning evenly."""
    turn = first.rotation.T @ last.rotation
    angle = math.acos(max(-1.0, min(1.0, 0.5 * (float(np.trace(turn)) - 1.0))))
    place = first.position_m + share * (last.position_m - first.position_m)
    if angle < 1e-9 or angle > math.pi - 1e-6:
        return RigidTransform(first.rotation if share < 0.5 else last.rotation, place)
    skew = (turn - turn.T) / (2.0 * math.sin(angle))
    part = share * angle
    step = np.eye(3) + math.sin(part) * skew + (1.0 - math.cos(part)) * skew @ skew
    return RigidTransform(first.rotation @ step, place)
