"""A way out that was verified with all that the vehicle may be off is not given up for none."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.sensors.observed.free_space import FreeSpace
from worlds_for_tests import LIBRARY

PLANE = Planner.of(LIBRARY, AvoidanceSettings(safety_margin_m=0.6, body_radius_m=0.1))
UNSURE_MPS = 0.1


def decided(seen_m: float, unsure_mps: float, held: WayOut | None) -> Decision:
    """In a ball of space that was seen, with the goal outside."""
    seen = FreeSpace(0.25, np.zeros(3), seen_m).seen
    here, goal = State(np.zeros(3)), np.array([20.0, 0.0, 0.0])
    situation = Situation(here, goal, seen=seen, wind_sigma_mps=unsure_mps)
    return decide(PLANE, situation, commitment=Commitment(way_out=held))


@pytest.mark.parametrize("seen_m", [8.0, 9.0, 10.0])
def test_who_is_off_flies_what_is_in_hand_as_predicted_before_anything_unseen(seen_m: float):
    held = decided(12.0, UNSURE_MPS, None).way_out
    assert held is not None
    assert held.certain
    flies = decided(seen_m, UNSURE_MPS, held)
    assert flies.choice.basis is Basis.WAY_OUT
    assert flies.way_out is not None
    assert flies.way_out.certain


def test_who_has_none_in_hand_does_not_stay_for_one_that_is_unsure():
    flies = decided(9.0, UNSURE_MPS, None)
    assert flies.choice.basis is not Basis.WAY_OUT
    assert flies.way_out is None or not flies.way_out.certain


def test_nothing_is_given_up_where_all_can_be_kept():
    assert decided(12.0, UNSURE_MPS, None).choice.basis is Basis.RATED
