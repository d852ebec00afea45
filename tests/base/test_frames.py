"""Frames: rotation laws, spherical coordinates, NED/ENU and geodetic edges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base import frames

angle = st.floats(-np.pi, np.pi)
attitude = st.tuples(angle, angle, angle).map(np.array)
point = st.tuples(*[st.floats(-1e3, 1e3)] * 3).map(np.array)


@given(attitude)
def test_rotation_is_orthonormal_and_its_inverse_the_transpose(attitude_rad):
    rotation = frames.world_from_body(attitude_rad)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_array_equal(frames.body_from_world(attitude_rad), rotation.T)


def test_rotation_is_yaw_after_pitch_after_roll():
    roll, pitch, yaw = 0.3, -0.4, 1.1
    single = [frames.world_from_body(a) for a in ([0, 0, yaw], [0, pitch, 0], [roll, 0, 0])]
    np.testing.assert_allclose(
        frames.world_from_body([roll, pitch, yaw]), single[0] @ single[1] @ single[2], atol=1e-15
    )


def test_signs_of_pitch_and_yaw():
    nose = np.array([1.0, 0.0, 0.0])
    assert (frames.world_from_body([0, 0.1, 0]) @ nose)[2] < 0, "pitch is positive nose down"
    assert (frames.world_from_body([0, 0, 0.1]) @ nose)[1] > 0, "yaw is positive left"


@given(attitude, point, point)
def test_world_and_body_points_invert_each_other(attitude_rad, position, body):
    world = frames.world_points_from_body(body[None], position, attitude_rad)
    back = frames.body_points_from_world(world, position, attitude_rad)
    np.testing.assert_allclose(back[0], body, atol=1e-9)


@given(st.tuples(angle, st.floats(-1.5, 1.5), angle).map(np.array))
def test_attitude_comes_back_from_its_rotation(attitude_rad):
    rotation = frames.world_from_body(attitude_rad)
    again = frames.attitude_from_rotation(rotation)
    np.testing.assert_allclose(frames.world_from_body(again), rotation, atol=1e-9)


def test_attitude_at_gimbal_lock_is_a_rotation_that_agrees():
    rotation = frames.world_from_body([0.4, np.pi / 2, 0.7])
    again = frames.attitude_from_rotation(rotation)
    assert again[0] == 0.0
    np.testing.assert_allclose(frames.world_from_body(again), rotation, atol=1e-7)


@given(point)
def test_spherical_and_cartesian_invert_each_other(p):
    back = frames.cartesian_from_spherical(frames.spherical_from_cartesian(p))
    np.testing.assert_allclose(back, p, atol=1e-9)


def test_spherical_angles_use_atan2():
    distance, azimuth, elevation = frames.spherical_from_cartesian([-1.0, 1.0, np.sqrt(2.0)])
    assert (distance, azimuth, elevation) == pytest.approx((2.0, 0.75 * np.pi, 0.25 * np.pi))


@given(st.floats(-100, 100))
def test_wrapped_angle_is_the_same_angle(value):
    wrapped = frames.wrap_angle(value)
    assert -np.pi < wrapped <= np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(value), abs=1e-9)
    assert np.sin(wrapped) == pytest.approx(np.sin(value), abs=1e-9)


def test_ned_and_enu():
    np.testing.assert_array_equal(frames.enu_from_ned([1.0, 2.0, 3.0]), [2.0, 1.0, -3.0])
    np.testing.assert_array_equal(frames.ned_from_enu([2.0, 1.0, -3.0]), [1.0, 2.0, 3.0])


def test_aerospace_attitude():
    # Heading north, nose up 10 deg: here yaw 90 deg (left of east), pitch -10 deg.
    here = frames.attitude_enu_from_ned_frd(np.radians([0.0, 10.0, 0.0]))
    np.testing.assert_allclose(here, np.radians([0.0, -10.0, 90.0]))
    np.testing.assert_allclose(frames.attitude_ned_frd_from_enu(here), np.radians([0.0, 10.0, 0.0]))
    nose_enu = frames.world_from_body(here) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(
        nose_enu, [0.0, np.cos(np.radians(10)), np.sin(np.radians(10))], atol=1e-12
    )


def test_geodetic_round_trip_and_scale():
    origin = np.array([50.0, 14.0, 300.0])
    east, north, up = frames.enu_from_geodetic([50.001, 14.0, 310.0], origin)
    assert (east, north, up) == pytest.approx((0.0, 111.23, 10.0), abs=0.02)
    points = np.array([[100.0, -250.0, 30.0], [5.0, 6.0, 7.0]])
    before = points.copy()
    again = frames.enu_from_geodetic(frames.geodetic_from_enu(points, origin), origin)
    np.testing.assert_allclose(again, points, atol=1e-6)
    np.testing.assert_array_equal(points, before)
