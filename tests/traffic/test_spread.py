"""The spread model: known answers, fast against reference, the paper's lattice, laws."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.traffic import Intruder, ModelCells, line_cells, radial_vehicle_times, spread_cells
from clearway.traffic.models.paper_lattice import lattice_cells
from clearway.traffic.models.timing import share_of_vehicle_time
from intruders_for_tests import KINDS, random_intruder

GRID = AvoidanceGrid.uniform()
COARSE = AvoidanceGrid.uniform(10.0, 3, azimuth_deg=60.0, columns=3, elevation_deg=40.0, rows=2)
UP = np.array([0.0, 0.0, 1.0])
FLANK = Intruder([6, 8, 0], [0, -1, 0], spread_rad=[np.pi / 12, np.pi / 16])
CASES = {
    "flank": FLANK,
    "oblique": Intruder([9, 5, 3], [-1, -0.7, -0.4], spread_rad=[0.25, 0.15]),
    "vertical": Intruder([6, 1, 9], [0, 0, -2], spread_rad=[0.3, 0.1]),
    "very fast": Intruder([300, 100, 20], [-240, -80, -16], spread_rad=[0.02, 0.01]),
    "head-on": Intruder([15, 0, 0], [-3, 0, 0], spread_rad=[0.2, 0.2]),
    "apex inside": Intruder([5.2, 0.3, 0.1], [0.5, 0.5, 0.2], spread_rad=[0.4, 0.2]),
    "wide": Intruder([7, 6, -1], [-0.3, -1, 0.2], spread_rad=[1.2, 0.9]),
    "re-entering": Intruder([4.2, 6, 0.5], [0, -1, 0], spread_rad=[0.1, 0.05]),
}


def as_cells(values: Any) -> npt.NDArray[np.float64]:
    return np.array(values, dtype=np.float64).ravel()


def check_times(cells: ModelCells, expected: ModelCells, unit_s: float, share: float) -> None:
    """Entry and leave within a share of layer depth over speed, where Q is at least 0.02."""
    assert expected.meeting is not None
    likely = expected.meeting >= 0.02
    for found, true in ((cells.entry_s, expected.entry_s), (cells.leave_s, expected.leave_s)):
        assert np.all(np.abs(found - true)[likely] <= share * unit_s)


@pytest.mark.parametrize(
    ("accuracy", "most", "mean", "share"),
    [("fast", 0.015, 0.004, 0.3), ("reference", 1e-4, 1e-5, 0.05)],
)
def test_known_answers(
    known_answers: dict[str, Any], accuracy: Any, most: float, mean: float, share: float
) -> None:
    answers = {key: as_cells(v) for key, v in known_answers["intruder"]["spread"].items()}
    cells = spread_cells(GRID, [FLANK], UP, accuracy).of(0)
    error = np.abs(cells.probability - answers["P_T_5_23"])
    assert error.max() <= most
    assert error.mean() <= mean
    assert cells.meeting is not None
    assert np.abs(cells.meeting - answers["meeting_Q"]).max() <= most
    expected = ModelCells(
        answers["P_T_5_23"],
        answers["i_e"],
        answers["i_l"],
        answers["i_l"],
        meeting=answers["meeting_Q"],
    )
    check_times(cells, expected, 1.0, share)
    timed = share_of_vehicle_time(cells, radial_vehicle_times(GRID, 1.0))
    assert np.abs(timed - answers["timed"]).max() <= most


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("grid", [GRID, COARSE], ids=["usual", "coarse"])
def test_fast_holds_to_the_reference(case: str, grid: AvoidanceGrid) -> None:
    intruder = CASES[case]
    fast = spread_cells(grid, [intruder], UP).of(0)
    slow = spread_cells(grid, [intruder], UP, "reference").of(0)
    error = np.abs(fast.probability - slow.probability)
    assert error.max() <= 0.015
    assert error.mean() <= 0.004
    depth_m = float(np.diff(grid.range_edges_m).max())
    check_times(fast, slow, depth_m / intruder.speed_mps, 0.3)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_fast_holds_to_the_reference_for_random_cones(kind: str, seed: int) -> None:
    intruder = random_intruder(kind, seed)
    fast = spread_cells(GRID, [intruder], UP).of(0)
    slow = spread_cells(GRID, [intruder], UP, "reference").of(0)
    error = np.abs(fast.probability - slow.probability)
    assert error.max() <= 0.015
    assert error.mean() <= 0.004
    check_times(fast, slow, 1.0 / intruder.speed_mps, 0.3)


@pytest.mark.parametrize("spread_deg", [(0.5, 25.0), (60.0, 0.5), (3.0, 50.0)])
def test_meeting_of_thin_cones(spread_deg: tuple[float, float]) -> None:
    thin = Intruder([6, 8, 0.5], [0.2, -1, -0.1], spread_rad=np.radians(spread_deg))
    slow = spread_cells(GRID, [thin], UP, "reference").of(0)
    assert slow.meeting is not None
    for accuracy, most in (("fast", 0.015), ("fine", 0.003)):
        found = spread_cells(GRID, [thin], UP, accuracy).of(0)
        assert found.meeting is not None
        assert np.abs(found.meeting - slow.meeting).max() <= most
        assert np.abs(found.probability - slow.probability).max() <= most


@pytest.mark.nightly
@pytest.mark.parametrize("case", ["flank", "apex inside", "oblique"])
def test_the_papers_lattice_tends_to_the_rays(case: str) -> None:
    slow = spread_cells(GRID, [CASES[case]], UP, "reference").of(0)
    coarse, fine = (
        np.abs(lattice_cells(GRID, [CASES[case]], UP, k).of(0).probability - slow.probability)
        for k in (5, 20)
    )
    assert fine.mean() < 0.4 * coarse.mean()
    assert fine.mean() < 1e-3
    assert fine.max() < 0.05


def test_lattice_counts_hits_in_the_vehicles_interval() -> None:
    always = radial_vehicle_times(GRID, 1e-3)
    lattice = lattice_cells(GRID, [FLANK], UP, 5, always).of(0)
    # In the first layer for 1000 s, in others after the intruder is gone.
    assert lattice.timed is not None
    np.testing.assert_array_equal(lattice.timed[:35], lattice.probability[:35])
    np.testing.assert_array_equal(lattice.timed[35:], 0.0)
    with pytest.raises(ClearwayError, match="points_per_m"):
        lattice_cells(GRID, [FLANK], UP, 0)


def test_without_spread_it_is_the_line() -> None:
    for position, velocity in (([6, 8, 0.3], [0, -1, 0]), ([9, -5, 2], [-1, 0.4, -0.3])):
        intruder = Intruder(position, velocity)
        line = line_cells(GRID, [intruder]).of(0)
        spread = spread_cells(GRID, [intruder], UP).of(0)
        assert spread.meeting is not None
        np.testing.assert_allclose(spread.meeting, line.probability, atol=1e-9)
        np.testing.assert_allclose(spread.dwell_s, line.dwell_s, atol=1e-9)
        np.testing.assert_allclose(spread.entry_s, line.entry_s, atol=1e-9)


def test_one_spread_alone_is_a_flat_fan() -> None:
    fan = spread_cells(
        GRID, [Intruder([6, 8, 0], [0, -1, 0], spread_rad=[0.3, 0.0])], UP, "reference"
    ).of(0)
    rows = np.unravel_index(np.flatnonzero(fan.probability), GRID.shape)[2]
    assert set(rows.tolist()) == {2}
    tower = spread_cells(GRID, [Intruder([6, 8, 0], [0, -1, 0], spread_rad=[0.0, 0.3])], UP).of(0)
    rows = np.unravel_index(np.flatnonzero(tower.probability), GRID.shape)[2]
    assert len(set(rows.tolist())) > 1


def test_standing_intruder_stays_in_its_cell() -> None:
    cells = spread_cells(GRID, [Intruder([5.5, 0, 0], [0, 0, 0], spread_rad=[0.3, 0.2])], UP).of(0)
    assert cells.meeting is not None
    met = np.flatnonzero(cells.probability)
    np.testing.assert_array_equal(met, GRID.cell_of([[5.5, 0, 0]]))
    assert cells.probability[met] == cells.meeting[met] == 1.0
    assert cells.leave_s[met] == np.inf


def test_horizontal_spread_is_level_whatever_up_is() -> None:
    # Turned about the flight path with `up`, the wider spread becomes the vertical one.
    wide = Intruder([6, 8, 0], [0, -1, 0], spread_rad=[0.3, 0.1])
    tall = Intruder([6, 8, 0], [0, -1, 0], spread_rad=[0.1, 0.3])
    turned = spread_cells(GRID, [wide], np.array([1.0, 0.0, 0.0]), "reference").of(0)
    expected = spread_cells(GRID, [tall], UP, "reference").of(0)
    np.testing.assert_allclose(turned.probability, expected.probability, atol=1e-3)


intruders = st.builds(
    lambda position, velocity, spread: Intruder(position, velocity, spread_rad=spread),
    st.lists(st.floats(-12, 12), min_size=3, max_size=3),
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.lists(st.floats(0, 1.5), min_size=2, max_size=2),
)


@given(intruders)
@settings(max_examples=80, deadline=None)
def test_laws(intruder: Intruder) -> None:
    cells = spread_cells(GRID, [intruder], UP).of(0)
    assert cells.meeting is not None
    met = cells.probability > 0
    assert not np.any(np.isnan(cells.probability))
    assert np.all((cells.meeting >= 0) & (cells.meeting <= 1))
    assert np.all(cells.probability <= cells.meeting + 1e-12)
    assert np.all(cells.meeting[~met] == 0)
    assert np.all(cells.entry_s[met] <= cells.leave_s[met])
    assert np.all(cells.entry_s[met] >= 0)
    assert np.all(np.isnan(cells.entry_s[~met]))


@given(intruders, st.floats(0.01, 100), st.floats(0.1, 50))
@settings(max_examples=30, deadline=None)
def test_scale_of_time_and_length_does_not_matter(
    intruder: Intruder, time_scale: float, length_scale: float
) -> None:
    # What lies within a tolerance of a border but not on it is scaled out of it.
    intruder = replace(intruder, position_m=np.round(intruder.position_m, 4))
    grid = AvoidanceGrid.uniform(10.0 * length_scale)
    scaled = Intruder(
        intruder.position_m * length_scale,
        intruder.velocity_mps * length_scale * time_scale,
        spread_rad=intruder.spread_rad,
    )
    one = spread_cells(GRID, [intruder], UP).of(0)
    other = spread_cells(grid, [scaled], UP).of(0)
    # Rays within the border tolerance of an edge may fall to either side.
    np.testing.assert_allclose(one.probability, other.probability, atol=0.02)
    assert np.abs(one.probability - other.probability).mean() < 1e-4


@given(intruders)
@settings(max_examples=30, deadline=None)
def test_mirrored_intruders_have_mirrored_cells(intruder: Intruder) -> None:
    flip = np.array([1.0, -1.0, 1.0])
    mirrored = Intruder(
        intruder.position_m * flip, intruder.velocity_mps * flip, spread_rad=intruder.spread_rad
    )
    one = GRID.reshape(spread_cells(GRID, [intruder], UP).of(0).probability)
    other = GRID.reshape(spread_cells(GRID, [mirrored], UP).of(0).probability)
    # Each within 0.015 of the truth, at extreme spreads within 0.03.
    np.testing.assert_allclose(one[:, ::-1], other, atol=0.06)
    assert np.abs(one[:, ::-1] - other).mean() < 0.008
