"""Manoeuvres told from successive reports: exact turns, noise that is none, and memory of them."""

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live.inputs.reports import LatestReports, TrackedReports
from clearway.traffic import Intruder, Manoeuvres, TrackerSettings

OWN = State(np.array([500.0, 0.0, 0.0]))


def turning(time_s, rate_rps, speed=2.0, rng=None, std=0.0, name="a"):
    """A level turn about the origin, as reported."""
    angle = rate_rps * time_s
    radius = speed / rate_rps if rate_rps else 0.0
    place = [radius * np.sin(angle), radius * (1.0 - np.cos(angle)), 0.0]
    place = [speed * time_s, 0.0, 0.0] if not rate_rps else place
    velocity = speed * np.array([np.cos(angle), np.sin(angle), 0.0])
    noise = np.zeros((2, 3)) if rng is None else std * rng.normal(size=(2, 3))
    return Intruder(
        place + noise[0], velocity + noise[1], name=name, time_s=time_s,
        position_std_m=std, velocity_std_mps=std,
    )  # fmt: skip


@pytest.mark.parametrize("rate_rps", [0.05, 0.3, -0.8])
def test_a_turn_is_told_by_its_acceleration(rate_rps):
    heard = Manoeuvres()
    for second in range(4):
        heard.take("a", turning(float(second), rate_rps))
    shown = heard.with_manoeuvre("a", turning(3.0, rate_rps)).manoeuvre_mps2
    assert shown == pytest.approx(2.0 * 2.0 * abs(np.sin(rate_rps / 2.0)))
    assert heard.with_manoeuvre("b", turning(3.0, rate_rps)).manoeuvre_mps2 == 0.0


def test_straight_flight_shows_none_and_neither_does_noise_as_stated():
    heard, rng = Manoeuvres(), np.random.default_rng(1)
    for second in range(200):
        heard.take("straight", turning(float(second), 0.0))
        heard.take("noisy", turning(float(second), 0.0, rng=rng, std=0.1))
    assert heard.with_manoeuvre("straight", turning(199.0, 0.0)).manoeuvre_mps2 == 0.0
    assert heard.with_manoeuvre("noisy", turning(199.0, 0.0)).manoeuvre_mps2 < 0.2


def test_who_has_turned_is_remembered_for_a_while_and_forgotten_with_its_reports():
    reports = LatestReports(10.0, "")
    for second in range(40):
        reports.take(turning(float(second), 0.5 if second < 3 else 0.0))
        (shown,), _ = reports.intruders(OWN, float(second))
        assert (shown.manoeuvre_mps2 > 0.0) == (1 <= second <= 37)
    reports.intruders(OWN, 60.0)
    reports.take(turning(61.0, 0.0))
    (shown,), _ = reports.intruders(OWN, 61.0)
    assert shown.manoeuvre_mps2 == 0.0


def test_tracks_show_turns_too():
    rng = np.random.default_rng(2)
    turns = TrackedReports(TrackerSettings(), 1.0, "own")
    for second in range(12):
        turns.take(turning(float(second), 0.4, rng=rng, std=0.05))
        known, _ = turns.intruders(OWN, float(second))
    assert known[0].manoeuvre_mps2 > 0.1


def test_what_may_have_been_turned_since_the_last_report_counts():
    reports = LatestReports(10.0, "")
    for second in range(3):
        reports.take(turning(float(second), 0.5))
    (shown,), _ = reports.intruders(OWN, 4.0)
    assert shown.manoeuvre_mps2 == pytest.approx(4.0 * np.sin(0.25))
