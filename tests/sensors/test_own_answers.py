"""Answers of a user's own sensor: arrays of any kind mean the same, and what is none is said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import ClearwayError
from clearway.sensors import simulate_scan
from clearway.sensors.memory.point_memory import PointMemory
from clearway.sensors.range_sensor import (
    LidarSensor,
    RangeSensor,
    find_passed,
    find_returns,
    remember_reading,
)
from sensors_for_tests import WORLD, at, lidar

KINDS: dict[str, Callable[[np.ndarray], Any]] = {
    "read only": lambda values: np.frombuffer(values.tobytes(), values.dtype).reshape(values.shape),
    "by columns": np.asfortranarray,
    "strided": lambda values: np.repeat(values, 2, axis=0)[::2],
    "of the other end": lambda values: values.astype(
        ">f8" if values.dtype == float else values.dtype
    ),
    "lists": lambda values: values.tolist(),
}


@dataclass(frozen=True)
class Answering(LidarSensor):
    """A LiDAR whose answers somebody has put into other arrays."""

    kind: Callable[[np.ndarray], Any] = np.asarray

    def returns(self, *asked: Any) -> Any:
        points, radii = super().returns(*asked)
        return self.kind(points), self.kind(radii)

    def passes(self, *asked: Any) -> Any:
        return self.kind(super().passes(*asked))


class Apart:
    """A sensor of the same answers that is no LidarSensor."""

    def __init__(self, sensor: LidarSensor) -> None:
        self.name, self.standing, self.sigma_m = sensor.name, sensor.standing, sensor.sigma_m
        self.detect, self.returns, self.passes = sensor.detect, sensor.returns, sensor.passes


def remembered(sensor: RangeSensor, angle_rad: float) -> PointMemory:
    memory = PointMemory.empty(0.1, 100.0, reach_m=20.0)
    for second in range(3):
        state = at(float(second))
        scan = simulate_scan(lidar("a"), WORLD, state, second)
        memory = remember_reading(memory, sensor, scan, state, angle_rad=angle_rad)
    return memory


@pytest.mark.parametrize("angle_rad", [0.0, 0.01])
@pytest.mark.parametrize("kind", KINDS)
def test_answers_in_any_arrays_are_remembered_alike(kind: str, angle_rad: float) -> None:
    plain = remembered(Apart(Answering(lidar("a"))), angle_rad)
    other = remembered(Apart(Answering(lidar("a"), KINDS[kind])), angle_rad)
    assert len(plain.radius_m) > 20
    assert plain.position_m.tolist() == other.position_m.tolist()
    assert plain.radius_m.tolist() == other.radius_m.tolist()
    assert plain.boxes.doubt.tolist() == other.boxes.doubt.tolist()


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        ((np.zeros((4, 2)), np.zeros(4)), "places that it returns: must have shape [n, 3]"),
        ((np.zeros((4, 3)), np.zeros(3)), "radii: must have shape [4], got [3]"),
        ((np.zeros((4, 3)), "wide"), "radii: "),
        ((None, np.zeros(0)), "places that it returns"),
    ],
)
def test_returns_that_are_none_are_refused(answer: Any, why: str) -> None:
    sensor = Apart(LidarSensor(lidar("own")))
    sensor.returns = lambda *_asked: answer
    with pytest.raises(ClearwayError, match=r"sensor own: ") as refused:
        find_returns(sensor, cw.Scan(np.zeros((0, 3))), at(0.0), 20.0, -np.inf)
    assert why in str(refused.value)


@pytest.mark.parametrize("answer", [[True], np.ones((2, 2)), True, None])
def test_what_is_no_answer_for_each_ball_is_refused(answer: Any) -> None:
    sensor = Apart(LidarSensor(lidar("own")))
    sensor.passes = lambda *_asked: answer
    with pytest.raises(ClearwayError, match="sensor own: what it passes"):
        find_passed(sensor, cw.Scan(np.zeros((0, 3))), at(0.0), np.zeros((2, 3)), np.ones(2), 0.1)
