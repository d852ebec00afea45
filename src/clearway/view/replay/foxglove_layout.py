"""Foxglove's layout for a run: the scene in 3-D, a map, plots of what can be plotted, the log."""

from __future__ import annotations

import json
from typing import Any

from clearway.view.replay import schemas

SCENES = (
    schemas.SCENE,
    schemas.PLAN_SCENE,
    schemas.WAY_OUT_SCENE,
    schemas.CELL_SCENE,
    schemas.REACH_SCENE,
    schemas.INTRUDER_SCENE,
    schemas.POINTS,
    schemas.WORLD_POINTS,
)
SCENE_3D = "3D!clearway"
MAP = "map!clearway"
LOG = "RosOut!clearway"
MODES = "StateTransitions!modes"
PLOTS = {
    "Plot!distances": (
        "Distance, m",
        (
            (schemas.STATE, "obstacle_distance_m", "nearest obstacle"),
            (schemas.STATE, "intruder_distance_m", "nearest intruder"),
            (schemas.SCALARS, "margin_asked_m", "margin"),
            (schemas.SCALARS, "clearance_m", "clearance of the plan"),
        ),
    ),
    "Plot!cost": ("Cost, m", ((schemas.SCALARS, "cost_m", "cost of the plan"),)),
    "Plot!time": ("Decision time, ms", ((schemas.SCALARS, "elapsed_ms", "decision time"),)),
}
"""Panels of curves: title, and topic, field and label of each curve."""


def foxglove_layout() -> str:
    """The layout file, as Foxglove exports and imports them."""
    panels: dict[str, Any] = {
        SCENE_3D: {
            "foxglovePanelTitle": "Flight",
            "followTf": "vehicle",
            "followMode": "follow-position",
            "scene": {},
            "cameraState": {"distance": 40, "phi": 55, "thetaOffset": 60, "perspective": True},
            "transforms": {},
            "topics": {topic: {"visible": True} for topic in SCENES},
            "layers": {"grid": {"layerId": "foxglove.Grid", "visible": True, "size": 200}},
        },
        MAP: {"topicColors": {}, "followTopic": schemas.FIX, "disabledTopics": []},
        LOG: {"topicToRender": schemas.LOG, "minLogLevel": 1},
        MODES: {
            "isSynced": True,
            "paths": [
                {"value": f"{schemas.DECISION}.mode", "timestampMethod": "receiveTime"},
                {"value": f"{schemas.SCALARS}.alert", "timestampMethod": "receiveTime"},
            ],
        },
    }
    panels |= {name: _plot(title, curves) for name, (title, curves) in PLOTS.items()}
    plots = _split("column", list(PLOTS))
    layout = {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {
            "direction": "row",
            "splitPercentage": 58,
            "first": {
                "direction": "column",
                "splitPercentage": 75,
                "first": SCENE_3D,
                "second": {"direction": "row", "first": LOG, "second": MAP},
            },
            "second": {
                "direction": "column",
                "splitPercentage": 80,
                "first": plots,
                "second": MODES,
            },
        },
    }
    return json.dumps(layout, indent=2) + "\n"


def _plot(title: str, curves: tuple[tuple[str, str, str], ...]) -> dict[str, Any]:
    return {
        "foxglovePanelTitle": title,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "showLegend": True,
        "legendDisplay": "top",
        "paths": [
            {
                "value": f"{topic}.{name}",
                "label": label,
                "enabled": True,
                "timestampMethod": "receiveTime",
            }
            for topic, name, label in curves
        ],
    }


def _split(direction: str, panels: list[str]) -> Any:
    """Panels in a row or column, each as large as the others."""
    if len(panels) == 1:
        return panels[0]
    return {
        "direction": direction,
        "splitPercentage": 100 / len(panels),
        "first": panels[0],
        "second": _split(direction, panels[1:]),
    }
