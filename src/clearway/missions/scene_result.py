"""The result of `assess` as plain values: arrays nested [layer][column][row], None for no value."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.avoidance.scene import SceneAssessment
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray
from clearway.reach.tree import ReachSet
from clearway.sensors import Detection
from clearway.traffic import IntruderCells, ModelCells


def scene_result(assessment: SceneAssessment) -> dict[str, Any]:
    """The object that `assess --json` prints."""
    scene, cells, reach = assessment.scene, assessment.cells, assessment.reach
    grid, evidence = scene.grid, cells.evidence
    return {
        "name": scene.name,
        "grid": {
            "range_m": grid.range_edges_m.tolist(),
            "azimuth_deg": np.degrees(grid.azimuth_edges_rad).tolist(),
            "elevation_deg": np.degrees(grid.elevation_edges_rad).tolist(),
        },
        "rating_name": scene.rating.rating,
        "scans": [
            _scan(detection, sighting.pattern_from, sighting.lidar.pattern.name)
            for detection, sighting in zip(assessment.detections, scene.sightings, strict=True)
        ],
        "reach_set": _reach_set(scene.reach.method, scene.speed_mps, assessment.reach_set),
        "hits": nest_cells(
            grid, sum((d.hits for d in assessment.detections), np.zeros(grid.cells, int))
        ),
        "detected": nest_cells(grid, evidence.detected),
        "visibility": nest_cells(grid, evidence.visibility),
        "map_base": nest_cells(grid, evidence.map_base),
        "map": nest_cells(grid, cells.map),
        "intruder": nest_cells(grid, evidence.intruder),
        "obstacle": nest_cells(grid, cells.obstacle),
        "coated": nest_cells(grid, evidence.coated),
        "rating": nest_cells(grid, cells.rating),
        "reachability": nest_cells(grid, reach.reachability, reach.passed),
        "trajectories": nest_cells(grid, reach.trajectories),
        "space": nest_cells(grid, np.array(assessment.space.names)),
        "intruders": [_intruder(grid, one) for one in assessment.intruders],
    }


def nest_cells(
    grid: AvoidanceGrid, per_cell: npt.NDArray[Any], has_value: BoolArray | None = None
) -> list[list[list[Any]]]:
    """A [cells] array as lists [layer][column][row]; None where there is no value or no number."""
    values = per_cell.astype(object)
    if has_value is not None:
        values[~has_value] = None
    if per_cell.dtype.kind == "f":
        values[~np.isfinite(per_cell)] = None
    shaped: list[list[list[Any]]] = values.reshape(grid.shape).tolist()
    return shaped


def _scan(detection: Detection, pattern_from: str, pattern: str) -> dict[str, Any]:
    return {
        "pattern": pattern,
        "pattern_from": pattern_from,
        "beams_in_view": int(detection.beams.sum()),
        "points": dict(detection.counts),
    }


def _reach_set(method: str, speed_mps: float, reach_set: ReachSet) -> dict[str, Any]:
    return {
        "method": method,
        "speed_mps": speed_mps,
        "start_pitch_deg": float(np.degrees(reach_set.start_pitch_rad)),
        "nodes": reach_set.nodes,
        "trajectories": len(reach_set.trajectories),
    }


def _intruder(grid: AvoidanceGrid, cells: IntruderCells) -> dict[str, Any]:
    """What each model says of one intruder."""
    (models,) = cells.intruders
    return {name: _model(grid, model) for name, model in models.items()}


def _model(grid: AvoidanceGrid, model: ModelCells) -> dict[str, Any]:
    arrays = {
        "P": model.probability,
        "entry_s": model.entry_s,
        "leave_s": model.leave_s,
        "dwell_s": model.dwell_s,
        "timed": model.timed,
        "indicator": model.indicator,
        "meeting": model.meeting,
    }
    return {name: nest_cells(grid, array) for name, array in arrays.items() if array is not None}
