"""Worlds of the kinds that other projects publish their planners in: what they are made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError
from clearway.sim.peer_worlds import barn, boxes, moving, perlin, rings
from clearway.sim.peer_worlds.cells import boxes_of
from clearway.studies.campaigns.difficulty import (
    Difficulty,
    measure_difficulty,
    median_difficulty,
)
from clearway.studies.campaigns.families import make_case
from clearway.studies.campaigns.peer_worlds import PEER_WORLDS

COPTER: dict[str, dict[str, Any]] = {
    "vehicle": {"kind": "multirotor", "speed_mps": 3.0, "body_radius_m": 0.1},
    "safety": {"margin_m": 0.3},
    "grid": {"range_m": 8.0},
    "lidar": {"field_deg": [360, 50], "spacing_deg": 2.0, "max_range_m": 8.0},
}
FAMILIES = [*PEER_WORLDS, "moving"]


@pytest.mark.parametrize("family", FAMILIES)
def test_a_world_is_the_same_for_the_same_seed_and_leaves_room_at_both_ends(family: str) -> None:
    files = [make_case(family, seed, {}, COPTER, Path()).file for seed in (1, 1, 2)]
    assert files[0] == files[1]
    assert files[0].obstacle != files[2].obstacle
    setup = make_case(family, 1, {}, COPTER, Path()).setup
    ends = np.stack([setup.mission.start.position_m, setup.mission.waypoints_m[-1]])
    assert setup.world.distance_m(ends).min() > 0.5
    setup.refuse_impossible()


def test_boxes_fill_exactly_the_filled_cells() -> None:
    filled = np.random.default_rng(3).random((9, 7, 5)) < 0.4
    made = boxes_of(filled, (1.0, -2.0, 0.5), 0.25)
    assert len(made) < filled.sum()
    count = np.zeros(filled.shape, dtype=int)
    middles = np.array([1.0, -2.0, 0.5]) + 0.25 * (np.indices(filled.shape).reshape(3, -1).T + 0.5)
    for box in made:
        inside = np.all(np.abs(middles - box.position_m) < 0.5 * np.array(box.size_m), axis=1)
        count += inside.reshape(filled.shape)
    assert np.array_equal(count, filled.astype(int)), "each filled cell in one box, no free one"


def test_a_cell_is_smoothed_by_its_eight_neighbours() -> None:
    field = np.zeros((barn.CELLS, barn.CELLS), dtype=bool)
    field[4:7, 4:7] = True
    field[5, 5] = False
    field[20, 20] = True
    smoothed = barn.smooth(field)
    assert smoothed[5, 5], "eight filled neighbours make a wall"
    assert not smoothed[20, 20], "no filled neighbour frees a cell"
    assert smoothed[4, 4], "with two neighbours a cell stays as it is"
    assert not smoothed[3, 5], "with three too"


def test_a_field_leads_through_by_three_free_cells_and_not_by_two() -> None:
    field = np.ones((barn.CELLS, barn.CELLS), dtype=bool)
    field[:, 10:12] = False
    assert not barn.leads_through(field)
    field[:, 10:13] = False
    assert barn.leads_through(field)
    field[15, 10] = True
    assert not barn.leads_through(field)


def test_fields_of_barn_are_denser_by_fill(monkeypatch: pytest.MonkeyPatch) -> None:
    standing = [
        sum(np.prod(part.size_m[:2]) for part in barn.barn(seed).world.obstacles[:-5])
        for seed in range(0, 5)
    ]
    assert standing == sorted(standing)
    monkeypatch.setattr(barn, "MOST_DRAWN", 5)
    with pytest.raises(ClearwayError, match="no way through 5 fields"):
        barn.barn(0, fill=0.4, rounds=0)


@pytest.mark.parametrize("fill", [0.12, 0.3])
def test_noise_fills_the_share_that_is_asked_for(fill: float) -> None:
    parts = perlin.perlin(5, fill).world.obstacles[:-1]
    volume = sum(float(np.prod(part.size_m)) for part in parts)
    assert volume == pytest.approx(fill * np.prod(perlin.BOX_M), rel=0.01)


def test_noise_vanishes_at_its_corners_and_does_not_jump() -> None:
    rng = np.random.default_rng(1)
    axes = [np.arange(0.0, 6.0, 0.05) for _ in range(2)] + [np.array([0.0])]
    values = perlin.gradient_noise(rng, axes, 2.0)[..., 0]
    assert np.abs(values[::40, ::40]).max() < 1e-12
    assert np.abs(np.diff(values, axis=0)).max() < 0.1
    assert values.std() > 0.1


def test_a_forest_of_rings_has_axes_apart_and_closed_rings() -> None:
    parts = rings.ring_forest(2, cylinders=60, rings=5).world.obstacles
    trunks = np.array([one.position_m[:2] for one in parts if one.name.startswith("cylinder")])
    apart = np.linalg.norm(trunks[:, None] - trunks, axis=2) + 99.0 * np.eye(len(trunks))
    assert len(trunks) == 60
    assert apart.min() >= rings.APART_M
    bars = [one for one in parts if one.name == "ring 3"]
    assert len(bars) == rings.SIDES
    assert {one.radius_m for one in bars} == {0.05}


def test_boxes_stand_as_many_to_the_square_metre_as_asked_for() -> None:
    few, many = (len(boxes.box_field(1, each).world.obstacles) for each in (0.05, 0.2))
    assert 30 < few - 1 <= 40
    assert 130 < many - 1 <= 160


def test_what_moves_stays_on_its_way_and_reports_nothing() -> None:
    script = moving.moving_script(4, 60)
    assert len(script) == 39
    assert not any(one.transponder for one in script)
    for one in script[:5]:
        course = one.course
        assert isinstance(course, moving.Trefoil)
        places = np.array([course(time) for time in np.arange(0.0, 80.0, 0.05)])
        assert np.all(np.abs(places - course.middle_m) <= 0.6 * course.size_m + 1e-9)
        assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() / 0.05 < 1.2, "m/s"


def test_sensors_see_what_moves_where_it_is() -> None:
    case = make_case("moving", 4, {"obstacles": 60}, COPTER, Path())
    traffic = case.setup._traffic(deaf=False)
    assert traffic is not None
    start = case.setup.mission.start
    for time_s in (0.0, 1.0, 2.0):
        traffic.step(type(start)(start.position_m, start.attitude_rad, time_s=time_s))
    (script, *_), (body, *_) = case.setup.script, traffic.bodies(2.0)
    assert script.course is not None
    np.testing.assert_allclose(body.position_m, script.course(2.0))
    assert not traffic.reports(2.0)
    assert case.file.follows_dynamic_objects


# How hard a world is -----------------------------------------------------------------------------


def hard(family: str, **parameters: float) -> Difficulty:
    several = []
    for seed in range(4):
        setup = make_case(family, seed, parameters, COPTER, Path()).setup
        several.append(measure_difficulty(setup.world, setup.mission, 0.3, 8.0, seed))
    return median_difficulty(several)


def test_denser_worlds_are_harder_by_every_measure() -> None:
    open_, dense = hard("boxes", boxes_per_m2=0.03), hard("boxes", boxes_per_m2=0.25)
    assert dense.free_path_m < open_.free_path_m
    assert dense.nearest_m < open_.nearest_m
    assert dense.occlusion > open_.occlusion
    assert dense.turn_rad_per_m > open_.turn_rad_per_m


def test_an_empty_world_has_no_turn_and_no_occlusion() -> None:
    setup = make_case("boxes", 1, {"boxes_per_m2": 0.0}, COPTER, Path()).setup
    found = measure_difficulty(setup.world, setup.mission, 0.3, None, 1)
    assert found.occlusion == 0.0
    assert found.turn_rad_per_m == 0.0
    assert found.nearest_m == pytest.approx(1.5), "the ground"


def test_parameters_that_cannot_be_are_refused() -> None:
    for family, given in (("barn", {"fill": 0.9}), ("perlin", {"fill": 0.0}), ("moving", {"x": 1})):
        with pytest.raises(InputError):
            make_case(family, 0, given, COPTER, Path())
