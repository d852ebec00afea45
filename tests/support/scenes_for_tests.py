"""Scenes for tests, and what comes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clearway.avoidance.scene import SceneAssessment, assess_scene
from clearway.base.errors import InputError
from clearway.missions.scene_reading import scene_of
from clearway.missions.scene_result import scene_result

TWO_BALLS: list[dict[str, Any]] = [
    {"shape": "ball", "position_m": [5, 0, 0], "radius_m": 1.0},
    {"shape": "ball", "position_m": [7.5, 1.5, 0.4], "radius_m": 1.0},
]
CROSSING: dict[str, Any] = {"position_m": [6, 8, 0], "velocity_mps": [0, -1, 0]}


def assess(tables: dict[str, Any]) -> SceneAssessment:
    return assess_scene(scene_of("test", tables, Path(), "test").scene)


def result_of(tables: dict[str, Any]) -> dict[str, Any]:
    return scene_result(assess(tables))


def numbers(nested: Any) -> npt.NDArray[np.float64]:
    return np.array(nested, dtype=np.float64)


def problems_of(tables: dict[str, Any]) -> str:
    with pytest.raises(InputError) as caught:
        scene_of("scene.toml", tables, Path(), "scene")
    return "\n".join(caught.value.problems)
