"""Fields of columns: as dense, as large and as far apart as they say, and passable."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ks_2samp

from clearway.base.errors import ClearwayError
from clearway.io.maps.column_table import read_column_table
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.obstacles.columns import Columns
from clearway.sim.column_fields import (
    CYLINDERS,
    DENSE_FOREST,
    DENSITIES,
    column_field,
    cylinder_field,
    forest,
)
from clearway.sim.world_parts import MadeWorld, RandomEnds, scatter_ends
from repository import REPOSITORY

PUBLISHED = REPOSITORY.parent / "shared" / "data" / "worlds"


def rows_of(made: MadeWorld) -> np.ndarray:
    assert isinstance(made.world, Columns)
    return np.array(made.world.rows_m)


def published(name: str) -> np.ndarray:
    path = PUBLISHED / f"{name}.csv"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    return read_column_table(path)


def gaps_of(rows: np.ndarray) -> np.ndarray:
    """[n] from each column to the nearest other one; below 0 where they overlap."""
    apart = np.linalg.norm(rows[:, None, :2] - rows[:, :2], axis=2) - rows[:, None, 2] - rows[:, 2]
    np.fill_diagonal(apart, np.inf)
    return apart.min(axis=1)


@pytest.mark.parametrize("trees_per_m2", [0.1, 0.2])
def test_a_dense_forest_has_as_many_trees_as_asked_for(trees_per_m2: float) -> None:
    rows = rows_of(forest(4, trees_per_m2=trees_per_m2))
    wanted = trees_per_m2 * DENSE_FOREST.area_m2
    assert 0.97 * wanted < len(rows) <= wanted + 1
    assert rows[:, 2].min() >= 0.1
    assert rows[:, 2].max() <= 0.35


@pytest.mark.parametrize("level", sorted(DENSITIES))
def test_cylinders_cover_the_share_asked_for_and_stand_apart_as_published_ones(level: str) -> None:
    rows = rows_of(cylinder_field(2, DENSITIES[level]))
    covered = np.pi * (rows[:, 2] ** 2).sum() / CYLINDERS.area_m2
    assert covered == pytest.approx(DENSITIES[level], rel=0.03)
    there = published(f"sando_{level}")
    assert gaps_of(rows).min() >= 1.5
    assert ks_2samp(rows[:, 2], there[:, 2]).pvalue > 0.001
    assert np.median(gaps_of(rows)) == pytest.approx(np.median(gaps_of(there)), rel=0.35)


def test_columns_have_the_statistics_of_the_published_map() -> None:
    there = published("super_columns")
    rows = np.concatenate([rows_of(column_field(seed)) for seed in range(6)])
    area = np.ptp(there[:, 0]) * np.ptp(there[:, 1])
    own = len(rows) / 6 / (108.0 * 42.0)
    assert own == pytest.approx(len(there) / area, rel=0.1)
    assert ks_2samp(rows[:, 2], there[:, 2]).pvalue > 0.05
    assert ks_2samp(rows[:, 4], there[:, 4]).pvalue > 0.05
    gaps = np.concatenate([gaps_of(rows_of(column_field(seed))) for seed in range(6)])
    assert ks_2samp(gaps, gaps_of(there)).pvalue > 0.05


@pytest.mark.parametrize("made", [forest(1, trees_per_m2=0.2), column_field(1), cylinder_field(1)])
def test_ends_are_scattered_to_free_places_of_their_own(made: MadeWorld) -> None:
    ends = RandomEnds(8.0, any_heading=True)
    missions = [
        scatter_ends(made.mission, made.world, made.heights_m, ends, seed) for seed in range(30)
    ]
    places = np.array([[one.start.position_m, one.waypoints_m[-1]] for one in missions])
    assert made.heights_m is not None
    assert len(np.unique(places.reshape(-1, 3), axis=0)) == 60
    assert np.abs(places[:, :, 1]).max() <= 8.0
    assert np.abs(places[:, :, 1]).max() > 6.0
    assert places[:, :, 2].min() >= made.heights_m[0]
    assert places[:, :, 2].max() <= made.heights_m[1]
    assert made.world.distance_m(places.reshape(-1, 3)).min() > 1.0
    headings = np.array([one.start.attitude_rad[2] for one in missions])
    assert np.histogram(headings, bins=4, range=(-np.pi, np.pi))[0].min() >= 2
    again = scatter_ends(made.mission, made.world, made.heights_m, ends, 7)
    np.testing.assert_array_equal(again.start.position_m, places[7, 0])


def test_where_nothing_is_free_that_is_said() -> None:
    made = column_field(0)
    full = Columns([[0.0, 0.0, 1000.0, -10.0, 10.0]])
    with pytest.raises(ClearwayError, match="no free place"):
        scatter_ends(made.mission, full, made.heights_m, RandomEnds(8.0, any_heading=False), 0)


@pytest.mark.parametrize("name", ["copter-forest", "copter-columns"])
def test_built_in_missions_start_and_end_where_their_field_does(name: str) -> None:
    file = read_mission_file(name)
    assert file.columns is not None
    assert file.columns.made is not None
    made = {"copter-forest": forest(1, trees_per_m2=0.1), "copter-columns": column_field(1)}[name]
    setup = prepare(file)
    np.testing.assert_array_equal(file.columns.to_columns().rows_m, rows_of(made))
    np.testing.assert_array_equal(setup.mission.start.position_m, made.mission.start.position_m)
    np.testing.assert_array_equal(setup.mission.waypoints_m, made.mission.waypoints_m)
    assert (file.rules.floor_m, file.rules.ceiling_m) == made.heights_m
    assert file.rules.route_m == made.corridor_m


# --- tables --------------------------------------------------------------------------------------


def test_a_table_of_columns_is_read_whatever_else_stands_in_it(tmp_path: Path) -> None:
    table = tmp_path / "pillars.csv"
    table.write_text("name,X,y,Radius_m,z_max\na,1,-2.5,0.5,4\n\nb,3,4,1,2\n")
    assert read_column_table(table).tolist() == [[1, -2.5, 0.5, 0, 4], [3, 4, 1, 0, 2]]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("x,y,height\n1,2,3\n", "line 1: no column radius"),
        ("x,y,radius,height\n1,2,a,3\n", "line 2: four numbers"),
        ("x,y,radius,height\n1,2\n", "line 2: four numbers"),
        ("x,y,radius,height\n1,2,-1,3\n", "line 2: radius and height"),
        ("x,y,radius,height\n1,2,nan,3\n", "line 2: radius and height"),
        ("x,y,radius,height\n", "0 columns"),
        ("name\n", "line 1: no column x"),
    ],
)
def test_a_table_that_is_none_is_refused_with_the_line(
    text: str, problem: str, tmp_path: Path
) -> None:
    table = tmp_path / "pillars.csv"
    table.write_text(text)
    with pytest.raises(ClearwayError, match=problem):
        read_column_table(table)


def test_a_mission_names_a_table_beside_it(tmp_path: Path) -> None:
    (tmp_path / "pillars.csv").write_text("x,y,radius,height\n10,0,1,5\n")
    mission = tmp_path / "m.toml"
    mission.write_text(
        '[mission]\nname = "m"\nwaypoints_m = [[20, 0, 2]]\n[vehicle]\nposition_m = [0, 0, 2]\n'
        '[columns]\nfile = "pillars.csv"\nground_m = 0.0\nknown = "both"\n'
    )
    setup = prepare(read_mission_file(str(mission)))
    places = np.array([[5.0, 0.0, 2.5], [5.0, 0.0, 0.5]])
    np.testing.assert_allclose(setup.world.distance_m(places), [2.5, 0.5])
    assert setup.obstacle_map.distance_m(places[:1]) == pytest.approx(2.5)
    (tmp_path / "pillars.csv").unlink()
    with pytest.raises(ClearwayError, match=r"pillars\.csv"):
        prepare(read_mission_file(str(mission)))
