"""The automaton against SPEC's table, its limits, and the table predictor's known error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.table import MovementTable

PLANE = MovementAutomaton.plane()
STEP = np.radians(15.0)
# x, y, z, roll, pitch, yaw after 1 s from level flight: tables 4.1 and 4.2 as corrected.
LEVEL = {
    "Straight": (1, 0, 0, 0, 0, 0),
    "Down": (0.988616, 0, -0.130154, 0, 0.261799, 0),
    "Up": (0.988616, 0, 0.130154, 0, -0.261799, 0),
    "Left": (0.988616, 0.130154, 0, 0, 0, 0.261799),
    "Right": (0.988616, -0.130154, 0, 0, 0, -0.261799),
    "Down-Left": (0.977465, 0.127936, -0.130154, 0, 0.261799, 0.261799),
    "Down-Right": (0.977465, -0.127936, -0.130154, 0, 0.261799, -0.261799),
    "Up-Left": (0.977465, 0.127936, 0.130154, 0, -0.261799, 0.261799),
    "Up-Right": (0.977465, -0.127936, 0.130154, 0, -0.261799, -0.261799),
}


def test_the_nine_movements_from_level_flight():
    assert PLANE.names == tuple(LEVEL)
    for name, expected in LEVEL.items():
        assert PLANE.predict(np.zeros(6), PLANE[name]) == pytest.approx(expected, abs=6e-7)


@pytest.mark.parametrize("by", ["model", "table", "another model"])
def test_many_predictions_are_those_of_each_to_the_last_bit(by):
    automaton = {
        "model": PLANE,
        "table": replace(PLANE, table=PLANE.measure(4)),
        "another model": MovementAutomaton.inertialess(2.0),
    }[by]
    rng = np.random.default_rng(2)
    for movement in automaton.movements:
        state = rng.normal(size=6) * [30.0, 30.0, 9.0, 0.2, 0.4, 3.0]
        times = movement.duration_s / 20 * np.arange(1, 21)
        each = [automaton.predict(state, movement, time) for time in times]
        np.testing.assert_array_equal(automaton.predict_each(state, movement, times), each)


def test_the_five_movements():
    assert MovementAutomaton.plane(diagonals=False).names == tuple(LEVEL)[:5]


def test_table_measured_equals_table_given():
    measured = PLANE.measure()
    for name, expected in LEVEL.items():
        assert measured.row(name) == pytest.approx(expected, abs=6e-7)
    given_rows = MovementTable.from_rows(LEVEL)
    assert given_rows.names == measured.names


@pytest.mark.parametrize(("pitch_deg", "error_m"), [(0, 0.0), (30, 0.029), (60, 0.084)])
def test_table_predictor_is_exact_only_at_level_pitch(pitch_deg, error_m):
    table = PLANE.measure()
    state = np.array([1.0, 2.0, 3.0, 0.0, np.radians(pitch_deg), 0.7])
    gaps = [
        np.linalg.norm(table.predict(state, m.name)[:3] - PLANE.predict(state, m)[:3])
        for m in PLANE.movements
    ]
    assert max(gaps) == pytest.approx(error_m, abs=7e-4)


def test_an_automaton_can_fly_by_its_table():
    rows = {"Hover": np.zeros(6), "Climb": [0, 0, 1, 0, 0, 0], "Ahead": [2, 0, 0, 0, 0, 0]}
    hover = MovementAutomaton(
        tuple(Movement(name, 0.0, smooth=name != "Climb") for name in rows),
        table=MovementTable.from_rows(rows),
    )
    path = hover.rollout([0, 0, 0, 0, 0, np.pi / 2], ["Ahead", "Hover", "Climb"], step_s=0.5)
    assert path.states[-1] == pytest.approx([0, 2, 1, 0, 0, np.pi / 2])
    assert path.states[1] == pytest.approx([0, 1, 0, 0, 0, np.pi / 2])
    assert hover.mirror == (0, 1, 2)
    assert hover.start_pitches_rad == (0.0,)


def test_table_in_steps_follows_the_arc():
    table = PLANE.measure(steps=8)
    for share in (0.125, 0.5, 1.0):
        assert table.predict(np.zeros(6), "Left", share) == pytest.approx(
            PLANE.predict(np.zeros(6), PLANE["Left"], share)
        )


def test_six_lefts_turn_by_ninety_degrees():
    path = PLANE.rollout(np.zeros(6), ["Left"] * 6, step_s=0.1)
    radius = 1.0 / STEP
    assert path.states[-1] == pytest.approx([radius, radius, 0, 0, 0, np.pi / 2])
    assert len(path.time_s) == 61
    assert np.diff(path.time_s) == pytest.approx(0.1)
    assert PLANE.turning_radius_m == pytest.approx(3.8197, abs=1e-4)
    assert PLANE.step_m == 1.0


def test_pitch_limit_holds_with_rounding_and_leads_back():
    level = np.zeros(6)
    steep = PLANE.predict(PLANE.predict(level, PLANE["Down"]), PLANE["Down"])
    assert steep[4] == pytest.approx(np.radians(30))
    barred = {m.name for m in PLANE.movements if not PLANE.is_allowed(steep, m)}
    assert barred == {"Down", "Down-Left", "Down-Right"}
    beyond = np.array([0, 0, 0, 0, np.radians(40), 0])
    assert {m.name for m in PLANE.movements if PLANE.is_allowed(beyond, m)} == {
        "Up",
        "Up-Left",
        "Up-Right",
    }
    free = MovementAutomaton.plane(pitch_limit_deg=None)
    assert all(free.is_allowed(beyond, m) for m in free.movements)


@pytest.mark.parametrize(
    ("automaton", "pitches_deg"),
    [
        (PLANE, (-30, -15, 0, 15, 30)),
        (MovementAutomaton.plane(pitch_limit_deg=None), (0,)),
        (MovementAutomaton.plane(turn_step_deg=10), tuple(range(-30, 31, 10))),
        (MovementAutomaton.plane(turn_step_deg=1), tuple(np.linspace(-30, 30, 25))),
        (
            MovementAutomaton(
                (
                    Movement("Sink", 1.0, pitch_rate_rps=np.radians(20)),
                    Movement("Climb", 1.0, pitch_rate_rps=-np.radians(10)),
                ),
                np.radians(20),
            ),
            (-20, -10, 0, 10, 20),
        ),
    ],
)
def test_start_pitches(automaton, pitches_deg):
    assert np.degrees(automaton.start_pitches_rad) == pytest.approx(pitches_deg)


def test_mirror_swaps_left_and_right():
    mirrored = [PLANE.names[index] for index in PLANE.mirror]
    expected = [name.replace("Left", "x").replace("Right", "Left") for name in LEVEL]
    assert mirrored == [name.replace("x", "Right") for name in expected]
    one_sided = MovementAutomaton((PLANE["Straight"], PLANE["Left"]))
    assert one_sided.mirror is None


@given(st.lists(st.sampled_from(tuple(LEVEL)), min_size=1, max_size=12))
def test_prediction_is_the_same_wherever_and_whichever_way_one_flies(names):
    """Yaw and position do not matter; pitch does (SPEC 2)."""
    start = np.array([3.0, -4.0, 5.0, 0.0, 0.0, 2.0])
    plain = PLANE.rollout(np.zeros(6), names, step_s=1.0).states[-1]
    moved = PLANE.rollout(start, names, step_s=1.0).states[-1]
    turn = np.array([[np.cos(2), -np.sin(2), 0], [np.sin(2), np.cos(2), 0], [0, 0, 1]])
    assert moved[:3] == pytest.approx(turn @ plain[:3] + start[:3], abs=1e-9)
    assert moved[3:] == pytest.approx(plain[3:] + start[3:], abs=1e-9)


def test_forbidden_transitions():
    automaton = MovementAutomaton(PLANE.movements, forbidden=frozenset({("Left", "Right")}))
    left, right = automaton["Left"], automaton["Right"]
    assert not automaton.is_allowed(np.zeros(6), right, previous=left)
    assert automaton.is_allowed(np.zeros(6), left, previous=right)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Movement("Stop", 1.0, duration_s=0.0), "duration"),
        (lambda: Movement("Odd", float("nan")), "finite"),
        (lambda: MovementAutomaton(()), "at least one"),
        (lambda: MovementAutomaton((PLANE["Left"], PLANE["Left"])), "differ"),
        (lambda: MovementAutomaton(PLANE.movements, -1.0), "pitch limit"),
        (lambda: MovementAutomaton.plane(speed_mps=-1.0), "speed"),
        (lambda: PLANE["Sideways"], "Straight, Down"),
        (lambda: MovementTable.from_rows({"Left": [1, 2]}), "six numbers"),
        (lambda: MovementTable.from_rows({"Left": [np.nan] * 6}), "finite"),
        (
            lambda: MovementAutomaton(
                PLANE.movements, table=MovementTable.from_rows({"Left": [0] * 6})
            ),
            "lacks",
        ),
        (
            lambda: MovementAutomaton(PLANE.movements, forbidden=frozenset({("Left", "Back")})),
            "Back",
        ),
    ],
)
def test_bad_input_is_named(make, words):
    with pytest.raises(ClearwayError, match=words):
        make()
