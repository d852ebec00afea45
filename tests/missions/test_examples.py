"""The example missions in surveyed places, flown by the command as a user would."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from clearway.io.scans.pointcloud import PointCloud
from clearway.io.scans.scan_formats import read_points
from clearway.missions.mission_file import read_mission_file
from in_process import flown_in
from repository import REPOSITORY

MISSIONS = REPOSITORY / "examples" / "missions"
BUILDING, WIRE = 6, 14
"""ASPRS classes."""


def flown(name: str, data_dir: Path, folder: Path) -> tuple[dict[str, Any], Any, PointCloud]:
    """JSON, positions [n, 3] and survey of a flight, wherever the data folder is."""
    mission = MISSIONS / f"{name}.toml"
    text = mission.read_text()
    stated = next(line for line in text.splitlines() if line.startswith("file = "))
    path = stated.split('"')[1]
    assert path.startswith("../../../shared/data/")
    survey = data_dir / path.removeprefix("../../../shared/data/")
    if not survey.is_file():
        pytest.skip(f"needs data: {survey.name}")
    (folder / "mission.toml").write_text(text.replace(path, str(survey)))
    result, track = flown_in(folder)
    return result, track, read_points(survey)


def held(result: dict[str, Any], name: str) -> None:
    """Reached, with the margin and without an emergency."""
    mission = read_mission_file(str(MISSIONS / f"{name}.toml"))
    assert result["mission"] == name
    assert result["reached"] is True
    assert result["waypoints_reached"] == len(mission.mission.waypoints_m)
    assert result["safety_margin_m"] == mission.safety.margin_m
    assert result["min_obstacle_distance_m"] >= mission.safety.margin_m
    assert result["margin_violations"] == result["emergencies"] == 0


@pytest.mark.nightly
def test_round_a_tree_and_between_two_roofs(data_dir: Path, tmp_path: Path) -> None:
    result, track, cloud = flown("tree-and-building", data_dir, tmp_path)
    held(result, "tree-and-building")
    assert cloud.unit == "US survey feet"
    assert cloud.counts == {"noise class 7 or 18": 25}
    points = cloud.points_m - cloud.points_m.min(axis=0)
    assert cloud.classes is not None
    # Near the roofs, and all round the tree: seen from its trunk, the track turns full circle.
    roofs = cKDTree(points[(cloud.classes == BUILDING) & (points[:, 2] < 5.0)])
    assert roofs.query(track)[0].min() < 3.0
    trunk = np.array([10.0, 4.0])
    bearing = np.unwrap(np.arctan2(*(track[:, :2] - trunk).T))
    assert abs(bearing[-1] - bearing[0]) > 1.9 * np.pi
    assert cKDTree(points).query(track)[0].min() < 2.0


@pytest.mark.nightly
def test_under_a_power_line(data_dir: Path, tmp_path: Path) -> None:
    result, track, cloud = flown("power-line", data_dir, tmp_path)
    held(result, "power-line")
    assert 250.0 < result["path_length_m"] < 350.0
    points = cloud.points_m - cloud.points_m.min(axis=0)
    assert cloud.classes is not None
    wires = points[cloud.classes == WIRE]
    # Wires straight above, and the vehicle in the air below them.
    above = cKDTree(wires[:, :2]).query_ball_point(track[:, :2], 1.0)
    under = [n for n, found in enumerate(above) if found and track[n, 2] < wires[found, 2].min()]
    assert len(under) > 10
    assert (track[under, 2] > 4.0).all()
    # And past trees that are taller than it flies.
    trees = points[(cloud.classes == 5) & (points[:, 2] > 6.0)]
    assert cKDTree(trees).query(track)[0].min() < 15.0
