"""Scripted traffic: where intruders are, in which frame, and how far they deviate."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.sim.scripted import ScriptedIntruder, Traffic, TrafficSettings

STEP_S = 0.05
MISSION = Mission("north", State(np.zeros(3)), waypoints_m=np.array([[0.0, 50.0, 0.0]]))


def flown(script: ScriptedIntruder, settings: TrafficSettings | None = None) -> Traffic:
    """Ten seconds beside an ownship that flies east at 2 m/s."""
    traffic = Traffic([script], MISSION, 1.0, settings, seed=4)
    for step in range(201):
        time_s = step * STEP_S
        traffic.step(State(np.array([2.0 * time_s, 0.0, 0.0]), time_s=time_s))
    return traffic


@pytest.mark.parametrize("appears_s", [0.0, 1.0, 3.471])
def test_in_the_world_it_is_where_the_script_says(appears_s: float) -> None:
    script = ScriptedIntruder(
        "i", appears_s, np.array([5.0, 6.0, 7.0]), np.array([-15.0, 1.0, 0.5]), spawn="world"
    )
    track = flown(script).tracks["i"]
    assert 0.0 <= track[0][0] - appears_s < STEP_S
    assert len(track) == round((10.0 - track[0][0]) / STEP_S) + 1
    for time_s, place in track:
        expected = script.position_m + (time_s - appears_s) * script.velocity_mps
        np.testing.assert_allclose(place, expected, atol=1e-9)


def test_it_appears_off_the_nominal_flight_or_off_the_ownship() -> None:
    ahead, back = np.array([6.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    # At 3.02 s the nominal flight is 3.02 m north of the start, the ownship 6.1 m east of it.
    time_s, place = flown(ScriptedIntruder("i", 3.02, ahead, back)).tracks["i"][0]
    np.testing.assert_allclose(place, [0.0, 9.02 - (time_s - 3.02), 0.0], atol=1e-9)
    script = ScriptedIntruder("i", 3.02, ahead, back, spawn="ownship")
    time_s, place = flown(script).tracks["i"][0]
    np.testing.assert_allclose(place, [2.0 * time_s + 6.0, 0.0, 0.0], atol=1e-9)


def test_deviating_it_stays_inside_its_spread() -> None:
    script = ScriptedIntruder(
        "i", 0.013, np.zeros(3), np.array([3.0, 0.0, 0.0]), np.array([0.2, 0.1]), spawn="world"
    )
    places = np.array([p for _, p in flown(script, TrafficSettings(deviates=True)).tracks["i"]])
    along, aside, above = places[1:].T
    ellipse = (aside / (along * np.tan(0.2))) ** 2 + (above / (along * np.tan(0.1))) ** 2
    assert np.all(ellipse <= 1.0 + 1e-9)
    assert ellipse.max() > 0.01
