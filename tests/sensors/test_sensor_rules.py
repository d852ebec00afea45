"""Rules by which detections of several sensors are combined, and what a sensor is asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import clearway as cw
from clearway.base.errors import ClearwayError
from clearway.sensors import (
    LidarSensor,
    Standing,
    combine_detections,
    detect,
    detection_of_cells,
    remember_reading,
    simulate_scan,
)
from clearway.sensors.memory.point_memory import PointMemory, update_memory
from clearway.sensors.standing import COMBINE_RULES, conjunction, weight_by_views
from sensors_for_tests import GRID, WORLD, at, lidar

# --- rules -----------------------------------------------------------------------------------


def test_precision_and_trust_are_shares() -> None:
    assert Standing(0.5, 0.8).weight == pytest.approx(0.4)
    for values in ({"trust": 0.0}, {"precision": 1.5}, {"trust": float("nan")}):
        with pytest.raises(ClearwayError, match="must be above 0 and at most 1"):
            Standing(**values)


def test_the_weighted_rule_by_hand() -> None:
    probability = np.array([[0.5, 0.5, 0.0, 0.0], [0.5, 0.0, 0.5, 0.0]])
    visibility = np.array([[1.0, 0.2, 0.4, 0.0], [1.0, 1.0, 0.0, 0.6]])
    looks = np.array([[True, True, True, False], [True, True, False, True]])
    detected, seen = weight_by_views(probability, visibility, looks, np.array([0.8, 0.4]))
    # The heavier sensor counts in full, the other by half where both look, in full where alone.
    assert detected == pytest.approx([1.0 - 0.5 * 0.5**0.5, 0.5, 0.0, 0.0])
    assert seen == pytest.approx([1.0, 0.5, 0.4, 0.6])
    detected, seen = conjunction(probability, visibility, looks, np.array([0.8, 0.4]))
    assert detected == pytest.approx([0.75, 0.5, 0.5, 0.0])  # (5.38)
    assert seen == pytest.approx([1.0, 1.0, 0.4, 0.6])


shares = st.floats(0.0, 1.0)


@given(
    st.lists(st.tuples(shares, shares, st.floats(0.05, 1.0)), min_size=1, max_size=5),
)
def test_what_one_sensor_sees_is_never_talked_away(
    said: list[tuple[float, float, float]],
) -> None:
    probability, visibility, weight = (np.array(column) for column in zip(*said, strict=True))
    looks = np.ones((len(said), 1), dtype=np.bool_)
    columns = probability[:, None], visibility[:, None], looks
    strict, view = conjunction(*columns, weight)
    mild, narrow = weight_by_views(*columns, weight)
    heaviest = probability[int(np.argmax(weight))]
    assert heaviest - 1e-9 <= mild[0] <= strict[0] + 1e-9 <= 1.0 + 1e-9
    assert narrow[0] <= view[0]
    equal, same = weight_by_views(*columns, np.ones(len(said)))
    assert equal == pytest.approx(strict)
    assert same == pytest.approx(view)


def test_one_detection_is_itself_by_any_rule() -> None:
    one = detect(GRID, lidar("a"), simulate_scan(lidar("a"), WORLD, at(5.0)))
    for rule in COMBINE_RULES:
        assert combine_detections([one], rule).detected is one.probability
    with pytest.raises(
        ClearwayError, match="valid sensor fusion rules are conjunction or weighted"
    ):
        combine_detections([one], "loudest")
    with pytest.raises(ClearwayError, match="valid sensor fusion rules are"):
        cw.AvoidanceSettings(sensor_fusion="loudest")


def test_a_detection_made_of_cells() -> None:
    probability = np.zeros(GRID.cells)
    per_layer = GRID.columns * GRID.rows
    probability[3 * per_layer] = 0.4
    looks = np.arange(per_layer) == 0
    ball = np.array([[3.5, 0.0, 0.0]])
    made = detection_of_cells(GRID, "r", 1.0, probability, looks, ball, np.array([0.2]), 8.0)
    column = made.visibility.reshape(GRID.layers, per_layer)[:, 0]
    assert column == pytest.approx([1, 1, 1, 1, 0.6, 0.6, 0.6, 0.6, 0, 0])
    assert not made.visibility.reshape(GRID.layers, per_layer)[:, 1:].any()
    assert made.hits.sum() == 1
    assert made.seen.sum() == GRID.layers


def test_a_lidar_answers_the_questions_of_a_range_sensor() -> None:
    sensor = LidarSensor(lidar("a", sigma_m=0.0))
    assert isinstance(sensor, cw.sensors.RangeSensor)
    state = at(5.0)
    scan = simulate_scan(sensor.lidar, WORLD, state)
    points, radii = sensor.returns(scan, state, 10.0, -np.inf)
    surface = np.array([abs(WORLD.distance_m(point[None])[0]) for point in points])
    assert surface.max() < 1e-6
    assert radii == pytest.approx(
        0.5 * sensor.lidar.pattern.spacing_rad * np.linalg.norm(points - state.position_m, axis=1)
    )
    places = np.array([[8.0, 0.3, 0.0], [11.5, 0.3, 0.0], [4.0, 0.0, 0.0]])
    wide = np.full(3, 0.3)
    nothing = cw.Scan(np.zeros((0, 3)), 5.0, sensor="a")
    assert sensor.passes(nothing, state, places, wide, 0.1).tolist() == [True, True, False]
    assert sensor.passes(scan, state, places, wide, 0.1).tolist() == [True, False, False]
    # Memory by these answers is the memory of `update_memory`.
    empty = PointMemory.empty(0.12)
    one = remember_reading(empty, sensor, scan, state)
    other = update_memory(empty, sensor.lidar, scan, state)
    assert np.array_equal(one.position_m, other.position_m)
