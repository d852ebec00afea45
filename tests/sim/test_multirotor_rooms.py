"""What can stop finds the way back out of what it has flown into, and does not look for one up and
down a wall until its time is up."""

from pathlib import Path

import pytest

from clearway.studies.campaigns.families import make_case

MULTIROTOR = {"vehicle": {"kind": "inertialess"}}
CASES = [
    ("room", 802),
    ("u-shape", 806),
    pytest.param(
        "closed-street",
        0,
        marks=pytest.mark.xfail(
            reason="range views keep farther off unobserved space",
            strict=True,
        ),
    ),
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
