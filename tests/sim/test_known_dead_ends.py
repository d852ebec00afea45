"""Where the unseen counts as free nothing is promised, but most dead ends are passed by."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.avoidance.plan.costs import Prices
from clearway.sim.closed_loop import Run
from clearway.studies.campaigns.families import make_case
from clearway.studies.campaigns.file import read_campaign

CAMPAIGN = read_campaign("dead-ends").file
SEEDS = range(4)


def flown(label: str, seed: int) -> Run:
    section = next(one for one in CAMPAIGN.family if one.name == label)
    changes = CAMPAIGN.changes_of(section, "clearway-known")
    assert changes["safety"]["escape"] == "known"
    as_made = section.parameters | {"anywhere": False}
    case = make_case(section.family, seed, as_made, changes, Path())
    return case.setup.fly_with("clearway")


@pytest.mark.parametrize("label", ["caves-narrow", "rooms-wide", "u-shapes-narrow"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_dead_end_without_room_is_passed_by_and_a_room_is_left(label: str, seed: int) -> None:
    """Of the caves all four were flown into, and of the rooms one left, while room to circle cost
    little and ways were not sought in what was seen; of the U shapes, in which the flight begins,
    half were left while no way out through seen space was insisted on."""
    run = flown(label, seed)
    assert run.reached, repr(run)
    assert run.metrics.margin_violations == 0


def test_no_room_costs_more_where_ways_out_promise_nothing() -> None:
    assert Prices().suit_vehicle(can_stop=False).no_room == 6.0
    assert Prices().suit_vehicle(can_stop=False, unseen_is_free=True).no_room == 12.0
    assert Prices(no_room=1.0).suit_vehicle(can_stop=False, unseen_is_free=True).no_room == 1.0
