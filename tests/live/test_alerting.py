"""Alerts of a flight state within how far of straight flight an intruder stays."""

from __future__ import annotations

import json

import numpy as np

from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.live.outputs.alerting import coverings_after, traffic_picture
from clearway.traffic import Intruder
from clearway.traffic.volumes import VOLUME_SETS, Alerts
from clearway.vehicle.performance import PERFORMANCES

SPEED_MPS, RADIUS_M = 25.0, 120.0


def circling(time_s: float, name: str = "glider") -> Intruder:
    """A glider in a thermal, 500 m away."""
    angle = SPEED_MPS / RADIUS_M * time_s
    return Intruder(
        [500.0 + RADIUS_M * np.sin(angle), -RADIUS_M * np.cos(angle), 0.0],
        [SPEED_MPS * np.cos(angle), SPEED_MPS * np.sin(angle), 0.0],
        name=name,
        time_s=time_s,
    )


def picture_after(seconds: int):
    """What is told of it once it has been heard for so long."""
    coverings, alerts = {}, Alerts()
    volumes, able = VOLUME_SETS["f3442"], PERFORMANCES["copter"]
    for time_s in range(0, seconds, 2):
        others = [circling(float(time_s))]
        coverings = coverings_after(coverings, others)
        here = State(np.zeros(3), time_s=float(time_s))
        situation = Situation(here, target_m=np.array([900.0, 0.0, 0.0]), intruders=others)
        picture = traffic_picture(alerts, volumes, able, situation, coverings)
        alerts = picture.alerts
    return picture, coverings


def test_an_alert_states_how_far_a_circling_intruder_may_be_from_straight_flight():
    picture, coverings = picture_after(300)
    assert picture.alerts.level
    told = json.loads(json.dumps(picture.as_dict(), allow_nan=False))["strays"]["glider"]
    assert told["moves_as"] == "circling"
    assert told["ahead_s"] == [10.0, 20.0, 30.0]
    # Straight on it would be elsewhere by so much: what it has learned covers it.
    now = circling(298.0)
    for ahead_s, level_m in zip(told["ahead_s"], told["level_m"], strict=True):
        there = circling(298.0 + ahead_s).position_m
        assert np.hypot(*(there - now.at(298.0 + ahead_s).position_m)[:2]) <= level_m
    assert f"at most {coverings['glider'].regions[0].level_m:.0f} m" in picture.in_words


def test_an_intruder_that_is_gone_is_forgotten_and_an_old_report_teaches_nothing():
    after = coverings_after({}, [circling(0.0), circling(0.0, "other")])
    regions = after["glider"].regions
    after = coverings_after(after, [circling(0.0)])
    assert list(after) == ["glider"]
    assert after["glider"].regions is regions
