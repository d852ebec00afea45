"""Encounter models: read with every error named, sampled as their counts say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chisquare

from clearway.base.errors import ClearwayError, InputError
from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.studies.encounter_model import (
    read_encounter_model,
    sample_initial,
    sample_tracks,
    step_bins,
    values_of,
)
from clearway.studies.encounter_model.model_file import parse_encounter_model

# G has two bins, A three given G, everything else one bin but the turn rate, which has three.
TINY = r"""
# labels_initial
"G", "A", "L", "v", "\dot v", "\dot h", "\dot \psi"
# G_initial
0 1 0 0 0 0 1
0 0 0 0 0 0 1
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
# r_initial
2 3 1 1 1 1 3
# N_initial
3 1 0 1 3 4 4 0 5 5 5 5 1 2 1 0 9 0 1 0 3 8 1 1 0 7 0 7 2 2
# labels_transition
"G", "A", "L", "v", "\dot v(t)", "\dot h(t)", "\dot \psi(t)", "\dot \psi(t+1)"
# G_transition
0 0 0 0 0 0 0 1
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 1
0 0 0 0 0 0 0 0
# r_transition
2 3 1 1 1 1 3 3
# N_transition
8 2 0 0 0 0 1 8 1 0 1 0 0 0 5 0 3 7
# boundaries
*
*
500 1000
100 120
-1 1
-250 250
-6 -1.5 1.5 6
# resample_rates
0 0 0 0 0.1 0.1 0.25
"""


def tiny():
    return parse_encounter_model(TINY)


def changed(old, new):
    assert old in TINY
    return TINY.replace(old, new, 1)


def test_counts_are_by_column_with_the_first_parent_fastest():
    model = tiny()
    area, airspace, turn = (model.initial[i] for i in (0, 1, 6))
    np.testing.assert_array_equal(area.counts, [[3, 1]])
    np.testing.assert_array_equal(airspace.counts, [[0, 1, 3], [4, 4, 0]])
    # Configurations of (G, A) run (0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2).
    expected = [[1, 2, 1], [0, 9, 0], [1, 0, 3], [7, 2, 2]]
    np.testing.assert_array_equal(turn.counts[[0, 1, 2, 5]], expected)
    bins = np.zeros((1, 7), dtype=np.int64)
    bins[0, :2] = 1, 2
    assert turn.configuration(bins)[0] == 5


def test_initial_bins_follow_the_products_of_the_shares():
    model, count = tiny(), 40_000
    bins = sample_initial(model, count, np.random.default_rng(1))
    joint = np.zeros((2, 3, 3))
    np.add.at(joint, (bins[:, 0], bins[:, 1], bins[:, 6]), 1)
    expected = np.zeros_like(joint)
    for g, share_g in enumerate((0.75, 0.25)):
        airspace = model.initial[1].counts[g] / model.initial[1].counts[g].sum()
        for a in range(3):
            turn = model.initial[6].counts[g + 2 * a]
            expected[g, a] = count * share_g * airspace[a] * turn / turn.sum()
    assert not joint[expected == 0.0].any()
    assert chisquare(joint[expected > 0], expected[expected > 0]).pvalue > 1e-3


def test_a_second_on_the_bins_follow_the_transition_counts():
    model, count = tiny(), 20_000
    now = np.zeros((count, 7), dtype=np.int64)
    now[:, 6] = 1
    after = step_bins(model, now, np.random.default_rng(2))
    # (G, turn) = (0, 1) is the third configuration.
    seen = np.bincount(after[:, 6], minlength=3)
    assert chisquare(seen, count * np.array([0.1, 0.8, 0.1])).pvalue > 1e-3
    np.testing.assert_array_equal(after[:, :6], now[:, :6])


def test_what_nobody_counted_stays():
    now = np.zeros((50, 7), dtype=np.int64)
    now[:, 0] = 1
    after = step_bins(tiny(), now, np.random.default_rng(3))
    np.testing.assert_array_equal(after, now)


def test_the_bin_that_holds_zero_means_zero():
    model = tiny()
    assert [variable.zero_bin for variable in model.variables] == [None, None, None, None, 0, 0, 1]
    tracks = sample_tracks(model, 300, 30, np.random.default_rng(4))
    straight = tracks.bins[:, :, 6] == 1
    assert straight.any()
    assert not straight.all()
    assert not tracks.values[straight][:, 6].any()
    assert np.all(np.abs(tracks.values[~straight][:, 6]) >= 1.5)
    # Steady and level throughout: neither speed nor altitude drifts.
    speed = np.linalg.norm(tracks.velocity_mps[:, :, :2], axis=2)
    assert speed.min() >= 100 * KNOT_MPS * 0.99
    np.testing.assert_array_equal(tracks.position_m[:, :, 2] - tracks.position_m[:, :1, 2], 0.0)


def test_values_change_within_a_bin_at_the_resample_rate():
    tracks = sample_tracks(tiny(), 4000, 20, np.random.default_rng(5))
    turn, bins = tracks.values[:, :, 6], tracks.bins[:, :, 6]
    stays = (bins[:, 1:] == bins[:, :-1]) & (bins[:, 1:] != 1)
    changes = (turn[:, 1:] != turn[:, :-1])[stays].mean()
    assert changes == pytest.approx(0.25, abs=4.0 * np.sqrt(0.25 * 0.75 / stays.sum()))
    moved = bins[:, 1:] != bins[:, :-1]
    assert np.all((turn[:, 1:] != turn[:, :-1])[moved])


def test_tracks_turn_right_for_positive_rates_and_finer_steps_are_the_same_tracks():
    model = tiny()
    coarse = sample_tracks(model, 20, 40, np.random.default_rng(6))
    fine = sample_tracks(model, 20, 40, np.random.default_rng(6), steps_per_s=10)
    np.testing.assert_allclose(fine.position_m[:, ::10], coarse.position_m, atol=2.0)
    assert fine.time_s[1] == pytest.approx(0.1)
    n = int(np.argmax(coarse.values[:, 0, 6]))
    assert coarse.position_m[n, 1, 1] < 0.0


def test_layers_can_be_chosen_and_impossible_ones_are_refused():
    with pytest.raises(ClearwayError, match="layers"):
        sample_tracks(tiny(), 1, 1, np.random.default_rng(0), layers=(3,))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (changed("# boundaries", "# boundarys"), "unknown section 'boundarys'"),
        (changed("2 3 1 1 1 1 3\n# N_i", "2 3 1 1 1 1\n# N_i"), "r_initial, line 13: 7 numbers"),
        (changed("3 1 0 1 3", "3 1 0 1 x"), "N_initial, line 15: value 5 is 'x'"),
        (changed("3 1 0 1 3", "3 1 0 1"), "N_initial, line 15: 30 counts are needed, got 29"),
        (changed("8 2 0", "-8 2 0"), "N_transition, line 30: counts must be >= 0"),
        (changed("500 1000", "*"), "boundaries, line 34: L needs numbers"),
        (changed("-6 -1.5 1.5 6", "-6 1.5 -1.5 6"), "boundaries, line 38"),
        (changed("0.25\n", "1.25\n"), "resample_rates, line 40: not within"),
        (changed('"v"', '"w"'), "lacks v"),
        (changed("0 1 0 0 0 0 1", "0 1 0 0 0 0 2"), "G_initial, line 5: 7 numbers 0 or 1"),
        (changed("0 0 0 0 0 0 0\n# r_i", "1 0 0 0 0 0 0\n# r_i"), "in a circle"),
        (changed("3 3\n# N_t", "3 2\n# N_t"), "r_transition"),
        ("no model at all", "before the first section"),
        ("", "section labels_initial: is missing"),
    ],
)
def test_what_is_wrong_is_named_by_section_and_line(text, said):
    with pytest.raises(InputError, match=said):
        parse_encounter_model(text, "model.txt")


def test_all_problems_are_told_at_once():
    bad = changed("500 1000", "*").replace("0 0 0 0 0.1 0.1 0.25", "0 0 0 0 0.1 0.1 2")
    with pytest.raises(InputError) as caught:
        parse_encounter_model(bad, "model.txt")
    assert len(caught.value.problems) == 2


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_encounter_model(tmp_path / "absent.txt")
    (tmp_path / "binary.txt").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(InputError, match="not a text file"):
        read_encounter_model(tmp_path / "binary.txt")


@pytest.fixture(scope="module")
def real_model(data_dir):
    path = data_dir / "daa" / "em-models" / "uncor_1200only_fwse_v1p2.txt"
    if not path.is_file():
        pytest.skip("needs data: no encounter model in the data folder")
    return read_encounter_model(path)


def test_the_real_model_s_marginals_are_its_counts(real_model):
    count = 60_000
    bins = sample_initial(real_model, count, np.random.default_rng(7))
    exact = np.array([1.0])
    # Every node is a child of all before it, so the joint shares are a plain product.
    for variable, node in enumerate(real_model.initial):
        shares = node.counts / np.maximum(node.counts.sum(axis=1, keepdims=True), 1e-300)
        joint = exact[:, None] * shares
        marginal = joint.sum(axis=0)
        seen = np.bincount(bins[:, variable], minlength=len(marginal))
        often = count * marginal >= 5.0
        expected = count * marginal[often]
        result = chisquare(seen[often], expected * seen[often].sum() / expected.sum())
        assert result.pvalue > 1e-3, real_model.variables[variable].name
        # Rows of the next node: the first parent varies fastest, so the newest is slowest.
        exact = joint.T.reshape(-1)


def test_the_real_model_s_aircraft_are_light_aircraft(real_model):
    tracks = sample_tracks(real_model, 400, 60, np.random.default_rng(8))
    assert np.all(np.isfinite(tracks.position_m))
    speed = np.linalg.norm(tracks.velocity_mps, axis=2) / KNOT_MPS
    assert 85.0 < np.median(speed) < 120.0
    heights = tracks.position_m[:, 0, 2] / FOOT_M
    assert 50.0 <= heights.min() < heights.max() <= 5000.0
    values = values_of(real_model, tracks.bins[:, 0], np.random.default_rng(9))
    for name in (r"\dot v", r"\dot h", r"\dot \psi"):
        index = real_model.index(name)
        steady = tracks.bins[:, 0, index] == real_model.variables[index].zero_bin
        assert steady.mean() > 0.5
        assert not values[steady, index].any()
