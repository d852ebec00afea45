"""Who finds no certain way out in time stays where one is likely instead of flying into less."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from clearway.avoidance.choose.chosen import Basis
from clearway.studies.campaigns.families import make_case

SEEDS = (4, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(10, 30)))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_pocket_right_ahead_is_not_entered_without_one(seed: int) -> None:
    """The space before it is too narrow to be seen to hold a circle on the way straight on."""
    setup = make_case("pockets", seed, {}, {}, Path()).setup
    within = setup.escape.within
    assert within is not None
    run = replace(setup, simulation=replace(setup.simulation, time_limit_s=20.0)).fly()
    assert run.crashed_s is None
    certain = [
        way is not None and way.certain
        for way in (entry.flight.decision.way_out for entry in run.decisions)
    ]
    first = certain.index(True)
    assert all(certain[first:])
    if first > within:
        stayed = run.decisions[within].flight.decision
        assert stayed.choice.basis is Basis.WAY_OUT
