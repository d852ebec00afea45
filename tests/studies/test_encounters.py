"""Encounters with intruders: random ones by the dozen, and the missions of 6.5."""

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError
from clearway.base.intervals import wilson
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import prepare
from clearway.studies.encounters.encounter import (
    STANDARD_KINDS,
    EncounterSettings,
    random_encounter,
)
from clearway.studies.encounters.flights import EncounterOutcome, EncounterTally, fly_encounters

KEEP = 1.2
MET = 10
"""Encounters of each kind; `clearway encounters` flies them by the thousand."""


@pytest.mark.parametrize("detected_at", [10.0, 6.0])
def test_encounters_are_true_collision_courses_from_any_bearing(detected_at):
    met = [random_encounter(seed, EncounterSettings(detected_at)) for seed in range(300)]
    speeds = np.array([np.linalg.norm(each.velocity_mps) for each in met])
    bearings = np.degrees([each.bearing_rad for each in met])
    climbs = np.array([each.velocity_mps[2] for each in met])
    assert max(each.straight_miss_m for each in met) < 1e-9
    np.testing.assert_allclose([np.linalg.norm(e.position_m) for e in met], detected_at)
    assert 0.5 <= speeds.min() < 0.55
    assert 0.95 < speeds.max() <= 1.0
    assert bearings.min() < -65.0
    assert bearings.max() > 65.0
    assert climbs.min() < -0.3
    assert climbs.max() > 0.3
    # Some come head on, some are caught up with from behind.
    assert min(each.velocity_mps[0] for each in met) < -0.8
    assert max(each.velocity_mps[0] for each in met) > 0.5


def test_the_scale_multiplies_lengths_and_speeds_and_nothing_else():
    small, large = (random_encounter(7, EncounterSettings(scale=scale)) for scale in (1.0, 15.0))
    np.testing.assert_allclose(large.position_m, 15.0 * small.position_m)
    np.testing.assert_allclose(large.velocity_mps, 15.0 * small.velocity_mps)
    assert large.collision_s == pytest.approx(small.collision_s)


def test_a_miss_stays_below_what_was_asked_for():
    settings = EncounterSettings(miss_m=0.5)
    misses = [random_encounter(seed, settings).straight_miss_m for seed in range(200)]
    assert max(misses) <= 0.5
    assert max(misses) > 0.4


def test_late_decisions_are_taken_on_the_same_collision_course():
    for seed in range(50):
        early, late = (random_encounter(seed, EncounterSettings(6.0, late_s=s)) for s in (0.0, 1.5))
        np.testing.assert_allclose(late.position_m, early.position_m + 1.5 * early.closing_mps)
        np.testing.assert_array_equal(late.velocity_mps, early.velocity_mps)
        assert late.collision_s == pytest.approx(early.collision_s - 1.5)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ({"detected_at_m": 0.0}, "detected_at_m"),
        ({"detected_at_m": float("nan")}, "detected_at_m"),
        ({"scale": -1.0}, "scale"),
        ({"position_noise_m": float("inf")}, "position_noise_m"),
        ({"miss_m": 10.0}, "miss_m"),
        ({"late_s": -1.0}, "late_s"),
        ({"late_s": 5.0}, "late_s"),
        ({"spread_rad": (1.6, 0.1)}, "spread: must"),
    ],
)
def test_impossible_encounters_are_refused(setting, said):
    with pytest.raises(InputError, match=said):
        EncounterSettings(**setting)


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, id=kind.in_words, marks=[pytest.mark.nightly] if 0 < n < 5 else [])
        for n, kind in enumerate(STANDARD_KINDS[:6])
    ],
)
def test_encounters_that_can_be_avoided_are_avoided(kind):
    tally = fly_encounters(kind, range(MET))
    assert len(tally.outcomes) == MET
    assert tally.failures == ()
    assert tally.min_distance_m >= KEEP
    # From 6 m on every one can be avoided at once; later, or from 4 m, a good quarter cannot.
    in_time = kind.detected_at_m >= 6.0 and kind.late_s == 0.0
    assert (tally.avoidable == MET) == in_time


@pytest.mark.nightly
def test_nothing_is_tied_to_metres():
    small, large = (fly_encounters(EncounterSettings(scale=scale), range(6)) for scale in (1, 15))
    assert large.failures == ()
    np.testing.assert_allclose(
        [each.min_distance_m for each in large.outcomes],
        [15.0 * each.min_distance_m for each in small.outcomes],
        rtol=1e-6,
    )


@pytest.mark.nightly
def test_workers_do_not_change_results():
    kind = EncounterSettings(4.0, deviates=True)
    assert fly_encounters(kind, range(40), 1) == fly_encounters(kind, range(40), 2)


def test_encounters_that_cannot_be_won_do_not_count():
    outcomes = (
        EncounterOutcome(0, 1.3, True, True, 0),
        EncounterOutcome(1, 0.9, False, True, 1),
        EncounterOutcome(2, 0.2, False, False, 3),
    )
    tally = EncounterTally(EncounterSettings(4.0), outcomes)
    assert (tally.avoidable, tally.kept, tally.share) == (2, 1, 0.5)
    assert [each.seed for each in tally.failures] == [1]
    assert tally.min_distance_m == 0.9


def test_less_is_asked_of_late_and_noisy_encounters():
    kinds = {kind.in_words: EncounterTally(kind, ()).required for kind in STANDARD_KINDS[:6]}
    assert list(kinds.values()) == [0.999, 0.999, 0.99, 0.99, 0.99, 0.99]


def test_no_workers_are_refused():
    with pytest.raises(ClearwayError, match="workers"):
        fly_encounters(EncounterSettings(), range(2), 0)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_intervals_as_published(successes, trials, low, high):
    """Newcombe, Statistics in Medicine 17 (1998), table I, method 3."""
    assert wilson(successes, trials) == pytest.approx((low, high), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("name", "straight", "hits"), [("intruders-collision", 0.5, 8), ("intruders", 1.5, 0)]
)
def test_the_missions_of_6_5(name, straight, hits):
    """Straight flight collides where intruders were moved to do so, and passes as printed."""
    setup = prepare(read_mission_file(name))
    run = setup.fly()
    assert run.safe
    assert run.emergencies == 0
    assert run.metrics.intruders.min_distance_m >= KEEP
    # What straight flight would have come to, and what it comes to when it is flown.
    flown = setup.fly_with("straight").metrics
    for found in (run.metrics.straight, flown.straight, flown.intruders):
        assert found.min_distance_m == pytest.approx(straight, abs=1e-6)
        assert found.violations == hits
    assert len(run.intruder_tracks) == 8


@pytest.mark.parametrize(("price", "behind"), [(0.0, 0), (16.0, 2)])
def test_a_price_for_crossing_ahead_passes_more_of_them_behind(price, behind):
    """Who has begun to pass on one side stays with it: not all of eight that come one by one."""
    tables = read_mission_file("intruders").effective()
    tables["prices"]["ahead"] = price
    run = prepare(parse_model("test", tables, MissionFile)).fly()
    assert run.safe
    passed_behind = 0
    for track in run.intruder_tracks.values():
        start = int(np.searchsorted(run.time_s, track[0, 0] - 1e-9))
        own = run.states[start : start + len(track), :3]
        crossing = np.flatnonzero(np.diff(np.sign(own[:, 0] - track[:, 1])))[0]
        # They fly to the right: ahead of one is to its right.
        passed_behind += own[crossing, 1] > track[crossing, 2]
    assert passed_behind >= behind
    assert behind or not passed_behind


def test_a_mission_with_noisy_reports_is_flown_through_the_tracker():
    tables = read_mission_file("intruders-collision").effective()
    tables["traffic"] |= {
        "position_sigma_m": 0.3,
        "velocity_sigma_mps": 0.1,
        "tracker": True,
    }
    setup = prepare(parse_model("test", tables, MissionFile))
    assert setup.planner.settings.tracker is not None
    run = setup.fly()
    assert run.safe
    first = run.decisions[-1].flight.decision.intruders
    assert set(first) <= set(run.intruder_tracks), "tracks are named by what reported itself"
