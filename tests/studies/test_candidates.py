"""Encounters chosen among candidates: near ones rather, and no sum changes by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.studies.encounter_model import EncounterModel, make_up_model
from clearway.studies.encounter_model.model_file import parse_encounter_model
from clearway.studies.risk.candidates import find_entered, find_wanted_kinds, take_candidate
from clearway.studies.risk.cylinder import Cylinder
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.flight import STRAIGHT, separation_of
from clearway.studies.risk.settings import NEAR_COLLISION, WELL_CLEAR, RiskSettings

LEVEL_AND_STRAIGHT = r"""
# labels_initial
"G", "A", "L", "v", "\dot v", "\dot h", "\dot \psi"
# G_initial
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
# r_initial
1 1 1 1 1 1 1
# N_initial
1 1 1 1 1 1 1
# labels_transition
"G", "A", "L", "v", "\dot v(t)", "\dot h(t)", "\dot \psi(t)", "\dot \psi(t+1)"
# G_transition
0 0 0 0 0 0 0 1
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 0
# r_transition
1 1 1 1 1 1 1 1
# N_transition
1
# boundaries
*
*
3000 5000
120 180
-1 1
-1 1
-1 1
# resample_rates
0 0 0 0 0 0 0
"""


def rates(model: EncounterModel, count: int, kind: RiskSettings) -> dict[str, tuple[float, float]]:
    """Rates of near collision and of the loss of well clear, and the share that the first is of the
    second, with their standard errors."""
    weights, flags = np.zeros(count), np.zeros((count, 2))
    for number in range(count):
        encounter = sample_encounter(model, number, kind)
        came = separation_of(encounter, STRAIGHT, kind)[0]
        weights[number], flags[number] = encounter.weight, (
            came.near_collision, came.lost_well_clear,
        )  # fmt: skip
    near, lost = flags.T

    def over(some, all_of):  # type: ignore[no-untyped-def]
        whole = (weights * all_of).sum()
        share = (weights * some).sum() / whole
        return share, np.linalg.norm(weights * (some - share * all_of)) / whole

    every = np.ones(count)
    return {"near": over(near, every), "lost": over(lost, every), "of lost": over(near, lost)}


def test_rates_are_those_of_swept_volumes() -> None:
    """What flies level and straight meets a cylinder in proportion to how large it looks."""
    kind = RiskSettings.real_scale("copter", range_m=2000.0, tracks=2, entries=4)
    found = rates(parse_encounter_model(LEVEL_AND_STRAIGHT), 300, kind)
    near, lost, outer = (
        one.radius_m * one.half_height_m for one in (NEAR_COLLISION, WELL_CLEAR, kind.outer)
    )
    for name, exact in (("near", near / outer), ("lost", lost / outer), ("of lost", near / lost)):
        value, error = found[name]
        assert value == pytest.approx(exact, abs=4.0 * error), name
        assert error < 0.25 * exact, name


def test_rates_are_those_of_plain_draws() -> None:
    model = make_up_model()
    plain = RiskSettings.real_scale("copter", range_m=2000.0, tracks=1, entries=1)
    chosen = replace(plain, tracks=4, entries=4)
    one, other = rates(model, 250, plain), rates(model, 150, chosen)
    for name in one:
        apart = abs(one[name][0] - other[name][0])
        assert apart < 4.0 * np.hypot(one[name][1], other[name][1]), name
    assert other["lost"][1] / other["lost"][0] < 0.4


@given(st.lists(st.tuples(st.floats(0.0, 5.0), st.floats(0.01, 50.0)), min_size=1, max_size=6),
       st.integers(0, 5))  # fmt: skip
def test_what_is_taken_stands_for_all_candidates(pairs, at) -> None:  # type: ignore[no-untyped-def]
    """Chance times weight of each is its own weight over the number of candidates."""
    weights, wants = (np.array(each) for each in zip(*pairs, strict=True))
    products = weights * wants
    if products.sum() == 0.0:
        assert take_candidate(weights, wants, np.random.default_rng(0)) is None
        return
    found = take_candidate(weights, wants, np.random.default_rng(at))
    assert found is not None
    chosen, weight = found
    assert weights[chosen] > 0.0
    chance = products[chosen] / products.sum()
    assert chance * weight == pytest.approx(weights[chosen] / len(weights))


def test_candidates_are_taken_as_often_as_their_products_say() -> None:
    weights, wants = np.array([0.0, 2.0, 1.0, 0.0]), np.array([5.0, 1.0, 6.0, 1.0])
    rng = np.random.default_rng(1)
    seen = [take_candidate(weights, wants, rng) for _ in range(4000)]
    share = np.mean([one is not None and one[0] == 2 for one in seen])
    assert share == pytest.approx(0.75, abs=0.03)


def test_kinds_are_the_smallest_cylinder_entered() -> None:
    of = find_wanted_kinds(
        Cylinder(5000.0, 500.0), (Cylinder(10.0, 5.0), Cylinder(300.0, 50.0)), (0.2, 0.5)
    )
    drift = np.zeros((5, 3))
    drift[:, 0] = [0.0, 100.0, 200.0, 300.0, 400.0]
    for entry, count, kind in (
        ([-300.0, 0.0, 0.0], 5, 0),
        ([-300.0, 0.0, 0.0], 3, 1),
        ([-300.0, 0.0, 20.0], 5, 1),
        ([-300.0, 0.0, 60.0], 5, 2),
        ([-900.0, 0.0, 0.0], 5, 2),
    ):
        found = find_entered(np.array(entry), drift, count, of.radius_m, of.half_height_m)
        assert found == kind
    # Rare kinds are wanted more.
    assert (np.diff(of.want) < 0.0).all()
