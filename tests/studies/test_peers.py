"""Encounters that peers fly too, and how their tracks are judged."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.peers.__main__ import _in_space, _judged, _nearest
from benchmarks.peers.courses import courses, lasts_s


@pytest.mark.parametrize("detected_at_m", [10.0, 4.0])
def test_courses_are_level_and_collide(detected_at_m):
    for encounter in courses(20, detected_at_m):
        assert encounter.position_m[2] == encounter.velocity_mps[2] == 0.0
        assert np.linalg.norm(encounter.position_m) == pytest.approx(detected_at_m)
        assert encounter.straight_miss_m == pytest.approx(0.0, abs=1e-9)
        assert 0.5 <= np.linalg.norm(encounter.velocity_mps) <= 1.0
        assert lasts_s(encounter) > encounter.collision_s


def test_the_smallest_distance_is_found_between_samples():
    # They pass each other at 0.8 between two coarse samples.
    track = _in_space([[0.0, 0.0, 0.0, 10.0, 0.8], [10.0, 10.0, 0.0, 0.0, 0.8]])
    assert _nearest(track) == pytest.approx(0.8)
    line = _judged(
        "someone", [track, _in_space([[0.0, 0.0, 0.0, 5.0, 5.0], [1.0, 1.0, 0.0, 5.0, 5.0]])]
    )
    assert (line.kept, line.flown) == (1, 2)
    assert line.nearest == pytest.approx(0.8)
