"""Risk over models of other aircraft: those that stand, fall, land; what avoiding them costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError
from clearway.base.units import FOOT_M
from clearway.studies.encounter_model import make_up_model, step_bins
from clearway.studies.encounter_model.model_file import parse_encounter_model
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.entry import Shells
from clearway.studies.risk.fit import fit_height, is_slow
from clearway.studies.risk.flight import STRAIGHT, Separation, separation_of
from clearway.studies.risk.many import read_models, study_models, summarize_models
from clearway.studies.risk.model_tables import FORMS, write_model_tables
from clearway.studies.risk.nuisance import compute_nuisance
from clearway.studies.risk.ratios import effective_number
from clearway.studies.risk.settings import NEAR_COLLISION, WELL_CLEAR, RiskSettings
from clearway.studies.risk.study import RiskOutcome, RiskStudy

BALLOON = r"""
# labels_initial
"L", "\dot h"
# G_initial
0 0
0 0
# r_initial
1 1
# N_initial
1 1
# labels_transition
"L", "\dot h(t)", "\dot h(t+1)"
# G_transition
0 0 0
0 0 1
0 0 0
# r_transition
1 1 1
# N_transition
1
# boundaries
LAYER
CLIMB
# resample_rates
0 0
"""
KIND = RiskSettings.real_scale("copter", range_m=2000.0)


def balloon(layer="3000 5000", climb="-100 100"):
    return parse_encounter_model(BALLOON.replace("LAYER", layer).replace("CLIMB", climb))


def straight_flights(model, kind, count):
    outcomes = []
    for number in range(count):
        met = sample_encounter(model, number, kind)
        came = separation_of(met, STRAIGHT, kind)[0]
        outcomes.append(RiskOutcome(number, met.weight, met.layer, came, {}, {}))
    return RiskStudy(kind, (), 0, tuple(outcomes))


def share(study, measure):
    """Weighted share that is bad, and its standard error."""
    weights = np.array([each.weight for each in study.outcomes])
    bad = np.array([getattr(each.straight, measure) for each in study.outcomes])
    found = (weights * bad).sum() / weights.sum()
    return found, np.linalg.norm(weights * (bad - found)) / weights.sum()


def test_what_stands_still_is_met_in_proportion_to_swept_volumes():
    """A known answer that plain draws give too, with far fewer near misses among them."""
    model = balloon()
    kind = replace(KIND, within_s=KIND.crossing_s)
    plain = replace(kind, tracks=1, entries=1)
    chosen, evenly = straight_flights(model, kind, 150), straight_flights(model, plain, 300)
    outer = kind.outer.radius_m * kind.outer.half_height_m
    for measure, inner in (("near_collision", NEAR_COLLISION), ("lost_well_clear", WELL_CLEAR)):
        exact = inner.radius_m * inner.half_height_m / outer
        for one in (chosen, evenly):
            value, error = share(one, measure)
            assert value == pytest.approx(exact, abs=4.0 * error), measure
        assert effective_number(chosen, measure) > 0.2 * len(chosen.outcomes), measure
    assert kind.shells != Shells(kind.outer, (), ())


def test_without_time_to_cross_what_stands_still_is_never_met():
    hurried = replace(KIND, within_s=60.0)
    assert is_slow(balloon())
    assert not any(
        one.straight.lost_well_clear for one in straight_flights(balloon(), hurried, 12).outcomes
    )
    assert KIND.crossing_s > 300.0


def test_parents_of_the_same_second_are_drawn_first():
    """A turn that copies the climb of its own second, and a climb that flips every second."""
    text = r"""
# labels_initial
"L", "v", "\dot v", "\dot h", "\dot \psi"
# G_initial
0 0 0 0 0
0 0 0 0 0
0 0 0 0 0
0 0 0 0 0
0 0 0 0 0
# r_initial
1 1 1 2 2
# N_initial
1 1 1 1 1 1 1
# labels_transition
"L", "v", "\dot v(t)", "\dot h(t)", "\dot \psi(t)", "\dot \psi(t+1)", "\dot h(t+1)"
# G_transition
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 0 1
0 0 0 0 0 0 0
0 0 0 0 0 0 0
0 0 0 0 0 1 0
# r_transition
1 1 1 2 2 2 2
# N_transition
1 0 0 1 0 1 1 0
# boundaries
500 1000
50 60
-1 1
0 100 200
-3 0 3
# resample_rates
0 0 0 0 0
"""
    model = parse_encounter_model(text)
    now = np.zeros((40, 5), dtype=np.int64)
    now[::2, 3] = 1
    after = step_bins(model, now, np.random.default_rng(0))
    np.testing.assert_array_equal(after[:, 3], 1 - now[:, 3])
    np.testing.assert_array_equal(after[:, 4], after[:, 3])
    circle = text.replace("0 0 0 0 0 0 0\n0 0 0 0 0 1 0", "0 0 0 0 0 0 1\n0 0 0 0 0 1 0")
    with pytest.raises(InputError, match=r"G_transition: .* in a circle"):
        parse_encounter_model(circle)


def test_a_label_that_tracks_need_is_asked_for():
    with pytest.raises(InputError, match=r"lacks \\dot h"):
        parse_encounter_model(BALLOON.replace(r"\dot h", "w"))


def test_what_falls_enters_a_cylinder_as_high_as_its_warning_needs():
    assert fit_height(KIND, make_up_model()).half_height_ft == 1500.0
    falling = balloon(layer="0 3000", climb="-12000 -8000")
    assert fit_height(KIND, falling).half_height_ft == 12000.0 * 45.0 / 60.0


def test_an_encounter_ends_where_the_aircraft_lands():
    kind = replace(KIND, within_s=KIND.crossing_s)
    falling = balloon(layer="0 3000", climb="-1000 -500")
    for number in range(10):
        met = sample_encounter(falling, number, kind)
        ground_m = -met.own_height_m
        flown = met.time_s <= met.lasts_s
        assert met.position_m[flown][:-1, 2].min() > ground_m
    # A scale that begins above the ground says nothing of landing.
    level = sample_encounter(balloon(layer="3000 5000", climb="-1000 -500"), 0, kind)
    assert level.lasts_s > 40.0


def test_no_ownship_begins_above_its_ceiling():
    high = balloon(layer="5000 12000")
    kind = replace(KIND, within_s=KIND.crossing_s)
    heights = [sample_encounter(high, number, kind).own_height_m for number in range(20)]
    assert max(heights) <= 6000.0 * FOOT_M
    with pytest.raises(ClearwayError, match="no aircraft meets an ownship between 50 and 6000 ft"):
        sample_encounter(balloon(layer="9000 12000"), 0, kind)


def test_needless_manoeuvres_are_those_where_straight_flight_keeps_well_clear():
    clear = Separation(False, False, False, False, 1e3, 0.0)
    lost = replace(clear, lost_well_clear=True)
    moved = replace(clear, manoeuvred=True, extra_path_m=100.0)
    rows = [(1.0, lost, moved), (1.0, clear, moved), (3.0, clear, clear), (1.0, lost, clear)]
    outcomes = tuple(
        RiskOutcome(n, weight, 0, straight, {"clearway": flown}, {"clearway": 0})
        for n, (weight, straight, flown) in enumerate(rows * 20)
    )
    found = compute_nuisance(RiskStudy(KIND, ("clearway",), 0, outcomes), "clearway")
    assert found.of_clear.value == pytest.approx(1.0 / 4.0)
    assert found.of_manoeuvres.value == pytest.approx(1.0 / 2.0)
    assert found.of_clear.low < 0.25 < found.of_clear.high
    assert found.extra_path_m == pytest.approx(100.0)
    assert found.extra_path_each_m == pytest.approx(100.0 / 3.0)


def test_a_manoeuvre_is_what_leaves_straight_flight_and_its_path_is_longer():
    met = sample_encounter(make_up_model(), 3, KIND)
    straight = separation_of(met, "straight", replace(KIND, surveillance="perfect"))[0]
    assert not straight.manoeuvred
    assert straight.extra_path_m == pytest.approx(0.0, abs=1e-6)
    flown = straight_flights(make_up_model(), KIND, 12).outcomes
    number = next(one.number for one in flown if one.straight.near_collision)
    avoided = separation_of(sample_encounter(make_up_model(), number, KIND), "clearway", KIND)[0]
    assert avoided.manoeuvred
    assert avoided.extra_path_m > 0.0


def test_every_model_of_a_folder_is_flown_and_goes_on_from_its_journal(tmp_path):
    (tmp_path / "standing.txt").write_text(
        BALLOON.replace("LAYER", "3000 5000").replace("CLIMB", "-100 100")
    )
    (tmp_path / "rising.txt").write_text(
        BALLOON.replace("LAYER", "1000 5000").replace("CLIMB", "100 300")
    )
    models = read_models(tmp_path)
    kind, journals = replace(KIND, within_s=KIND.crossing_s), tmp_path / "journals"

    def fly(count, **options):
        return study_models(models, ["mvp"], range(count), kind, journals=journals, **options)

    fly(3)
    more = []
    told = fly(5, progress=more.append)
    assert [one.name for one in told] == ["rising", "standing"]
    assert more[0] == 3, "outcomes of the journal are not flown again"
    straightaway = study_models(models, ["mvp"], range(5), kind)
    assert [one.result.outcomes for one in told] == [one.result.outcomes for one in straightaway]
    summed = summarize_models(told)
    ends = [
        one["planners"]["mvp"]["lost_well_clear"]["ratio_95"][1]
        for one in summed["models"].values()
    ]
    assert summed["largest_upper_ends"]["mvp"]["lost_well_clear"] == pytest.approx(max(ends))
    page = tmp_path / "page.md"
    page.write_text("".join(f"<!-- {name}:begin -->\n<!-- {name}:end -->\n" for name in FORMS))
    assert write_model_tables(page, told) == list(FORMS)
    assert "| rising | 5 | " in page.read_text()
    assert "| standing, 1 | 3000-5000 ft | 100.0 % | 5 |" in page.read_text()
    with pytest.raises(InputError, match="no encounter models"):
        read_models(journals)


def test_a_damaged_model_of_a_folder_is_named(tmp_path):
    (tmp_path / "one.txt").write_text(BALLOON)
    with pytest.raises(InputError, match=r"one.txt.*line"):
        read_models(tmp_path)
