"""HorizontalCAS's networks: files read with errors by line, scores, advisories, turns."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError
from clearway.studies.encounter_model import make_up_model
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.horizontal_cas import (
    NAME,
    PREFIX,
    TAUS_S,
    choose_advisory,
    read_network,
    read_networks,
)
from clearway.studies.risk.long_choice import long_planner
from clearway.studies.risk.long_flight import fly_long
from clearway.studies.risk.settings import RiskSettings

SMALL = """\
// a network of two inputs, two hidden units and two scores
2,2,2,2,
2,2,2,
0,
-10.0,-10.0,
10.0,10.0,
1.0,0.0,5.0,
2.0,4.0,3.0,
1.0,0.0,
0.0,-1.0,
0.5,
0.25,
1.0,2.0,
-1.0,0.0,
0.1,
0.2,
"""


def test_scores_are_those_of_rectified_layers_worked_by_hand(tmp_path):
    file = tmp_path / "small.nnet"
    file.write_text(SMALL)
    network = read_network(file)
    # x = (5 - 1) / 2 = 2, y = -2 / 4 = -0.5: hidden 2.5 and 0.75; scores 4.1 and -2.3, scaled.
    np.testing.assert_allclose(network.scores(np.array([5.0, -2.0])), [17.3, -1.9])
    # Inputs are clipped: 99 counts as 10.
    np.testing.assert_allclose(
        network.scores(np.array([99.0, -2.0])), network.scores(np.array([10.0, -2.0]))
    )


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1.0,0.0,\n0.0,-1.0", "1.0,x,\n0.0,-1.0", "line 9: 2 numbers"),
        ("0.5,\n0.25", "0.5,", "line 12: 1 numbers"),
        ("-10.0,-10.0", "-10.0", "line 5: 2 numbers"),
        ("0.1,\n0.2,\n", "0.1,\n", "line 16: 1 numbers"),
    ],
)
def test_what_is_wrong_in_a_file_is_named_by_line(old, new, said, tmp_path):
    file = tmp_path / "bad.nnet"
    assert old in SMALL
    file.write_text(SMALL.replace(old, new, 1))
    with pytest.raises(InputError, match=said):
        read_network(file)


def test_a_folder_without_networks_is_named(tmp_path):
    with pytest.raises(ClearwayError, match="cannot be read"):
        long_planner(f"{PREFIX}{tmp_path}")
    for advisory in range(5):
        for tau in TAUS_S:
            (tmp_path / NAME.format(advisory=advisory, tau=tau)).write_text(SMALL)
    with pytest.raises(InputError, match="3 inputs and 5 advisories"):
        read_networks(str(tmp_path))


@pytest.fixture
def folder(data_dir):
    there = data_dir / "daa" / "horizontalcas"
    if not there.is_dir():
        pytest.skip("needs data: no networks of HorizontalCAS in the data folder")
    return str(there)


def at(range_ft, bearing, course, networks, before=0, tau_s=0.0, own=0.0):
    """Advisory against an intruder at a bearing left of the ownship's course."""
    apart = 0.3048 * range_ft * np.array([math.cos(own + bearing), math.sin(own + bearing)])
    return choose_advisory(networks, before, own, apart, own + course, tau_s)


def test_the_networks_advise_what_their_makers_say_they_do(folder):
    """Clear of conflict far off and behind, a turn head-on, away from who comes from a side."""
    networks = read_networks(folder)
    assert len(networks) == 40
    assert at(50_000.0, 0.0, math.pi, networks) == 0
    assert at(20_000.0, 0.0, 0.0, networks) == 0, "as fast, ahead, on the same course"
    assert at(8_000.0, 0.0, math.pi, networks) != 0
    assert at(8_000.0, 0.0, math.pi, networks, tau_s=61.0) == 0, "vertically apart for long"
    for own in (0.0, 2.0, -3.0):
        assert at(8_000.0, 0.0, math.pi, networks, own=own) == at(8_000.0, 0.0, math.pi, networks)
    # From the left in front, on a course that meets: to the right, and the other way round.
    meets = (at(3_000.0, side * 0.4, -side * 2.3, networks) for side in (1.0, -1.0))
    assert tuple(meets) in {(2, 1), (4, 3), (4, 1), (2, 3), (1, 2), (3, 4), (3, 2), (1, 4)}


def test_advisories_are_flown_as_turns(folder):
    kind = RiskSettings.real_scale("copter", "perfect", 4000.0)
    planner = long_planner(f"{PREFIX}{folder}")
    turned = 0
    for number in range(4):
        flight = fly_long(sample_encounter(make_up_model(), number, kind), planner, kind)
        assert np.ptp(flight.own_m[:, 2]) == pytest.approx(0.0, abs=1e-9), "it never climbs"
        course = np.unwrap(np.arctan2(*np.diff(flight.own_m[:, :2], axis=0).T[::-1]))
        rate_deg = np.degrees(np.diff(course)) * 4.0
        advised = [steer.advisory for _, steer in flight.steered]
        turned += any(one in (3, 4) for one in advised)
        if any(advised):
            first = next(k for k, one in enumerate(advised) if one)
            assert not rate_deg[: 4 * first].any(), "straight until the first advisory"
            while_advised = rate_deg[: 4 * len(advised)][np.repeat(advised, 4)[: len(rate_deg)] > 2]
            assert not len(while_advised) or np.abs(while_advised).max() < 9.6
    assert turned
