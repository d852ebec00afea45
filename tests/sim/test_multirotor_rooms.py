"""What can stop finds the way back out of what it has flown into, and does not look for one up and
down a wall until its time is up."""

from pathlib import Path

import pytest

from clearway.studies.campaigns.families import make_case

MULTIROTOR = {"vehicle": {"kind": "inertialess"}}
CASES = [
    ("u-shape", 806),
    *[
        pytest.param(family, seed, marks=pytest.mark.nightly)
        for family in ("u-shape", "dead-end", "pockets", "closed-street")
        for seed in range(820, 830)
    ],
]


@pytest.mark.parametrize(("family", "seed"), CASES)
def test_a_multirotor_flies_back_out(family: str, seed: int) -> None:
    run = make_case(family, seed, {}, MULTIROTOR, Path()).setup.fly_with("clearway")
    assert run.reached
    assert run.metrics.margin_violations == 0
    assert run.metrics.time_s <= 5.0 * run.mission.straight_length_m


@pytest.mark.nightly
@pytest.mark.parametrize(("family", "first"), [("room", 800), ("closed-street", 0)])
def test_most_are_left_in_time(family: str, first: int) -> None:
    """All keep the margin; which one takes longer than its time is chance."""
    cases = [make_case(family, first + n, {}, MULTIROTOR, Path()) for n in range(4)]
    runs = [case.setup.fly_with("clearway") for case in cases]
    assert all(run.metrics.margin_violations == 0 for run in runs)
    lasts = [run.metrics.time_s / run.mission.straight_length_m for run in runs if run.reached]
    assert sum(each <= 5.0 for each in lasts) >= 3
