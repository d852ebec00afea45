"""Combination of models and intruders (5.36), (5.37), and what may be asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.traffic import (
    Intruder,
    assess_intruders,
    combine_intruders,
    radial_vehicle_times,
)
from clearway.traffic.models.combined import MODELS, may_meet
from clearway.traffic.models.timing import TIMED_RULES

GRID = AvoidanceGrid.uniform()
TIMES = radial_vehicle_times(GRID, 1.0)
FLANK = Intruder([6, 8, 0], [0, -1, 0], spread_rad=[np.pi / 12, np.pi / 16], radius_m=1.0)


def test_first_intruder_of_table_6_2() -> None:
    first = Intruder([6, 8, -0.5], [0, -1, 0], spread_rad=[np.pi / 16, np.pi / 24])
    cells = assess_intruders(GRID, [first], models=["line", "spread"], accuracy="reference")
    assert np.count_nonzero(cells.probability) == 77
    assert cells.probability.sum() == pytest.approx(15.1454, abs=1e-3)


def test_timed_known_answers(known_answers: dict[str, Any]) -> None:
    answers = known_answers["intruder"]
    for model, part, key, tolerance in (
        ("line", "line", "P_timed_5_5", 1e-8),
        ("body", "body_radius_1", "timed_volume", 0.02),
        ("spread", "spread", "timed", 0.015),
    ):
        cells = assess_intruders(GRID, [FLANK], [model], timed=True, vehicle_times=TIMES)
        expected = np.array(answers[part][key], dtype=np.float64).ravel()
        np.testing.assert_allclose(cells.probability, expected, rtol=0, atol=tolerance)
        timed = cells.intruders[0][model].timed
        assert timed is not None
        np.testing.assert_array_equal(timed, cells.probability)


@pytest.mark.parametrize("timed", [False, *TIMED_RULES])
def test_largest_of_the_chosen_models(timed: bool | str) -> None:
    models = ["line", "body", "spread"]
    together = assess_intruders(GRID, [FLANK], models, timed, TIMES)
    alone = [assess_intruders(GRID, [FLANK], [m], timed, TIMES).probability for m in models]
    np.testing.assert_array_equal(together.probability, np.max(alone, axis=0))


def test_several_intruders_combine() -> None:
    other = Intruder([9, -5, 1], [-1, 0.7, 0], spread_rad=[0.2, 0.1], radius_m=0.5)
    both = assess_intruders(GRID, [FLANK, other])
    single = [assess_intruders(GRID, [i]).probability for i in (FLANK, other)]
    expected = 1.0 - (1.0 - single[0]) * (1.0 - single[1])
    np.testing.assert_allclose(both.probability, expected, atol=1e-12)
    np.testing.assert_array_equal(both.each, single)


@given(st.lists(st.lists(st.floats(0, 1), min_size=4, max_size=4), max_size=6))
def test_more_intruders_never_lower_the_probability(each: list[list[float]]) -> None:
    array = np.array(each, dtype=np.float64).reshape(-1, 4)
    combined = combine_intruders(array)
    assert combined.shape == (4,)
    assert np.all((combined >= 0.0) & (combined <= 1.0))
    assert np.all(combined >= array.max(axis=0, initial=0.0) - 1e-12)


def test_without_intruders_nothing_is_met() -> None:
    cells = assess_intruders(GRID, [], models=list(MODELS), timed=True, vehicle_times=TIMES)
    np.testing.assert_array_equal(cells.probability, 0.0)
    assert cells.intruders == []


@given(
    st.lists(st.sampled_from([0.0, -0.0, 1e-9, 0.5, 6.0, -10.0, 1e9]), min_size=3, max_size=3),
    st.lists(st.sampled_from([0.0, -0.0, 1e-200, 1e-12, 1.0, -3.0, 1e9]), min_size=3, max_size=3),
    st.lists(st.sampled_from([0.0, 1e-9, 0.3, 1.57]), min_size=2, max_size=2),
    st.sampled_from([0.0, 1e-9, 0.5, 20.0, 1e9]),
)
@settings(max_examples=150, deadline=None)
def test_never_nan_on_top_of_the_ownship_standing_or_tiny(
    position: list[float], velocity: list[float], spread: list[float], radius: float
) -> None:
    intruder = Intruder(position, velocity, spread_rad=spread, radius_m=radius)
    models = ["line", "body", "spread", "tube"]
    for timed in (False, True, "shorter", "future"):
        cells = assess_intruders(GRID, [intruder], models, timed, TIMES)
        assert np.all((cells.probability >= 0.0) & (cells.probability <= 1.0))
    for model in cells.models.values():
        met = model.probability > 0.0
        assert not np.any(np.isnan(model.entry_s[met]) | np.isnan(model.leave_s[met]))
        assert not np.any(np.isnan(model.dwell_s))


def test_a_thousand_intruders() -> None:
    rng = np.random.default_rng(3)
    crowd = [
        Intruder(
            rng.normal(size=3) * 20, rng.normal(size=3) * 5, spread_rad=[0.2, 0.1], radius_m=0.5
        )
        for _ in range(1000)
    ]
    cells = assess_intruders(GRID, crowd)
    assert not np.any(np.isnan(cells.probability))
    assert cells.each.shape == (1000, GRID.cells)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"models": ["line", "cone"]}, "choose from line, body, spread"),
        ({"models": "line"}, "choose from"),
        ({"models": []}, "choose from"),
        ({"timed": "sometimes", "vehicle_times": TIMES}, "choose from vehicle"),
        ({"timed": True}, "vehicle_times"),
        ({"up": [0, 0, 0]}, "up"),
        ({"up": [0, np.nan, 1]}, "up"),
    ],
)
def test_what_cannot_be_asked_for(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ClearwayError, match=message):
        assess_intruders(GRID, [FLANK], **arguments)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), speed_mps=st.floats(0.3, 30.0), spread_rad=st.floats(0.0, 0.6))
def test_who_passes_the_grid_by_says_nothing_of_any_cell(seed, speed_mps, spread_rad) -> None:
    rng = np.random.default_rng(seed)
    intruders = []
    for _ in range(6):
        place, aim = rng.normal(size=3), rng.normal(size=3)
        place *= rng.uniform(5.0, 60.0) / np.linalg.norm(place)
        way = aim * rng.uniform(8.0, 14.0) / np.linalg.norm(aim) - place
        velocity = way * rng.choice([1.0, -1.0]) * speed_mps / np.linalg.norm(way)
        intruders.append(
            Intruder(place, velocity, spread_rad=np.array([spread_rad, 0.5 * spread_rad]))
        )
    together = assess_intruders(GRID, intruders, up=rng.normal(size=3))
    for name in together.models:
        alone = MODELS[name](GRID, intruders, np.array([0.0, 0.0, 1.0]), "fast")
        assert not alone.probability[~may_meet(GRID, intruders)].any()
        assert np.isnan(together.models[name].entry_s[~may_meet(GRID, intruders)]).all()


def test_who_flies_away_is_not_looked_at_and_who_comes_is() -> None:
    away = Intruder([50, 0, 0], [5, 0, 0], spread_rad=[0.2, 0.2])
    comes = Intruder([50, 0, 0], [-5, 0.5, 0], spread_rad=[0.2, 0.2])
    assert may_meet(GRID, [away, comes, FLANK]).tolist() == [False, True, True]
    of_all = assess_intruders(GRID, [away, comes, FLANK])
    alone = assess_intruders(GRID, [comes, FLANK])
    assert not of_all.each[0].any()
    assert np.array_equal(of_all.each[1:], alone.each)
    assert np.array_equal(of_all.probability, alone.probability)
