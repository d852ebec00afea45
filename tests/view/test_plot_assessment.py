"""Pictures of an assessment: what they show, for grids of any shape."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from clearway.avoidance.scene import SceneAssessment, assess_scene
from clearway.missions.scene_reading import scene_of
from clearway.view.plot.assessment import assessment_figures, worst_on_the_way
from clearway.view.plot.cells import cell_wedges

BALL: dict[str, Any] = {"shape": "ball", "position_m": [5, 0, 0], "radius_m": 1.0}


def assess(tables: dict[str, Any]) -> SceneAssessment:
    return assess_scene(scene_of("test", tables, Path(), "test").scene)


def test_the_worst_on_the_way_is_that_of_the_path() -> None:
    assessment = assess({"obstacle": [BALL]})
    reach_set = assessment.reach_set
    values = np.random.default_rng(1).uniform(size=reach_set.grid.cells)
    worst = worst_on_the_way(reach_set, values)
    for node in reach_set.trajectories[:20]:
        path = reach_set.path(int(node))
        cells = [
            cell
            for n in path
            for cell in reach_set.cell_index[reach_set.cell_start[n] : reach_set.cell_start[n + 1]]
        ]
        assert worst[node] == values[cells].max()


def test_wedges_lie_in_their_cells() -> None:
    grid = assess({}).scene.grid
    for i, layer in enumerate(cell_wedges(grid)):
        for j, outline in enumerate(layer):
            left, ahead = outline.T
            distance, azimuth = np.hypot(left, ahead), np.arctan2(left, ahead)
            assert distance.min() >= grid.range_edges_m[i] - 1e-9
            assert distance.max() <= grid.range_edges_m[i + 1] + 1e-9
            inside = distance > 0.0
            assert azimuth[inside].min() >= grid.azimuth_edges_rad[j] - 1e-9
            assert azimuth[inside].max() <= grid.azimuth_edges_rad[j + 1] + 1e-9


@pytest.mark.parametrize(
    "grid", [{}, {"rows": 1, "columns": 1, "layers": 3}, {"azimuth_deg": 180, "rows": 8}]
)
def test_every_cell_of_every_row_is_drawn(tmp_path: Path, grid: dict[str, Any]) -> None:
    assessment = assess({"grid": grid, "obstacle": [BALL], "scan": {"simulate": {}}})
    figures = assessment_figures(
        assessment.cells,
        assessment.reach,
        assessment.reach_set,
        assessment.detections[0].points_m,
        "test",
    )
    assert list(figures) == ["reachability", "obstacle", "visibility"]
    shape = assessment.scene.grid
    values = shape.reshape(assessment.cells.obstacle)
    figure = figures["obstacle"]
    rows = [axes for axes in figure.axes if axes.get_title().startswith("Row")]
    assert len(rows) == shape.rows
    for number, axes in enumerate(rows):
        drawn = next(c for c in axes.collections if isinstance(c, PolyCollection))
        np.testing.assert_array_equal(
            drawn.get_array(), values[:, :, shape.rows - 1 - number].ravel()
        )
    figure.savefig(tmp_path / "a.png", dpi=40)
    assert (tmp_path / "a.png").stat().st_size > 10_000
    assert (
        "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()
    )
