"""Guarded copters by number: straight at masts and walls, hostile wishes, aircraft that cross."""

from __future__ import annotations

import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from guarded_counts import crossing, hostile, straight_at


def some_of(count: int, first: int) -> list[object]:
    """Seeds, all but the first nightly."""
    nightly = [pytest.param(seed, marks=pytest.mark.nightly) for seed in range(first, count)]
    return [*range(first), *nightly]


@pytest.mark.parametrize("seed", some_of(250, 2))
def test_it_never_comes_nearer_than_the_margin(seed: int) -> None:
    flown = straight_at(seed)
    assert flown.is_kept, flown.nearest_m
    assert flown.tally["passed"] + flown.tally.get("slowed", 0) > 0


@pytest.mark.parametrize("seed", some_of(9, 1))
def test_hostile_wishes_reach_nothing_and_those_near_nothing_pass(seed: int) -> None:
    flown = hostile(seed)
    assert flown.is_kept, flown.nearest_m
    assert flown.near_nothing >= 10
    assert flown.unchanged >= 0.95 * flown.near_nothing


@pytest.mark.parametrize("seed", some_of(50, 1))
def test_an_aircraft_passes_beyond_the_margin(seed: int) -> None:
    flown = crossing(seed)
    assert flown.is_kept, flown.nearest_m
