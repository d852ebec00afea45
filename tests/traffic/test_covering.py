"""Predicted places of other aircraft: they are there with 95 %, however they fly."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.studies.reliability.traffic_cover import ratios_of, starts_of, verdicts_of
from clearway.traffic.covering import (
    AHEAD_S,
    NO_STARTS,
    Covering,
    MovesAs,
    PlaceReport,
    claim_radius_m,
)
from clearway.traffic.growth import LIGHT_AIRCRAFT


def circling(seconds: int, radius_m: float = 120.0, speed_mps: float = 25.0) -> list[PlaceReport]:
    """A glider in a thermal that drifts and climbs."""
    turn = speed_mps / radius_m
    return [
        PlaceReport(
            float(t),
            np.array([radius_m * math.sin(turn * t) + 3.0 * t,
                      -radius_m * math.cos(turn * t), 2.0 * t]),
            np.array([speed_mps * math.cos(turn * t) + 3.0, speed_mps * math.sin(turn * t), 2.0]),
        )
        for t in range(0, seconds, 2)
    ]  # fmt: skip


def hovering(seconds: int, seed: int) -> list[PlaceReport]:
    """A helicopter that goes from place to place at walking pace, and reports no speed."""
    rng = np.random.default_rng(seed)
    place, moments = np.zeros(3), []
    for t in range(0, seconds, 2):
        place = place + np.append(rng.normal(0.0, 14.0, 2), 0.0)
        moments.append(PlaceReport(float(t), place, np.zeros(3)))
    return moments


@pytest.mark.parametrize("track", [circling(1_800), hovering(3_000, 3)], ids=["circles", "hovers"])
def test_places_of_who_circles_or_hovers_are_covered_as_claimed_once_they_were_seen(track):
    covering = Covering()
    found = [verdict for moment in track for verdict in covering.take(moment)]
    for ahead_s in AHEAD_S:
        later = [one.level for one in found if one.ahead_s == ahead_s][200:]
        assert len(later) > 400
        assert 0.90 <= np.mean(later) <= 0.98


def test_the_motion_is_told_by_speed_and_turns():
    def motion(speed_mps: float, turns: bool) -> MovesAs:
        return PlaceReport(0.0, np.zeros(3), np.array([speed_mps, 0.0, 0.0])).motion(turns=turns)

    assert motion(5.0, True) is MovesAs.HOVERING
    assert motion(60.0, True) is MovesAs.CIRCLING
    assert motion(60.0, False) is MovesAs.STRAIGHT
    assert motion(150.0, True) is MovesAs.AIRLINER


def test_who_circles_is_seen_to_circle_and_who_flies_straight_is_not():
    covering = Covering()
    for moment in circling(60, speed_mps=30.0):
        covering.take(moment)
    assert {region.motion for region in covering.regions} == {MovesAs.CIRCLING}
    for t in range(60, 120, 2):
        covering.take(
            PlaceReport(float(t), np.array([30.0 * t, 0.0, 0.0]), np.array([30.0, 0.0, 0.0]))
        )
    assert {region.motion for region in covering.regions} == {MovesAs.STRAIGHT}


def test_errors_as_declared_are_within_the_claimed_distance_in_95_of_100():
    kinds = LIGHT_AIRCRAFT.straight
    radius = claim_radius_m(kinds, 20.0, 50.0, True)
    share, steady, strays = (float(one[0]) for one in kinds.at(np.array([20.0])))
    rng = np.random.default_rng(6)
    std = np.where(rng.random(40_000) < share, 50.0 * strays, 50.0 * steady)
    unsure = math.hypot(15.0, 1.5 * 20.0)
    off = np.hypot(std, unsure) * np.hypot(*rng.normal(size=(2, 40_000)))
    assert np.mean(off <= radius) == pytest.approx(0.95, abs=0.005)


def test_a_report_that_comes_late_judges_nothing_and_the_same_reports_teach_the_same():
    track = circling(200)
    gap = [moment for moment in track if not 60.0 < moment.time_s < 100.0]
    covering = Covering()
    found = [one for moment in gap for one in covering.take(moment)]
    again = Covering()
    assert found == [one for moment in gap for one in again.take(moment)]
    assert len(found) < sum(len(track) - int(ahead) // 2 for ahead in AHEAD_S)


def test_factors_that_an_aircraft_begins_with_hold_95_of_100_at_each_time_ahead() -> None:
    """Level flight with heights that swing once in two minutes: 10 s ahead is another share of what
    light aircraft climb than 30 s ahead."""
    track = [
        PlaceReport(
            float(t),
            np.array([40.0 * t, math.sin(t), 100.0 * math.sin(2.0 * math.pi * t / 120.0)]),
            np.array([40.0, 0.0, 0.0]),
        )
        for t in range(0, 600, 2)
    ]
    starts = starts_of([ratios_of(track)])
    assert len(set(starts.height[MovesAs.STRAIGHT])) == len(AHEAD_S)
    assert starts.height[MovesAs.HOVERING] == NO_STARTS.height[MovesAs.HOVERING]
    # Factors are rounded to hundredths, and heights dwell where they turn.
    for verdicts in verdicts_of([track], starts, step=0.0).values():
        assert np.mean([one.height for one in verdicts]) == pytest.approx(0.95, abs=0.02)
