"""Fig. 7.1: the modules of control, with what does their work here."""

from __future__ import annotations

import importlib.util
from functools import partial
from typing import TYPE_CHECKING

from clearway.studies.reproduction.target import Exhibit, Findings, Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODULES = (
    (
        "Event based control",
        "Sensor fusion",
        ("clearway.sensors", "clearway.avoidance.rate.fusion"),
    ),
    (
        "Event based control",
        "Mission plan",
        ("clearway.live.mission", "clearway.live.routing.route_planner"),
    ),
    ("Event based control", "Rule engine", ("clearway.avoidance.rules",)),
    ("Event based control", "Avoidance grid", ("clearway.base.grid", "clearway.avoidance.decide")),
    ("Discrete control", "Movement automaton", ("clearway.vehicle.automaton", "clearway.live")),
    ("Continuous control", "Vehicle and sensors", ("clearway.vehicle.model", "clearway.sim")),
)
"""Level and module of the paper, and the rooms that hold it."""
FLOWS = (
    ("Vehicle and sensors", "Sensor fusion", "sensor data, state"),
    ("Sensor fusion", "Avoidance grid", "obstacles"),
    ("Mission plan", "Avoidance grid", "goal waypoint"),
    ("Rule engine", "Avoidance grid", "constraints, costs"),
    ("Avoidance grid", "Movement automaton", "movement buffer"),
    ("Movement automaton", "Vehicle and sensors", "control input"),
)


def frame_figure() -> tuple[Exhibit, ...]:
    """The decision frame."""
    rooms = [room for _, _, rooms in MODULES for room in rooms]
    there = sum(importlib.util.find_spec(room) is not None for room in rooms)
    return (
        Exhibit(
            "Figure 7.1",
            "decision frame",
            Findings(
                claim="Event based control, of sensor fusion, mission plan, rule engine and "
                "avoidance grid, commands a discrete control, the movement automaton, and that "
                "the continuous control of the vehicle.",
                ours="The same modules: "
                + "; ".join(f"{name.lower()} in {' and '.join(r)}" for _, name, r in MODULES)
                + ".",
                difference="The rule engine does not choose a goal of escape in the grid: rules "
                "forbid trajectories or add to their cost, and one cost decides among all.",
                measures=(Measure("rooms of the package named", there, len(rooms), "reference"),),
            ),
            partial(_draw),
        ),
    )


def _draw() -> Figure:
    from clearway.view.plot.frame import draw_frame

    return draw_frame(MODULES, FLOWS, "Figure 7.1: decision frame")
