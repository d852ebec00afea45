"""What cannot be used is refused with clearway's own errors, whatever and wherever it is.

The law covers every public constructor, maker and function: one argument of a call that works is
replaced by NaN, infinity, a number of any size, a text, or an array of another shape.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clearway as cw

GRID = cw.AvoidanceGrid.uniform()
PLANE = cw.MovementAutomaton.plane(speed_mps=1.0)
LIBRARY = cw.ReachLibrary.load_or_build(PLANE, GRID)
REACH_SET = LIBRARY.reach_sets[0]
PLANNER = cw.Planner.of(LIBRARY)
HERE = cw.State(np.zeros(3))
BALLS = cw.ObstacleMap([cw.Obstacle.ball([6.0, 0.2, 0.0], 1.0)])
AWAY = cw.Mission("away", HERE, waypoints_m=np.array([[30.0, 0.0, 0.0]]))
BEAMS = cw.BeamPattern.rotating([-5.0, 5.0], 10.0, max_range_m=50.0)
FRONT = cw.Lidar("front", BEAMS)
THERE = cw.Intruder(np.array([9.0, 9.0, 0.0]), np.zeros(3))
SITUATION = cw.Situation(HERE, np.array([20.0, 0.0, 0.0]))
FILE = cw.read_mission("static-obstacles")


class Call(NamedTuple):
    """A call that works, and the arguments of it that are replaced."""

    called: Callable[..., Any]
    works: dict[str, Any]
    only: tuple[str, ...] = ()
    """Arguments that are replaced; none for all."""

    @property
    def replaced(self) -> tuple[str, ...]:
        return self.only or tuple(self.works)


def values_of(value: Any) -> dict[str, Any]:
    """The fields of a frozen value, as its constructor takes them."""
    return {one.name: getattr(value, one.name) for one in fields(value) if one.init}


def call(called: Callable[..., Any], *only: str, **works: Any) -> Call:
    return Call(called, works, only)


FLAGS = ("diagonals", "verify", "follow_movers")
"""Arguments that are true or false: whatever is something is true."""
CALLS = {
    "AvoidanceGrid": Call(cw.AvoidanceGrid, values_of(GRID)),
    "AvoidanceGrid.uniform": call(
        cw.AvoidanceGrid.uniform,
        range_m=10.0,
        layers=3,
        azimuth_deg=45.0,
        columns=3,
        elevation_deg=30.0,
        rows=3,
    ),
    "AvoidanceGrid.cell_of": call(GRID.cell_of, points_m=np.zeros((2, 3))),
    "AvoidanceGrid.reshape": call(GRID.reshape, per_cell=np.zeros(GRID.cells)),
    "AvoidanceGrid.patch_area_m2": call(GRID.patch_area_m2, radius_m=1.0),
    "AvoidanceSettings": Call(cw.AvoidanceSettings, values_of(cw.AvoidanceSettings())),
    "AvoidanceSystem": call(
        cw.AvoidanceSystem, planner=PLANNER, mission=AWAY, lidars=(), obstacle_map=None
    ),
    "BeamPattern": Call(cw.BeamPattern, values_of(BEAMS)),
    "BeamPattern.from_angles": call(
        cw.BeamPattern.from_angles,
        azimuths_rad=[0.0, 0.1],
        elevations_rad=[0.0, 0.1],
        min_range_m=0.0,
        max_range_m=9.0,
        spacing_rad=None,
    ),
    "BeamPattern.rotating": call(
        cw.BeamPattern.rotating,
        elevations_deg=[0.0, 1.0],
        azimuth_step_deg=5.0,
        azimuth_span_deg=90.0,
        min_range_m=0.0,
        max_range_m=9.0,
    ),
    "BeamPattern.per_cell": call(
        cw.BeamPattern.per_cell,
        grid=GRID,
        azimuths_per_cell=2,
        elevations_per_cell=2,
        min_range_m=0.0,
        max_range_m=9.0,
    ),
    "Intruder": Call(cw.Intruder, values_of(THERE)),
    "Lidar": Call(cw.Lidar, values_of(FRONT), ("sigma_m", "dropout", "false_returns", "pattern")),
    "Mission": Call(cw.Mission, values_of(AWAY)),
    "MissionFile.with_values": call(FILE.with_values, section="simulation", seed=1),
    "MovementAutomaton": Call(
        cw.MovementAutomaton,
        values_of(PLANE),
        tuple(name for name in values_of(PLANE) if name != "vehicle"),
    ),
    "MovementAutomaton.plane": call(
        cw.MovementAutomaton.plane,
        speed_mps=1.0,
        turn_step_deg=15.0,
        duration_s=1.0,
        pitch_limit_deg=30.0,
    ),
    "MovementAutomaton.inertialess": call(
        cw.MovementAutomaton.inertialess,
        speed_mps=1.0,
        turn_step_deg=15.0,
        duration_s=1.0,
        steepest_deg=30.0,
        climb_mps=None,
        spot_turn_deg=45.0,
        slow_mps=None,
    ),
    "MovementAutomaton.multirotor": call(
        cw.MovementAutomaton.multirotor,
        speed_mps=5.0,
        acceleration_mps2=3.0,
        climb_mps=2.0,
        sink_mps=1.5,
        yaw_rate_deg_s=90.0,
        lag_s=0.1,
        gusts_mps=1.0,
    ),
    "Obstacle": Call(cw.Obstacle, values_of(BALLS.obstacles[0])),
    "Obstacle.ball": call(cw.Obstacle.ball, position_m=[0, 0, 0], radius_m=1.0),
    "Obstacle.line": call(
        cw.Obstacle.line,
        position_m=[0, 0, 0],
        length_m=1.0,
        radius_m=1.0,
        orientation_rad=[0, 0, 0],
    ),
    "Obstacle.line_between": call(
        cw.Obstacle.line_between, start_m=[0, 0, 0], end_m=[1, 1, 1], radius_m=1.0
    ),
    "Obstacle.plane": call(
        cw.Obstacle.plane,
        position_m=[0, 0, 0],
        size_m=(1.0, 1.0),
        radius_m=1.0,
        orientation_rad=[0, 0, 0],
    ),
    "Obstacle.cuboid": call(
        cw.Obstacle.cuboid,
        position_m=[0, 0, 0],
        size_m=(1.0, 1.0, 1.0),
        radius_m=1.0,
        orientation_rad=[0, 0, 0],
    ),
    "ObstacleMap": call(cw.ObstacleMap, obstacles=BALLS.obstacles, complete_m=None),
    "Planner.of": call(cw.Planner.of, library=LIBRARY, settings=None, rules=()),
    "Planner.with_values": call(PLANNER.with_values, safety_margin_m=1.0, rating="total"),
    "Planner.prepare": call(PLANNER.prepare, pitch_rad=0.0),
    "PointWorld": call(
        cw.PointWorld, points_m=np.zeros((2, 3)), point_radius_m=0.1, labels=np.zeros(2)
    ),
    "Prices": Call(cw.Prices, values_of(cw.Prices())),
    "ReachLibrary.load_or_build": call(
        cw.ReachLibrary.load_or_build, automaton=PLANE, grid=GRID, method="flying", tuning=None
    ),
    "ReachLibrary.nearest": call(LIBRARY.nearest, pitch_rad=0.0),
    "ReachSet.path": call(REACH_SET.path, node=0),
    "ReachSet.node_of": call(REACH_SET.node_of, movements=("Left",)),
    "ReachSet.movements_to": call(REACH_SET.movements_to, node=0),
    "Scan": Call(cw.Scan, values_of(cw.Scan(np.zeros((2, 3))))),
    "RecordedScan": call(
        cw.RecordedScan,
        "points_m",
        "time_s",
        "tilt_rad",
        "blind_m",
        points_m=np.zeros((2, 3)),
        time_s=0.0,
        tilt_rad=0.0,
        blind_m=None,
        lidar=FRONT,
        lidar_from="stated",
    ),
    "SimulationSettings": Call(cw.SimulationSettings, values_of(cw.SimulationSettings())),
    "Situation": Call(cw.Situation, values_of(SITUATION)),
    "State": Call(cw.State, values_of(HERE)),
    "build_reach_set": call(
        cw.build_reach_set,
        "automaton",
        "grid",
        "start_pitch_rad",
        automaton=PLANE,
        grid=GRID,
        method="primitives",
        start_pitch_rad=0.0,
    ),
    "decide": call(
        cw.decide, "planner", "situation", planner=PLANNER, situation=SITUATION, commitment=None
    ),
    "assess": call(
        cw.assess, "seen", "state", "intruders", seen=[], grid=GRID, state=HERE, intruders=()
    ),
    "fly": call(cw.fly, mission="static-obstacles", planner="nobody"),
    "simulate": call(cw.simulate, "system", system=None, world=BALLS, lidars=[]),
    "read_scan": call(
        cw.read_scan, "at", "sensor", "frame", path="absent", at=None, sensor="auto", frame="auto"
    ),
    "read_mission": call(cw.read_mission, name_or_path="absent.toml"),
    "read_map": call(cw.read_map, "point_radius_m", path="absent", point_radius_m=20.0),
    "air_picture": call(cw.air_picture, recording=None),
    "draw_assessment": call(cw.draw_assessment, assessed=None, quantity="obstacle"),
    "draw_flight": call(cw.draw_flight, run=None),
}
UNUSABLE = st.one_of(
    st.sampled_from([float("nan"), float("inf"), float("-inf"), 1e300, 10**400, -1, 0, -1.0, 0.0]),
    st.floats(),
    st.integers(-(2**70), 2**70),
    st.text(max_size=4),
    st.sampled_from(
        [None, [], {}, (), b"a", 1j, object(), [None], ["a"], [[1.0, 2.0], [3.0]], "a" * 300]
    ),
    st.lists(st.floats(), max_size=7),
    st.builds(
        np.full,
        st.lists(st.integers(0, 4), min_size=1, max_size=3).map(tuple),
        st.sampled_from([0.0, 1.0, float("nan"), float("inf")]),
    ),
    st.sampled_from([np.array(["a", "b", "c"]), np.array(["a"], dtype=object)]),
)


@pytest.mark.parametrize("name", CALLS)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_what_cannot_be_used_raises_errors_of_clearway(name: str, data: st.DataObject) -> None:
    """Warnings are errors here, so NumPy's are found too."""
    called, works, _ = CALLS[name]
    replaced = data.draw(
        st.sampled_from([one for one in CALLS[name].replaced if one not in FLAGS]), "argument"
    )
    value = data.draw(UNUSABLE, "value")
    with suppress(cw.ClearwayError):
        called(**{**works, replaced: value})


def test_the_law_covers_what_is_public() -> None:
    """But what the library itself makes, and files that only a path leads to."""
    made = {"ClearwayError", "Decision", "Guardian", "MissionFile", "ReachLibrary", "ReachSet"}
    made |= {"Run", "SceneAssessment", "Planner", "__version__"}
    by_path = {"read_scans", "read_traffic"}
    public = {
        name
        for name in cw.__all__
        if inspect.isclass(getattr(cw, name)) or callable(getattr(cw, name))
    }
    assert public - made - by_path <= CALLS.keys()


@pytest.mark.parametrize(
    ("refused", "named"),
    [
        (lambda: PLANNER.with_values(safety_margin=1.0), ("safety_margin", "'safety_margin_m'")),
        (lambda: GRID.reshape(np.zeros(3)), ("per_cell", "350", "[3]")),
        (lambda: cw.Obstacle.ball("a", 1.0), ("position_m", "numbers", "'a'")),
        (
            lambda: cw.MovementAutomaton.plane(speed_mps=float("nan")),
            ("speed_mps", "from 0", "nan"),
        ),
    ],
)
def test_the_error_names_field_value_and_what_to_write(
    refused: Callable[[], object], named: tuple[str, ...]
) -> None:
    with pytest.raises(cw.ClearwayError) as found:
        refused()
    assert [word for word in named if word not in str(found.value)] == []
