"""Bands: what each heading, climb and speed leads to, and what is left when nothing is free."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.long_range.bands import bands
from clearway.traffic import Intruder
from clearway.traffic.volumes import VOLUME_SETS, AlertLevel
from clearway.vehicle.performance import PERFORMANCES

SMALL, WING = VOLUME_SETS["f3442"], PERFORMANCES["wing"]
OWN = np.array([25.0, 0.0, 0.0])


def seen(*intruders: Intruder):  # type: ignore[no-untyped-def]
    return bands(SMALL, WING, np.zeros(3), OWN, list(intruders), 0.0)


def head_on(range_m: float, height_m: float = 0.0) -> Intruder:
    return Intruder([range_m, 0.0, height_m], [-50.0, 0.0, 0.0], name="x")


def test_nobody_near_leaves_all_free() -> None:
    found = seen(head_on(40_000.0))
    assert not found.heading.levels.any()
    assert not found.climb.levels.any()
    assert not found.speed.levels.any()
    assert not found.saturated


def test_straight_on_is_taken_and_turning_away_is_free_either_way_alike() -> None:
    found = seen(head_on(4000.0))
    headings = np.degrees(found.heading.values)
    ahead = found.heading.levels[np.argmin(np.abs(headings))]
    assert ahead >= AlertLevel.CORRECTIVE
    free = headings[found.heading.levels < AlertLevel.CORRECTIVE]
    assert np.abs(free).min() < 90.0
    left = {round(float(h)) for h in free if 0.0 < h < 179.0}
    right = {round(-float(h)) for h in free if -179.0 < h < 0.0}
    assert left == right
    assert found.climb.levels.max() >= AlertLevel.CORRECTIVE


def test_one_above_takes_climbs_to_its_height_and_leaves_sinking_free() -> None:
    found = seen(head_on(3500.0, 60.0))
    climbs = found.climb.values
    assert found.climb.levels[np.argmin(np.abs(climbs - 1.5))] >= AlertLevel.CORRECTIVE
    assert found.climb.levels[np.argmin(climbs)] < AlertLevel.CORRECTIVE


def test_levels_never_fall_when_someone_else_comes() -> None:
    one, other = head_on(3000.0), Intruder([0.0, 2500.0, 10.0], [20.0, -40.0, 0.0], name="y")
    alone, both = seen(one), seen(one, other)
    for name in ("heading", "climb", "speed"):
        assert np.all(getattr(both, name).levels >= getattr(alone, name).levels)


def test_a_band_is_what_flying_it_comes_to() -> None:
    """Headings that are free keep the volume when they are flown, by an independent walk."""
    intruder = Intruder([2600.0, 900.0, 20.0], [-45.0, -20.0, -0.5], name="x")
    found = seen(intruder)
    volume = SMALL.outermost.kept
    delay = WING.reaction_s + WING.turn_onset_s
    rate = WING.turn_rps(25.0)
    step = 0.02
    times = np.arange(0.0, 55.0, step)
    for heading, level in zip(found.heading.values, found.heading.levels, strict=True):
        turned = np.clip(rate * (times - delay), 0.0, abs(heading)) * np.sign(heading)
        velocity = 25.0 * np.stack([np.cos(turned), np.sin(turned), 0.0 * turned], axis=1)
        own = np.cumsum(velocity, axis=0) * step
        apart = intruder.position_m + times[:, None] * intruder.velocity_mps - own
        inside = np.hypot(apart[:, 0], apart[:, 1]) < volume.radius_m - 15.0
        inside &= np.abs(apart[:, 2]) < volume.half_height_m - 1.0
        if level < AlertLevel.CORRECTIVE:
            assert not inside.any(), np.degrees(heading)


def test_what_is_left_when_nothing_is_free() -> None:
    found = seen(head_on(900.0), Intruder([-900.0, 0.0, 0.0], [75.0, 0.0, 0.0], name="behind"))
    assert found.heading.saturated
    assert found.heading.recovery.any() or found.climb.recovery.any()
    told = found.as_dict()
    assert told["saturated"] == found.saturated
    assert {run["level"] for run in told["climb_mps"]} <= {
        "none", "preventive", "corrective", "warning", "recovery",
    }  # fmt: skip


@pytest.mark.parametrize("vehicle", [*PERFORMANCES])
def test_nobody_at_all(vehicle: str) -> None:
    found = bands(SMALL, PERFORMANCES[vehicle], np.zeros(3), OWN, [], 0.0)
    assert not found.heading.levels.any()


@pytest.mark.parametrize("course_deg", [0.0, 37.0, 90.0, 225.0])
def test_headings_for_machines_are_compass_degrees_clockwise_from_north(course_deg: float) -> None:
    """One ahead and to the right: taken is the own course and what lies right of it, not left."""
    course = np.radians(course_deg)
    ahead = np.array([np.sin(course), np.cos(course), 0.0])
    right = np.array([np.cos(course), -np.sin(course), 0.0])
    stands = Intruder(1500.0 * ahead + 500.0 * right, np.zeros(3), name="x")
    found = bands(SMALL, WING, np.zeros(3), 25.0 * ahead, [stands], 0.0)
    compass = found.compass
    assert (np.diff(compass.values) > 0.0).all()
    assert 0.0 <= compass.values[0] < compass.values[-1] < 360.0
    taken = compass.values[compass.levels >= AlertLevel.CORRECTIVE]
    from_course = (taken - course_deg + 180.0) % 360.0 - 180.0
    assert from_course.min() == pytest.approx(0.0, abs=12.0)
    assert from_course.max() > 30.0
    runs = found.as_dict()["heading_deg"]
    assert runs[0]["from"] == pytest.approx(compass.values[0], abs=0.01)
    assert runs[-1]["to"] == pytest.approx(compass.values[-1], abs=0.01)
