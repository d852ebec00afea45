"""Rectangles over polygons: they cover all of it and little more."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

shapely = pytest.importorskip("shapely")

from clearway.io.maps.rectangles import EXCESS, MOST_RECTANGLES, cover_polygon  # noqa: E402


def union(covered):
    """The rectangles as one shape."""
    shapes = []
    for one in covered.rectangles:
        half_x, half_y = 0.5 * one.size_m[0], 0.5 * one.size_m[1]
        corners = np.array(
            [[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]]
        )
        cosine, sine = np.cos(one.yaw_rad), np.sin(one.yaw_rad)
        shapes.append(shapely.Polygon(corners @ [[cosine, sine], [-sine, cosine]] + one.center_m))
    return shapely.union_all(shapes, grid_size=1e-6)


def turned(corners, angle):
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array(corners, dtype=float) @ [[cosine, sine], [-sine, cosine]] + [3.0, -7.0]


def test_a_turned_rectangle_is_one_rectangle():
    covered = cover_polygon([turned([[0, 0], [12, 0], [12, 5], [0, 5]], 0.4)])
    assert len(covered.rectangles) == 1
    assert covered.covered_m2 == pytest.approx(60.0)
    assert sorted(covered.rectangles[0].size_m) == pytest.approx([5.0, 12.0])


def test_an_l_becomes_two_rectangles_without_any_waste():
    shape = [[0, 0], [10, 0], [10, 3], [4, 3], [4, 9], [0, 9]]
    covered = cover_polygon([turned(shape, 1.1)])
    assert len(covered.rectangles) == 2
    assert covered.covered_m2 == pytest.approx(54.0) == covered.polygon_m2


def test_a_courtyard_stays_open():
    outer = np.array([[0, 0], [40, 0], [40, 40], [0, 40]])
    hole = np.array([[10, 10], [30, 10], [30, 30], [10, 30]])
    covered = cover_polygon([outer, hole])
    assert covered.covered_m2 <= (1.0 + EXCESS) * 1200.0
    assert not union(covered).contains(shapely.Point(20.0, 20.0))


def test_a_bow_tie_counts_as_what_it_encloses():
    covered = cover_polygon([np.array([[0, 0], [30, 30], [30, 0], [0, 30]])])
    assert covered.polygon_m2 == pytest.approx(450.0)
    assert union(covered).contains(shapely.Point(29.0, 15.0))


def test_no_area_gives_no_rectangle():
    assert cover_polygon([np.array([[0, 0], [5, 5], [10, 10]])]).rectangles == ()


def test_splinters_keep_a_width():
    splinter = np.array([[0.0, 0.0], [54.0, 30.0], [54.0, 30.0 + 1e-7], [0.0, 1e-7]])
    assert all(min(one.size_m) >= 1e-3 for one in cover_polygon([splinter]).rectangles)


@settings(max_examples=60)
@example([8.0, 8.0, 40.75, 8.0, 45.0, 36.0, 58.255859375, 8.4375, 8.0, 12.0, 42.0, 9.0, 8.0], 0.0)
@given(st.lists(st.floats(8.0, 60.0), min_size=3, max_size=24), st.floats(0.0, 6.0))
def test_rectangles_cover_any_star_shaped_polygon(radii, start):
    angles = start + 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    ring = np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    covered = cover_polygon([ring])
    shape = shapely.make_valid(shapely.Polygon(ring))
    assert len(covered.rectangles) <= MOST_RECTANGLES + 2
    assert shapely.difference(shape, union(covered)).area <= 1e-6 * shape.area
    assert covered.covered_m2 == pytest.approx(union(covered).area, rel=1e-6)
