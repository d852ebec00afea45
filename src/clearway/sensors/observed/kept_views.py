"""Which scans are kept as range views: the latest of each sensor, and keyframes that stay.

A keyframe stays where it was taken, so that the place where the vehicle hovers is still seen from
where it came. Where all slots are taken, the one farthest from the vehicle makes room.
"""

from __future__ import annotations

import numpy as np

from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.pattern import BeamPattern
from clearway.sensors.observed.range_views import (
    NO_VIEWS,
    NONE,
    RangeViews,
    pyramid_size,
    raise_pyramid,
)
from clearway.sensors.observed.view_shape import (
    IMAGE_COLUMNS,
    IMAGE_ROWS,
    NUMBERS,
    ViewShape,
    lay_returns,
    view_shape,
)
from clearway.sensors.passing.passed_points import Sensor

TURNED = float(np.cos(np.radians(23.0)))
"""Cosine of the angle by which another keyframe must be turned at most, to stand for a view."""


class KeptViews:
    """Views of all sensors in slots of one array.

    keyframes: the most that are kept. apart_m: a keyframe is taken where none stands within that.
    """

    def __init__(self, keyframes: int, apart_m: float) -> None:
        self._most, self._apart_m = keyframes, apart_m
        self._sensors: list[str] = []
        self._shapes: list[tuple[BeamPattern, ViewShape]] = []
        self._latest: dict[str, int] = {}
        self._keyframes: list[int] = []
        self._of = NO_VIEWS
        self._newest: list[int] = []

    @property
    def views(self) -> RangeViews:
        """All views, the newest asked first."""
        return self._of

    @property
    def latest(self) -> dict[str, int]:
        """Slot of the latest view by sensor."""
        return self._latest

    def forget(self) -> None:
        """Keep no view."""
        self._latest, self._keyframes, self._newest = {}, [], []
        self._note()

    def take(
        self,
        lidar: Lidar,
        scan: Scan,
        sensor: Sensor,
        limits_m: tuple[float, float],
        short_m: float,
        *,
        again: bool = False,
    ) -> tuple[int, np.ndarray]:
        """Lay out a scan in a slot, and return that and its image, without its pyramid.

        again: in place of the latest of its sensor, of which it says what that was.
        limits_m: nearest and farthest distance at which it shows anything. short_m: so far before
        a return nothing is free.
        """
        kind = self._kind_of(lidar)
        shape = self._shapes[kind][1]
        slot = self._latest[lidar.name] if again else self._free_slot()
        views = self._of
        views.pose[slot] = *sensor.rotation.ravel(), *sensor.origin
        views.limits[slot], views.kind[slot] = limits_m, kind
        stride = len(views.pixels) // len(views.kind)
        image = views.pixels[slot * stride : slot * stride + len(shape.clear)]
        image[:] = shape.clear
        lay_returns(scan.points_m, short_m, shape.numbers, image)
        return slot, image

    def finish(self, lidar: Lidar, slot: int) -> None:
        """Raise the pyramid of what was laid out; from now on it is asked."""
        views = self._of
        shape = self._shapes[int(views.kind[slot])][1]
        stride = len(views.pixels) // len(views.kind)
        rows, columns = int(shape.numbers[IMAGE_ROWS]), int(shape.numbers[IMAGE_COLUMNS])
        raise_pyramid(views.pixels[slot * stride : (slot + 1) * stride], rows, columns)
        self._latest[lidar.name] = slot
        self._newest = [slot, *(each for each in self._newest if each != slot)]
        if self._most and self._is_new(slot):
            self._add_keyframe(slot)
        self._newest = [
            each
            for each in self._newest
            if each in self._keyframes or each in self._latest.values()
        ]
        self._note()

    def _note(self) -> None:
        self._of.last[0] = NONE
        self._of = self._of._replace(asked=np.array(self._newest, dtype=np.int64))

    def _is_new(self, slot: int) -> bool:
        """Whether no keyframe of the kind stands near a view, turned alike."""
        if slot in self._keyframes:
            return False
        views, others = self._of, np.array(self._keyframes, dtype=np.int64)
        others = others[views.kind[others] == views.kind[slot]]
        away = np.linalg.norm(views.pose[others, 9:] - views.pose[slot, 9:], axis=1)
        near = others[away <= self._apart_m]
        turned = views.pose[near, :9].reshape(-1, 3, 3), views.pose[slot, :9].reshape(3, 3)
        # Of the axes ahead and up, whichever has turned farther.
        alike = np.einsum("nij,ij->nj", turned[0], turned[1])[:, [0, 2]].min(axis=1)
        return not bool(np.any(alike >= TURNED))

    def _free_slot(self) -> int:
        """One that nobody asks: the views that are there tell what a blind sensor knew before."""
        taken = {*self._keyframes, *self._latest.values()}
        return next(n for n in range(len(self._of.kind)) if n not in taken)

    def _add_keyframe(self, slot: int) -> None:
        """Keep a view, in place of the one farthest from it where there are too many."""
        if len(self._keyframes) == self._most:
            away = self._of.pose[self._keyframes, 9:] - self._of.pose[slot, 9:]
            del self._keyframes[int(np.argmax(np.linalg.norm(away, axis=1)))]
        self._keyframes.append(slot)

    def _kind_of(self, lidar: Lidar) -> int:
        """Number of the shape of a LiDAR's image; there is room for one more where it is new."""
        if lidar.name not in self._sensors:
            self._sensors.append(lidar.name)
        for kind, (pattern, _) in enumerate(self._shapes):
            if pattern is lidar.pattern:
                if len(self._of.kind) < self._slots:
                    self._widen()
                return kind
        self._shapes.append((lidar.pattern, view_shape(lidar.pattern)))
        self._widen()
        return len(self._shapes) - 1

    @property
    def _slots(self) -> int:
        return self._most + len(self._sensors) + 1

    def _widen(self) -> None:
        """Make room for another sensor or shape; what is there stays."""
        shapes, before = [shape for _, shape in self._shapes], self._of
        sizes = [
            pyramid_size(int(each.numbers[IMAGE_ROWS]), int(each.numbers[IMAGE_COLUMNS]))
            for each in shapes
        ]
        stride, slots = max(sizes), self._slots
        pixels = np.zeros((slots, stride), dtype=np.int16)
        numbers = np.zeros((len(shapes), NUMBERS))
        directions = np.zeros((len(shapes), max(len(each.directions) for each in shapes)))
        for n, shape in enumerate(shapes):
            numbers[n] = shape.numbers
            directions[n, : len(shape.directions)] = shape.directions
        pose, limits = np.zeros((slots, 12)), np.zeros((slots, 2))
        kind = np.zeros(slots, dtype=np.int64)
        if self._newest:
            count = len(before.kind)
            held = before.pixels.reshape(count, -1)
            pixels[:count, : held.shape[1]] = held
            pose[:count], limits[:count], kind[:count] = before.pose, before.limits, before.kind
        last = np.full(1, NONE, dtype=np.int64)
        self._of = RangeViews(
            pixels.ravel(), pose, limits, kind, numbers, directions, before.asked, last
        )
