"""What `clearway assess` prints of one moment: a page of text; arrays are in the JSON."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from clearway.avoidance.scene import SceneAssessment
from clearway.missions.recorded_scan import beams_in_words

_REASONS = {"outside": "of them outside of the grid"}
"""What became of returns, where the word of the result needs more."""


def describe_assessment(assessment: SceneAssessment) -> str:
    """A page of text."""
    scene, reach, reach_set = assessment.scene, assessment.reach, assessment.reach_set
    grid, evidence = scene.grid, assessment.cells.evidence
    rated = reach.node_rating[reach_set.trajectories]
    passable = int(np.count_nonzero(rated >= scene.rating.threshold))
    reachable = int(np.count_nonzero(reach.reachability >= scene.rating.threshold))
    spaces = [f"{n} {name}" for name, n in _space_counts(assessment).items()]
    azimuth, elevation = np.degrees(grid.azimuth_edges_rad), np.degrees(grid.elevation_edges_rad)
    lines = [
        ("scene", scene.name),
        (
            "grid",
            f"{grid.layers} x {grid.columns} x {grid.rows} cells to {grid.range_m:g} m, "
            f"azimuth {azimuth[0]:g} to {azimuth[-1]:g} deg, "
            f"elevation {elevation[0]:g} to {elevation[-1]:g} deg",
        ),
        *_sighting_lines(assessment),
        ("map", f"{len(scene.obstacle_map)} obstacles, {_cells(evidence.map_base > 0.0)}"),
        ("intruders", f"{len(scene.traffic)}, {_cells(evidence.intruder > 0.0)}"),
        ("space", f"cells: {', '.join(spaces)}"),
        (
            "reach set",
            f"{scene.reach.method}, {reach_set.nodes} nodes, {len(rated)} trajectories, "
            f"{scene.reach.kind}, {scene.speed_mps:g} m/s, {_start(assessment)}",
        ),
        (
            "rating",
            f"{scene.rating.rating}, passable from {scene.rating.threshold:g} on: {passable} of "
            f"{len(rated)} trajectories, {reachable} of {np.count_nonzero(reach.passed)} cells "
            "that trajectories reach",
        ),
    ]
    return "\n".join(f"{name:<12}{text}" for name, text in lines)


def _start(assessment: SceneAssessment) -> str:
    """Where trajectories begin: at a pitch, or at a speed."""
    scene = assessment.scene
    if scene.reach.kind == "multirotor":
        return f"flown at {scene.now_mps:g} m/s"
    pitch_deg = np.degrees(assessment.reach_set.start_pitch_rad)
    return f"start pitch {pitch_deg:.3g} deg (positive nose down)"


def _sighting_lines(assessment: SceneAssessment) -> list[tuple[str, str]]:
    if not assessment.detections:
        return [("scan", "none: everything counts as visible")]
    lines = []
    for sighting, detection in zip(assessment.scene.sightings, assessment.detections, strict=True):
        pattern, source = sighting.lidar.pattern.name, sighting.pattern_from
        beams = beams_in_words(source, pattern)
        counts = ", ".join(
            f"{n} {_REASONS.get(why, why)}" for why, n in detection.counts.items() if n
        )
        lines += [
            ("scan", f"{len(sighting.scan.points_m)} points: {counts or 'none'}"),
            (
                "beams",
                f"{beams}; {int(detection.beams.sum())} look into the grid",
            ),
            ("detected", _cells(detection.probability > 0.0)),
        ]
    return lines


def _cells(mask: Any) -> str:
    return f"in {int(mask.sum())} of {mask.size} cells"


def _space_counts(assessment: SceneAssessment) -> dict[str, int]:
    return dict(sorted(Counter(assessment.space.names).items()))
