"""Risk: entries weigh what even traffic says, encounters fly, ratios add up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError, InputError
from clearway.base.units import FOOT_M
from clearway.studies.encounter_model import make_up_model
from clearway.studies.risk.cylinder import Cylinder
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.entry import Entries, Shells
from clearway.studies.risk.flight import (
    STRAIGHT,
    Separation,
    fly_model_encounter,
    separation,
    separation_of,
    true_path_m,
)
from clearway.studies.risk.ratios import compute_risk, mean_aside_m
from clearway.studies.risk.settings import NEAR_COLLISION, WELL_CLEAR, RiskSettings
from clearway.studies.risk.study import RiskOutcome, RiskStudy, study

OUTER, INNER = Cylinder(3000.0, 400.0), Cylinder(400.0, 60.0)
TIMES = np.arange(0.0, 200.0, 0.25)
QUICK = RiskSettings(within_s=60.0, afterwards_s=10.0, radius_nmi=1.2)


def drift(kind):
    velocity = np.array([-40.0, 15.0, {"climbing": 6.0}.get(kind, 0.0)])
    path = TIMES[:, None] * velocity
    if kind == "turning":
        heading = np.arctan2(15.0, -40.0) + 0.03 * TIMES
        steps = 0.25 * np.hypot(40.0, 15.0) * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        path[1:, :2] = np.cumsum(steps, axis=0)[:-1]
    return velocity, path


def drawn(kind, shares, count, seed=1):
    velocity, path = drift(kind)
    entries = Entries(Shells(OUTER, (INNER,), shares), velocity, path)
    rng = np.random.default_rng(seed)
    points, weights = zip(*(entries.draw(rng) for _ in range(count)), strict=True)
    return velocity, path, np.array(points), np.array(weights)


def hit(path, points):
    off = path[None, ::4, :] + points[:, None, :]
    level = np.hypot(off[..., 0], off[..., 1])
    return ((level <= INNER.radius_m) & (np.abs(off[..., 2]) <= INNER.half_height_m)).any(axis=1)


def test_swept_volume_is_a_rectangle_and_a_disc():
    assert INNER.flux(np.array([3.0, 4.0, 0.0])) == pytest.approx(4 * 400 * 60 * 5)
    assert INNER.flux(np.array([0.0, 0.0, -2.0])) == pytest.approx(np.pi * 400**2 * 2)


@pytest.mark.parametrize("kind", ["level", "climbing"])
def test_straight_traffic_meets_the_inner_cylinder_in_proportion_to_swept_volumes(kind):
    velocity, path, points, weights = drawn(kind, (0.6,), 1500)
    met = hit(path, points)
    assert met.mean() > 0.55
    share = (weights * met).sum() / weights.sum()
    exact = INNER.flux(velocity) / OUTER.flux(velocity)
    spread = np.sqrt((((met - share) * weights) ** 2).sum()) / weights.sum()
    assert share == pytest.approx(exact, abs=4.0 * spread)
    assert spread < 0.15 * exact


@pytest.mark.parametrize("kind", ["level", "climbing", "turning"])
def test_weights_add_up_to_all_that_enters(kind):
    velocity, _, _, weights = drawn(kind, (0.6,), 1500)
    spread = weights.std() / np.sqrt(len(weights))
    assert weights.mean() == pytest.approx(OUTER.flux(velocity), abs=4.0 * spread)


def test_turning_traffic_weighs_the_same_whatever_is_drawn_more_often():
    _, path, points, weights = drawn("turning", (0.7,), 1000)
    _, _, plain, ones = drawn("turning", (0.0,), 6000)
    assert np.ptp(ones) < 1e-6 * ones[0]
    met, often = hit(path, plain), hit(path, points)
    share = (weights * often).sum() / weights.sum()
    assert share == pytest.approx(met.mean(), abs=4.0 * np.sqrt(met.mean() / len(plain)) * 1.3)
    assert often.mean() > 0.5


def test_entries_lie_on_the_cylinder_and_lead_in():
    velocity, _, points, weights = drawn("climbing", (0.5,), 300)
    level, entering = np.hypot(points[:, 0], points[:, 1]), weights > 0.0
    on_end = np.isclose(np.abs(points[:, 2]), OUTER.half_height_m)
    on_side = np.isclose(level, OUTER.radius_m)
    assert np.all(on_end | on_side)
    assert np.all(points[on_end & entering, 2] == -OUTER.half_height_m)
    assert np.all(points[on_side & entering, :2] @ velocity[:2] <= 0.0)


def test_encounters_depend_on_their_number_and_seed_alone():
    model = make_up_model()
    one, again = (sample_encounter(model, 3, QUICK) for _ in range(2))
    np.testing.assert_array_equal(one.position_m, again.position_m)
    assert one.weight == again.weight > 0.0
    for other in (sample_encounter(model, 4, QUICK), sample_encounter(model, 3, QUICK, seed=1)):
        assert not np.array_equal(one.position_m, other.position_m)
    entry = one.position_m[0]
    outer = QUICK.outer
    assert np.hypot(*entry[:2]) <= outer.radius_m + 1e-6
    assert np.abs(entry[2]) <= outer.half_height_m + 1e-6


def test_reports_lag_no_more_than_a_step_and_tracks_are_straight_between():
    encounter = sample_encounter(make_up_model(), 5, QUICK)
    times = np.array([0.0, 0.1, 0.26, 7.0, 12.34])
    for time_s, exact in zip(times, encounter.at_all(times), strict=True):
        position, _ = encounter.at(float(time_s))
        np.testing.assert_allclose(position, exact, atol=1e-6)
    moved = encounter.at(8.0)[0] - encounter.at(7.75)[0]
    np.testing.assert_allclose(encounter.at(8.0)[1], moved / 0.25, atol=1e-6)


def test_straight_flight_is_what_its_planner_flies():
    encounter = sample_encounter(make_up_model(), 2, QUICK)
    run = fly_model_encounter(encounter, "straight", QUICK)
    own = true_path_m(run, QUICK)
    np.testing.assert_allclose(own[:, 0], QUICK.own_mps * run.time_s, atol=1e-6)
    np.testing.assert_allclose(own[:, 1:], 0.0, atol=1e-6)
    flown = separation(own, encounter.at_all(run.time_s), QUICK)
    assert flown.nearest_m == pytest.approx(
        separation_of(encounter, STRAIGHT, QUICK)[0].nearest_m, abs=5.0
    )


def test_limits_are_cylinders_in_true_feet():
    def came(level_ft, height_ft):
        other = FOOT_M * np.array([[level_ft, 0.0, height_ft]])
        return separation(np.zeros((1, 3)), other, RiskSettings())

    assert came(1999.0, 249.0).lost_well_clear
    assert not came(1999.0, 251.0).lost_well_clear
    assert not came(2001.0, 0.0).lost_well_clear
    assert came(499.0, 99.0).near_collision
    assert not came(499.0, 101.0).near_collision
    assert came(30.0, 10.0).collision
    assert not came(60.0, 0.0).collision
    # The ball that is kept holds all of the well-clear cylinder.
    assert came(1999.9, 249.9).margin_lost
    assert RiskSettings().margin_m == pytest.approx(np.hypot(2000.0, 4 * 250.0) * FOOT_M)


def made_up_study(flags):
    """Outcomes from (weight, bad without, bad with)."""
    clear = Separation(False, False, False, False, 1e3, 0.0)
    outcomes = tuple(
        RiskOutcome(
            number,
            weight,
            0,
            replace(clear, near_collision=without),
            {"clearway": replace(clear, near_collision=bad, aside_m=10.0 * number)},
            {"clearway": 0},
        )
        for number, (weight, without, bad) in enumerate(flags)
    )
    return RiskStudy(RiskSettings(), ("clearway",), 0, outcomes)


def test_ratios_split_into_unresolved_and_induced():
    flags = [(1.0, True, True), (3.0, True, False), (2.0, False, True), (4.0, False, False)]
    found = compute_risk(made_up_study(flags * 40), "clearway", "near_collision")
    assert found.rate.value == pytest.approx(0.3)
    assert found.ratio.value == pytest.approx(0.75)
    assert found.unresolved.value == pytest.approx(0.25)
    assert found.induced.value == pytest.approx(0.5)
    assert found.ratio.low < 0.75 < found.ratio.high
    assert found.induced_cases[:2] == (2, 6)
    assert mean_aside_m(made_up_study(flags), "clearway") == pytest.approx(19.0)


def test_the_interval_is_that_of_the_binomial_for_equal_weights():
    flags = [(1.0, True, n % 4 == 0) for n in range(400)]
    found = compute_risk(made_up_study(flags), "clearway", "near_collision")
    spread = np.sqrt(0.25 * 0.75 / 400)
    assert found.ratio.low == pytest.approx(0.25 - 1.96 * spread, abs=0.006)
    assert found.ratio.high == pytest.approx(0.25 + 1.96 * spread, abs=0.006)


def test_nothing_seen_is_not_nothing_possible():
    flags = [(1.0, True, False)] * 50
    found = compute_risk(made_up_study(flags), "clearway", "near_collision")
    assert found.ratio.value == 0.0
    assert found.unresolved.high == pytest.approx(1.0 - 0.025 ** (1 / 50))
    assert found.ratio.high > found.unresolved.high, "induced ones may be unseen too"
    never = compute_risk(made_up_study([(1.0, False, False)] * 5), "clearway", "near_collision")
    assert np.isnan(never.ratio.value)


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(st.floats(0.05, 5.0), st.booleans(), st.booleans(), st.booleans()),
        min_size=2,
        max_size=25,
    ),
    st.integers(0, 24),
)
def test_an_encounter_that_turns_bad_never_lowers_the_upper_end(encounters, at):
    """Of the same encounters, with one more near mid-air collision among those without any."""
    at %= len(encounters)

    def upper(worse):
        clear = Separation(False, False, False, False, 1e3, 0.0)
        outcomes = []
        for number, (weight, without, bad, near) in enumerate(encounters):
            flown = bad or (worse and number == at)
            outer = near or without or flown or number == at
            came = [
                replace(clear, near_collision=flag, lost_well_clear=outer)
                for flag in (without, flown)
            ]
            outcomes.append(
                RiskOutcome(number, weight, 0, came[0], {"clearway": came[1]}, {"clearway": 0})
            )
        return compute_risk(
            RiskStudy(RiskSettings(), ("clearway",), 0, tuple(outcomes)),
            "clearway",
            "near_collision",
        ).ratio.high

    before, after = upper(False), upper(True)
    assert np.isnan(before) or after >= before - 1e-9


@pytest.mark.nightly
def test_a_study_is_the_same_for_any_number_of_processes():
    model, kind = make_up_model(), replace(QUICK, within_s=40.0)
    one = study(model, ["mvp"], range(11), kind)
    two = study(model, ["mvp"], range(11), kind, workers=2)
    assert one.outcomes == two.outcomes
    assert [outcome.number for outcome in one.outcomes] == list(range(11))


def test_avoiding_helps():
    result = study(make_up_model(), ["clearway", "mvp", "velocity-obstacle"], [3, 5, 6])
    met = [outcome for outcome in result.outcomes if outcome.straight.near_collision]
    assert len(met) == 3
    for planner in result.planners:
        assert not any(outcome.of(planner).near_collision for outcome in met), planner


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"own_kt": 0.0}, "own_kt"),
        ({"stretch": float("nan")}, "stretch"),
        ({"position_std_m": -1.0}, "position_std_m"),
        ({"range_movements": 2}, "range_movements"),
        ({"radius_nmi": 0.5}, "encounter cylinder"),
    ],
)
def test_impossible_settings_are_named(change, said):
    with pytest.raises(InputError, match=said):
        replace(RiskSettings(), **change)


def test_a_study_needs_encounters_and_workers():
    with pytest.raises(ClearwayError, match="encounter"):
        study(make_up_model(), ["mvp"], [])
    with pytest.raises(ClearwayError, match="workers"):
        study(make_up_model(), ["mvp"], range(1), workers=0)


def test_the_inner_cylinders_are_those_that_count():
    wide, near, _ = RiskSettings().shells.inner
    assert near == NEAR_COLLISION
    assert wide.radius_m > WELL_CLEAR.radius_m
