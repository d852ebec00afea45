"""Encounters at real scale: dynamics that take time, the ground, planners, and what is kept."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError
from clearway.base.units import FOOT_M
from clearway.studies.encounter_model import make_up_model
from clearway.studies.risk.encounter import ModelEncounter, sample_encounter
from clearway.studies.risk.flight import STRAIGHT, separation, separation_of
from clearway.studies.risk.long_flight import choose_performance, fly_long
from clearway.studies.risk.long_planners import LONG_PLANNERS, Steer
from clearway.studies.risk.ratios import by_layer, effective_number, weigh_encounters, worst_cases
from clearway.studies.risk.settings import RiskSettings
from clearway.studies.risk.study import study
from clearway.studies.risk.summary import replay_command, summary

KIND = RiskSettings.real_scale("wing", "ads-b", 4000.0)


def met(position, velocity, lasts_s=120.0, height_m=500.0):  # type: ignore[no-untyped-def]
    """An intruder that flies straight on."""
    time = np.arange(0.0, lasts_s + 60.0, 0.25)
    velocity = np.array(velocity, dtype=np.float64)
    path = np.array(position, dtype=np.float64) + time[:, None] * velocity
    flies = np.tile(velocity, (len(time), 1))
    return ModelEncounter(0, 1.0, time, path, flies, lasts_s, 0, height_m)


HEAD_ON = met([8000.0, 30.0, 10.0], [-60.0, 0.0, 0.0])


def steady(course_rad: float, climb_mps: float):  # type: ignore[no-untyped-def]
    return lambda view: Steer(course_rad, view.wanted.speed_mps, climb_mps, 0, 0)


def test_turns_and_climbs_take_their_time() -> None:
    """Nothing moves before the reaction, then rates come on, and never exceed what is possible."""
    near = met([500.0, 0.0, 2000.0], [0.0, 0.0, 0.0], 60.0)
    kind = replace(KIND, surveillance="perfect")
    flown = fly_long(near, steady(np.pi / 2, 5.0), kind)
    able = choose_performance(kind)
    moved = np.diff(flown.own_m, axis=0) * 4.0
    course = np.arctan2(moved[:, 1], moved[:, 0])
    began = flown.time_s[1:][np.abs(course) > 1e-6][0]
    assert began >= able.reaction_s
    rates = np.abs(np.diff(np.unwrap(course))) * 4.0
    assert rates.max() <= able.turn_rps(25.0) * 1.01
    assert rates[: int(4 * (began + 0.5))].max() < 0.8 * able.turn_rps(25.0)
    assert course[-1] == pytest.approx(np.pi / 2, abs=0.01)
    assert moved[:, 2].max() <= 5.0
    slow = flown.time_s[1:][moved[:, 2] > 0.6 * 5.0][0]
    assert slow - able.reaction_s == pytest.approx(able.climb_onset_s, abs=1.0)


def test_the_ground_and_the_ceiling_are_kept() -> None:
    low = met([500.0, 0.0, 1000.0], [0.0, 0.0, 0.0], 60.0, height_m=100.0 * FOOT_M)
    down = fly_long(low, steady(0.0, -5.0), replace(KIND, surveillance="perfect"))
    heights = down.own_m[:, 2] / FOOT_M + 100.0
    assert heights.min() > 50.0 - 40.0
    assert heights[-1] == pytest.approx(50.0, abs=40.0)
    up = fly_long(low, steady(0.0, 5.0), replace(KIND, surveillance="perfect", ceiling_ft=400.0))
    assert (up.own_m[:, 2] / FOOT_M + 100.0).max() < 440.0


def test_nobody_in_range_is_straight_flight() -> None:
    flown = fly_long(met([90_000.0, 0.0, 0.0], [0.0, 0.0, 0.0], 40.0), "clearway", KIND)
    np.testing.assert_allclose(flown.own_m[:, 1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(flown.own_m[:, 0], 25.0 * flown.time_s, atol=1e-6)


@pytest.mark.nightly
@pytest.mark.parametrize("planner", [name for name in LONG_PLANNERS if name != STRAIGHT])
def test_head_on_everybody_avoids_a_near_miss(planner: str) -> None:
    without = separation_of(HEAD_ON, STRAIGHT, KIND)[0]
    came = separation_of(HEAD_ON, planner, KIND)[0]
    assert without.near_collision
    assert not came.near_collision
    assert came.nearest_m > without.nearest_m


def test_clearway_keeps_well_clear_head_on_without_a_change_of_side() -> None:
    for surveillance in ("perfect", "ads-b"):
        for offset in (-200.0, 0.0, 200.0):
            meets = met([8000.0, offset, 0.0], [-60.0, 0.0, 0.0])
            flown = fly_long(meets, "clearway", replace(KIND, surveillance=surveillance))
            came = separation(flown.own_m, flown.other_m, KIND)
            assert not came.lost_well_clear, (surveillance, offset)
            assert flown.side_reversals == 0


def test_flights_depend_on_number_and_settings_alone() -> None:
    model = make_up_model()
    encounter = sample_encounter(model, 3, KIND)
    assert encounter.own_height_m >= 50.0 * FOOT_M
    one, again = (fly_long(encounter, "clearway", KIND) for _ in range(2))
    np.testing.assert_array_equal(one.own_m, again.own_m)


def test_a_study_goes_on_where_it_was_cut_off(tmp_path) -> None:  # type: ignore[no-untyped-def]
    model, journal = make_up_model(), tmp_path / "kept.jsonl"
    kind = replace(KIND, within_s=60.0, afterwards_s=10.0)
    whole = study(model, ["mvp"], range(12), kind)
    study(model, ["mvp"], range(12), kind, journal=journal)
    lines = journal.read_text().splitlines()
    assert len(lines) == 13
    journal.write_text("\n".join(lines[:5]) + "\n" + lines[5][:20])
    again = study(model, ["mvp"], range(12), kind, journal=journal)
    assert again.outcomes == whole.outcomes
    assert len(journal.read_text().splitlines()) == 13
    with pytest.raises(InputError, match="another study"):
        study(model, ["mvp"], range(12), kind, seed=1, journal=journal)
    journal.write_text("\n".join([lines[0], "{}"]) + "\n")
    with pytest.raises(InputError, match="line 2"):
        study(model, ["mvp"], range(12), kind, journal=journal)


def test_the_summary_tells_layers_weights_and_how_to_fly_the_worst_again() -> None:
    model = make_up_model()
    result = study(model, ["straight"], range(30), KIND)
    told = json.loads(json.dumps(summary(result, model)))
    assert sum(row["weight"] for row in told["layers"]) == pytest.approx(1.0)
    assert sum(row["encounters"] for row in told["layers"]) == 30
    assert 0.0 < told["effective"]["lost_well_clear"] <= 30.0
    assert effective_number(result, "lost_well_clear") <= sum(
        outcome.straight.lost_well_clear for outcome in result.outcomes
    )
    worst = worst_cases(result, "straight")
    assert worst
    nearest = [result.outcomes[number].straight.nearest_m for number in worst]
    assert nearest[0] == min(nearest)
    command = replay_command(result, model, "straight", worst[0])
    assert f"--only {worst[0]}" in command
    assert "--vehicle wing" in command
    assert sum(share for share, _ in by_layer(result).values()) == pytest.approx(1.0)
    assert weigh_encounters(result).mean() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"vehicle": "kite"}, "copter"),
        ({"surveillance": "ears"}, "remote-id"),
        ({"range_m": -1.0}, "range_m"),
        ({"floor_ft": 7000.0}, "floor"),
        ({"reaction_s": float("nan")}, "reaction_s"),
    ],
)
def test_impossible_settings_are_named(change, said) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ClearwayError, match=said):
        replace(KIND, **change)
