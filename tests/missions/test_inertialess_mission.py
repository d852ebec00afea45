"""`[vehicle] kind = "inertialess"`: from a mission file to a flight."""

from __future__ import annotations

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import InputError
from clearway.missions.mission_sections import VehicleSection
from clearway.missions.setup import prepare

WALL = """
[mission]
name = "round a wall"
waypoints_m = [[16.0, 0.0, 0.0]]
[vehicle]
kind = "inertialess"
[simulation]
time_limit_s = 80
[[obstacle]]
shape = "cuboid"
position_m = [5.0, 0.0, 0.0]
size_m = [0.5, 9.0, 60.0]
"""


def test_the_keys_make_the_automaton():
    section = VehicleSection(
        kind="inertialess", speed_mps=4.0, climb_mps=1.0, spot_turn_deg=90.0, slow_mps=(1.0, 2.0)
    )
    automaton = section.to_automaton()
    assert {"Slow-1", "Slow-2-Left", "Hold"} <= set(automaton.names)
    assert automaton["Climb"].climb_mps == automaton["Up"].climb_mps == 1.0
    assert automaton["Turn-Left"].yaw_rate_rps == pytest.approx(np.radians(90))
    assert VehicleSection().to_automaton() == cw.MovementAutomaton.plane()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"climb_mps": 1.0}, 'climb_mps: only of kind = "multirotor"'),
        ({"kind": "helicopter"}, "plane"),
        ({"kind": "inertialess", "slow_mps": [9.0]}, "slow_mps: must be below speed_mps"),
        ({"kind": "inertialess", "slow_mps": [0.5, 0.5]}, "slow_mps: speeds must differ"),
        ({"kind": "inertialess", "spot_turn_deg": 200.0}, "spot_turn_deg"),
        ({"pitch_limit_deg": 0.0, "attitude_deg": [0.0, 2.0, 0.0]}, "a pitch of 2 deg, which no"),
    ],
)
def test_wrong_keys_are_named(values, said):
    with pytest.raises(InputError, match=said):
        cw.read_mission("static-obstacles").with_values("vehicle", **values)


def test_it_flies_round_a_wall_as_predicted(tmp_path):
    path = tmp_path / "wall.toml"
    path.write_text(WALL)
    mission = cw.read_mission(str(path))
    assert mission.effective()["vehicle"]["kind"] == "inertialess"
    setup = prepare(mission)
    run = setup.fly()
    assert run.reached
    assert run.metrics.min_obstacle_distance_m >= run.safety_margin_m
    # The last movement ends early, where the goal is reached.
    automaton = setup.planner.automaton
    flown = automaton.rollout(run.states[0], run.movements[:-1], step_s=0.05)
    then = np.argmin(np.abs(run.time_s - flown.time_s[-1]))
    assert flown.states[-1, :3] == pytest.approx(run.states[then, :3], abs=1e-6)
