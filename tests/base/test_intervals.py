"""Intervals for rare, weighted events: exact for equal weights, and never narrower by an event."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from clearway.base.intervals import Interval, bound_weighted_share, poisson_sum, ratio_of, sum_of
from clearway.base.verdict import DemandVerdict, at_most, judge_at_least, worst_of

WEIGHTS = st.lists(st.floats(0.01, 10.0), min_size=0, max_size=12)
SHOWN, NOT_SHOWN, MISSED = DemandVerdict


@pytest.mark.parametrize("events", [0, 1, 3, 20])
def test_equal_weights_give_garwoods_interval(events):
    found = poisson_sum([2.0] * events, 2.0)
    low = 0.0 if not events else 2.0 * chi2.ppf(0.025, 2 * events) / 2.0
    assert found.low == pytest.approx(low)
    assert found.high == pytest.approx(2.0 * chi2.ppf(0.975, 2 * events + 2) / 2.0)


def test_equal_weights_give_clopper_and_pearsons_interval():
    found = bound_weighted_share([False] * 50, [3.0] * 50)
    assert found.high == pytest.approx(1.0 - 0.025 ** (1 / 50))
    found = bound_weighted_share([True] + [False] * 9, [1.0] * 10)
    assert (found.low, found.high) == pytest.approx((0.0025286, 0.4450161), abs=1e-6)


@given(WEIGHTS, st.floats(0.01, 10.0), st.floats(0.01, 10.0))
def test_an_event_more_never_lowers_the_upper_end(weights, more, unseen):
    before, after = poisson_sum(weights, unseen), poisson_sum([*weights, more], unseen)
    assert after.high >= before.high - 1e-9
    under = Interval(20.0, 12.0, 30.0)
    assert ratio_of(after, under).high >= ratio_of(before, under).high - 1e-9
    share = Interval(0.1, 0.05, 0.2)
    ends = [sum_of(share, ratio_of(one, under)).high for one in (before, after)]
    assert ends[1] >= ends[0] - 1e-9


@given(st.lists(st.tuples(st.floats(0.01, 10.0), st.booleans()), min_size=1, max_size=30))
def test_a_trial_that_turns_bad_never_lowers_the_upper_end(trials):
    weights = [weight for weight, _ in trials]
    bad = [flag for _, flag in trials]
    before = bound_weighted_share(bad, weights)
    for number, flag in enumerate(bad):
        if not flag:
            worse = bound_weighted_share([*bad[:number], True, *bad[number + 1 :]], weights)
            assert worse.high >= before.high - 1e-12
    assert before.low <= before.value + 1e-12
    assert before.value <= before.high + 1e-12


@pytest.mark.parametrize("heavier", [-0.5, 0.0, 1.0])
def test_the_upper_end_of_a_ratio_holds_what_it_promises(heavier):
    """400 studies drawn with a known ratio; heavier: how events favour large weights."""
    rng = np.random.default_rng(11)
    n, bad_before, unresolved, induced = 300, 0.3, 0.05, 0.003

    def draw(size):
        weights = np.exp(rng.normal(0.0, 0.8, size))
        favour = weights**heavier / np.mean(weights**heavier)
        chance = rng.random((3, size))
        without = chance[0] < bad_before
        bad = np.where(without, chance[1] < unresolved * favour, chance[2] < induced * favour)
        return weights, without, bad

    weights, without, bad = draw(2_000_000)
    truth = weights[bad].sum() / weights[without].sum()
    missed = 0
    for _ in range(400):
        weights, without, bad = draw(n)
        unseen = float((weights**2).sum() / weights.sum())
        share = bound_weighted_share(bad[without], weights[without])
        beside = ratio_of(
            poisson_sum(weights[bad & ~without], unseen), poisson_sum(weights[without], unseen)
        )
        missed += sum_of(share, beside).high < truth
    # 2.5 % of 400 are 10; 20 or more would come by chance in three of a thousand runs.
    assert missed < 20


def test_nothing_to_divide_by_shows_nothing():
    found = ratio_of(Interval(0.0, 0.0, 1.0), Interval(0.0, 0.0, 3.0))
    assert np.isnan(found.value)
    assert at_most(found.low, found.high, 0.18) is NOT_SHOWN


@pytest.mark.parametrize(
    ("low", "high", "said"), [(0.0, 0.18, SHOWN), (0.0, 0.19, NOT_SHOWN), (0.181, 0.9, MISSED)]
)
def test_limits_are_judged_by_the_upper_end(low, high, said):
    assert at_most(low, high, 0.18) is said


@pytest.mark.parametrize(
    ("low", "high", "said"), [(0.999, 1.0, SHOWN), (0.99, 1.0, NOT_SHOWN), (0.9, 0.99, MISSED)]
)
def test_needs_are_judged_by_the_lower_end(low, high, said):
    assert judge_at_least(low, high, 0.999) is said


def test_the_worst_verdict_counts_and_none_shows_nothing():
    assert worst_of([SHOWN, NOT_SHOWN, MISSED]) is MISSED
    assert worst_of([SHOWN, NOT_SHOWN]) is NOT_SHOWN
    assert worst_of([SHOWN]) is SHOWN
    assert worst_of([]) is NOT_SHOWN
