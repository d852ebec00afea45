"""Made-up warehouses: what stands where, by geometry of the tests' own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.sim.warehouse import warehouse
from clearway.studies.campaigns.families import make_case
from free_way import free_way
from solids import Solids

KEPT_M = 0.6
"""From the middle of a vehicle: its margin, and of a copter its body too."""


def solids_of(seed: int, aisle_m: tuple[float, float] = (3.0, 4.0)) -> Solids:
    return Solids.of(warehouse(seed, aisle_m).world.obstacles)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(1, 6))]
)
def test_a_way_through_the_aisles_keeps_the_margin_and_none_leads_over_the_racks(seed: int) -> None:
    made = warehouse(seed)
    ends = made.mission.start.position_m, made.mission.waypoints_m[-1]
    way = free_way(Solids.of(made.world.obstacles), *ends, ball_m=KEPT_M + 0.25, measured=True)
    assert way.exists
    assert way.length_m is not None
    assert way.length_m < 1.6 * made.mission.straight_length_m
    racks = [one for one in made.world.obstacles if one.name.startswith("rack")]
    tops = [float(one.position_m[2] + one.half_m[2]) for one in racks]
    assert 9.0 - min(tops) < 2.0 * KEPT_M


@pytest.mark.parametrize("seed", range(6))
def test_ends_have_room_and_aisles_are_as_wide_as_asked_for(seed: int) -> None:
    made = warehouse(seed, (5.0, 5.0))
    ends = [made.mission.start.position_m, made.mission.waypoints_m[-1]]
    assert Solids.of(made.world.obstacles).distance_m(ends).min() >= 1.5
    racks = sorted(
        (one for one in made.world.obstacles if one.name.startswith("rack")),
        key=lambda one: (one.position_m[0], one.position_m[1]),
    )
    rows = racks[: len(racks) // 2]
    low = np.array([one.position_m[1] - one.half_m[1] for one in rows])
    high = np.array([one.position_m[1] + one.half_m[1] for one in rows])
    np.testing.assert_allclose(low - np.concatenate([[0.0], high[:-1]]), 5.0, atol=1e-9)


def test_aisles_that_leave_no_way_are_refused() -> None:
    with pytest.raises(InputError, match="aisle_m: at least 3"):
        make_case("warehouse", 0, {"aisle_m": [2.0, 4.0]}, {}, Path())


def test_a_seed_gives_one_warehouse_and_another_seed_another() -> None:
    one, same, other = (solids_of(seed) for seed in (3, 3, 4))
    place = [[1.0, 2.0, 3.0]]
    assert one.distance_m(place)[0] == same.distance_m(place)[0]
    assert one.distance_m(place)[0] != other.distance_m(place)[0]
