"""Conformal bounds: exchangeable scores are covered, and levels follow scores that drift."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom

from clearway.base.conformal import (
    LEVELS,
    MISSES,
    SHARE,
    STEP,
    conformal_quantile,
    level_after,
    quantile_at,
    quantile_table,
)

number = st.floats(-1e6, 1e6)


@pytest.mark.parametrize("draw", ["normal", "standard_cauchy", "exponential"])
def test_the_next_of_exchangeable_scores_is_below_the_quantile_as_often_as_stated(draw):
    """Trials are independent: each draws its own calibration scores and the next one."""
    rng = np.random.default_rng(5)
    trials, scores = 4_000, 99
    drawn = getattr(rng, draw)(size=(trials, scores + 1))
    held = sum(row[-1] <= conformal_quantile(row[:-1], 0.05) for row in drawn)
    low, high = binom.ppf([0.0005, 0.9995], trials, SHARE)
    assert low <= held <= high


@given(st.lists(number, min_size=1, max_size=60), st.floats(0.001, 0.999))
def test_the_quantile_is_a_score_that_enough_others_do_not_exceed(scores, level):
    found = conformal_quantile(scores, level)
    if math.isinf(found):
        assert (len(scores) + 1) * (1.0 - level) > len(scores) or level > 0.5
    else:
        assert found in scores
        assert sum(one <= found for one in scores) >= (len(scores) + 1) * (1.0 - level) - 1e-6


def test_a_table_is_asked_at_the_next_lower_level_and_says_nothing_below_all():
    table = quantile_table(np.arange(2_000.0))
    assert all(a >= b for a, b in itertools.pairwise(table))
    for level, quantile in zip(LEVELS, table, strict=True):
        assert quantile_at(table, level) == quantile
        assert quantile_at(table, level + 1e-4) == quantile
    assert quantile_at(table, 0.0) == math.inf


def bounds_held(scores: np.ndarray, table: tuple[float, ...]) -> np.ndarray:
    """Which bounds of a run hold that learns its level."""
    level, held = MISSES, []
    for score in scores:
        held.append(bool(score <= quantile_at(table, level)))
        level = level_after(level, missed=not held[-1])
    return np.array(held)


def test_a_learned_level_recovers_after_a_shift_that_a_fixed_one_does_not():
    rng = np.random.default_rng(8)
    table = quantile_table(rng.normal(size=20_000))
    shifted = np.concatenate([rng.normal(size=1_000), rng.normal(scale=1.5, size=3_000)])
    fixed = shifted <= quantile_at(table, 0.05)
    learned = bounds_held(shifted, table)
    assert fixed[1_000:].mean() < 0.90
    assert 0.93 <= learned[:1_000].mean() <= 0.98
    assert 0.93 <= learned[2_000:].mean() <= 0.97


@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 30.0))
def test_over_many_bounds_the_share_that_fails_is_near_the_stated_one_whatever_comes(seed, shift):
    """Gibbs and Candes' proposition 4.1, of scores chosen at will."""
    rng = np.random.default_rng(seed)
    table = quantile_table(np.linspace(-2.0, 2.0, 5_000))
    scores = rng.normal(size=800) * rng.choice([0.1, 1.0, 20.0], size=800) + shift
    missed = 1.0 - bounds_held(scores, table).mean()
    assert missed <= 1.0 - SHARE + (1.0 + STEP) / (STEP * len(scores))
