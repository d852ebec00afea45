"""A minute ahead: profiles, chances of being inside, the pair that is chosen, and in decisions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import ncx2, norm

import clearway as cw
from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.long_range.profiles import SECONDS, Motion, Wanted, profiles
from clearway.avoidance.long_range.rating import Other, across_disc, in_slab, rate_profiles
from clearway.avoidance.long_range.resolve import PassingSide, RiskPrices, Sense, resolve
from clearway.avoidance.long_range.two_horizons import WAVERS_S
from clearway.traffic.growth import HORIZONS_S, LIGHT_AIRCRAFT
from clearway.traffic.volumes import VOLUME_SETS
from clearway.vehicle.performance import PERFORMANCES

SMALL, WING = VOLUME_SETS["f3442"], PERFORMANCES["wing"]
HERE = Motion(np.zeros(3), 0.0, 25.0, 0.0)
AHEAD = Wanted(0.0, 25.0, 0.0)


def other(position, velocity, std_m=15.0):  # type: ignore[no-untyped-def]
    growth = LIGHT_AIRCRAFT.of(turns=False, climbs=False)
    return Other(np.array(position, float), np.array(velocity, float), std_m, 5.0, 1.0, 0.5, growth)


@given(st.floats(0.0, 4000.0), st.floats(1.0, 3000.0), st.floats(50.0, 1500.0))
def test_the_chance_of_a_disc_is_near_the_exact_one(apart, std, radius) -> None:  # type: ignore[no-untyped-def]
    exact = ncx2.cdf((radius / std) ** 2, 2, (apart / std) ** 2)
    disc = across_disc(std, radius) * in_slab(apart, std, radius)
    assert disc == pytest.approx(float(exact), abs=0.08)
    slab = norm.cdf((radius - apart) / std) - norm.cdf((-radius - apart) / std)
    assert in_slab(apart, std, radius) == pytest.approx(float(slab), abs=1e-9)


def test_profiles_begin_where_the_vehicle_is_and_end_on_their_courses() -> None:
    ways = profiles(HERE, AHEAD, WING)
    np.testing.assert_array_equal(ways.level_m[:, 0], 0.0)
    last = ways.level_m[:, -1] - ways.level_m[:, -2]
    course = np.arctan2(last[:, 1], last[:, 0])
    off = np.abs((course - ways.course_rad + np.pi) % (2.0 * np.pi) - np.pi)
    assert off.max() < 1e-6
    steps = np.linalg.norm(np.diff(ways.level_m, axis=1), axis=2)
    assert steps.max() <= 25.0 + 1e-9
    assert np.abs(np.diff(ways.height_m, axis=1)).max() <= 5.0 + 1e-9
    low = profiles(HERE, AHEAD, WING, floor_m=-20.0, ceiling_m=30.0).height_m
    assert low.min() >= -20.0
    assert low.max() <= 30.0


@settings(max_examples=40)
@given(
    st.floats(-3000.0, 3000.0), st.floats(-3000.0, 3000.0), st.floats(-150.0, 150.0),
    st.floats(-70.0, 70.0), st.floats(-70.0, 70.0), st.floats(-5.0, 5.0),
)  # fmt: skip
def test_tiers_are_never_lower_than_a_fine_walk_finds(x, y, z, vx, vy, vz) -> None:  # type: ignore[no-untyped-def]
    """Bits a second may say both at once a little early, never too late."""
    ways = profiles(HERE, AHEAD, WING)
    intruder = other([x, y, z], [vx, vy, vz])
    found = rate_profiles(ways, [intruder], SMALL)
    times = np.arange(0.0, SECONDS, 0.1)
    for level, climb in ((0, 1), (3, 2), (10, 6), (24, 9)):
        own = np.stack(
            [np.interp(times, np.arange(SECONDS + 1), ways.level_m[level, :, axis])
             for axis in range(2)]
            + [np.interp(times, np.arange(SECONDS + 1), ways.height_m[climb])], axis=1,
        )  # fmt: skip
        apart = intruder.position_m + times[:, None] * intruder.velocity_mps - own
        away, up = np.hypot(apart[:, 0], apart[:, 1]), np.abs(apart[:, 2])
        shapes = [SMALL.outermost.kept, *SMALL.volumes]
        inside = [bool(np.any((away < one.radius_m) & (up < one.half_height_m))) for one in shapes]
        assert found.tier[level, climb] >= sum(inside)


def test_risk_grows_with_what_is_not_known_far_off_and_is_never_above_one() -> None:
    ways = profiles(HERE, AHEAD, WING)
    far = [4000.0, 1500.0, 0.0], [-50.0, 0.0, 0.0]
    sure = rate_profiles(ways, [other(*far)], SMALL).probability
    unsure = rate_profiles(ways, [other(*far, std_m=400.0)], SMALL).probability
    assert unsure[0, 0, 1] > sure[0, 0, 1]
    both = rate_profiles(ways, [other(*far), other([3000.0, 0.0, 0.0], [-40.0, 0.0, 0.0])], SMALL)
    assert np.all(both.probability >= sure - 1e-12)
    assert np.all((both.probability >= 0.0) & (both.probability <= 1.0))
    assert np.all(both.probability[1] <= both.probability[0] + 0.05)


def test_nobody_near_is_flown_as_wanted() -> None:
    choice = resolve(HERE, AHEAD, [other([60_000.0, 0.0, 0.0], [-50.0, 0.0, 0.0])], WING, SMALL)
    assert not choice.avoids
    assert choice.tier == 0


def test_head_on_is_avoided_and_mirrored_alike() -> None:
    left = resolve(HERE, AHEAD, [other([3500.0, 250.0, 0.0], [-60.0, 0.0, 0.0])], WING, SMALL)
    right = resolve(HERE, AHEAD, [other([3500.0, -250.0, 0.0], [-60.0, 0.0, 0.0])], WING, SMALL)
    assert left.wanted_tier >= 2
    assert left.tier == right.tier == 0
    assert {left.side, right.side} == {PassingSide.LEFT, PassingSide.RIGHT}
    assert left.side is PassingSide.RIGHT, "away from where it passes"
    assert "deg right" in left.reason


def test_a_side_begun_is_kept_where_both_are_about_as_good() -> None:
    begun = resolve(HERE, AHEAD, [other([3500.0, 100.0, 0.0], [-60.0, 0.0, 0.0])], WING, SMALL)
    wavers = [other([3300.0, -100.0, 0.0], [-60.0, 0.0, 0.0])]
    anew = resolve(HERE, AHEAD, wavers, WING, SMALL)
    assert anew.side is not begun.side
    assert resolve(HERE, AHEAD, wavers, WING, SMALL, begun).side is begun.side
    free = RiskPrices(other_side=0.0, rerouted=0.0)
    assert resolve(HERE, AHEAD, wavers, WING, SMALL, begun, prices=free).side is anew.side


def test_deviations_grow_with_the_time_ahead() -> None:
    for kinds in (LIGHT_AIRCRAFT.straight, LIGHT_AIRCRAFT.turning, LIGHT_AIRCRAFT.level,
                  LIGHT_AIRCRAFT.climbing):  # fmt: skip
        share, steady, strays = kinds.at(np.linspace(0.0, 200.0, 50))
        assert np.all(np.diff(strays) >= 0.0)
        assert np.all((share >= 0.0) & (share <= 1.0))
        assert np.all(steady[1:] > 0.0)
        assert strays[0] == 0.0
    assert HORIZONS_S[0] == 0.0


@pytest.fixture(scope="module")
def planner():  # type: ignore[no-untyped-def]
    automaton = cw.MovementAutomaton.plane(speed_mps=20.0, turn_step_deg=15.0, pitch_limit_deg=15.0)
    grid = cw.AvoidanceGrid.uniform(200.0, 10)
    library = cw.ReachLibrary.load_or_build(automaton, grid)
    return cw.Planner.of(library, cw.AvoidanceSettings(safety_margin_m=8.0, escape="off"))


def test_both_horizons_decide_together(planner) -> None:  # type: ignore[no-untyped-def]
    """Near obstacles close one side; the aircraft kilometres off is passed on the other."""
    keeps = planner.with_values(volumes=SMALL)
    here, there = cw.State(np.zeros(3)), np.array([5000.0, 0.0, 0.0])
    intruder = cw.Intruder(np.array([2500.0, 100.0, 0.0]), np.array([-50.0, 0.0, 0.0]), name="x")

    def decided(planner_, *walls):  # type: ignore[no-untyped-def]
        charted = cw.ObstacleMap(list(walls)) if walls else None
        situation = cw.Situation(here, there, intruders=(intruder,), obstacle_map=charted)
        return cw.decide(planner_, situation)

    unaware, free = decided(planner), decided(keeps)
    assert unaware.long_range is None
    assert free.long_range is not None
    assert free.long_range.wanted_tier >= 2
    assert free.long_range.tier < free.long_range.wanted_tier
    box = [
        cw.Obstacle("cuboid", np.array([100.0, side * 60.0, 0.0]), orientation_rad=np.zeros(3),
                    size_m=(200.0, 60.0, 200.0))
        for side in (-1.0, 1.0)
    ]  # fmt: skip
    for side, wall in zip((-1.0, 1.0), box, strict=True):
        walled = decided(keeps, wall)
        assert walled.choice.clearance_m >= walled.margin_m
        ends = walled.path_m[:, 1] * side
        assert ends.max() < 30.0, "the wall is not flown into, whoever comes"
    assert decided(keeps, *box).choice.clearance_m >= 8.0


def test_a_decision_stays_with_the_side_of_the_last_one(planner) -> None:  # type: ignore[no-untyped-def]
    keeps = planner.with_values(volumes=SMALL)
    here, there = cw.State(np.zeros(3)), np.array([5000.0, 0.0, 0.0])
    chosen = []
    before = None
    rng = np.random.default_rng(2)
    for second in range(6):
        place = np.array([2600.0 - 70.0 * second, 60.0 * rng.normal(), 5.0 * rng.normal()])
        near = cw.Intruder(place, np.array([-50.0, 0.0, 0.0]), name="x")
        decision = cw.decide(keeps, cw.Situation(here, there, intruders=(near,)),
                             commitment=Commitment(long_range=before))  # fmt: skip
        before = decision.long_range
        assert before is not None
        chosen.append((before.side, before.sense))
    sides = {side for side, _ in chosen if side is not PassingSide.AHEAD}
    assert len(sides) <= 1


def test_the_side_begun_is_left_for_a_volume_less_once_that_has_lasted(planner) -> None:  # type: ignore[no-untyped-def]
    level = replace(planner.settings, volumes=SMALL, lowest_m=-3.0, highest_m=3.0)
    keeps = replace(planner, settings=level)
    here, there = cw.State(np.zeros(3)), np.array([5000.0, 0.0, 0.0])
    crossing = cw.Intruder(np.array([1200.0, -1500.0, 0.0]), np.array([-20.0, 45.0, 0.0]), name="x")
    situation = cw.Situation(here, there, intruders=(crossing,))

    def decided(before=None):  # type: ignore[no-untyped-def]
        found = cw.decide(keeps, situation, commitment=Commitment(long_range=before)).long_range
        assert found is not None
        return found

    free = decided()
    assert free.side is not PassingSide.AHEAD
    other = PassingSide.LEFT if free.side is PassingSide.RIGHT else PassingSide.RIGHT
    begun = replace(free, side=other, begun_side=other, begun_sense=Sense.LEVEL)
    kept = decided(begun)
    assert kept.tier > free.tier, "or there is nothing to leave it for"
    assert kept.begun_side is other
    assert kept.worse_since_s == 0.0
    left = decided(replace(begun, worse_since_s=-WAVERS_S))
    assert left.side is free.side
    assert left.tier == free.tier
    assert left.worse_since_s is None
