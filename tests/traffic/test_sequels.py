"""Reports that no one aircraft can have sent: jumps, an address of two, odd velocities."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live.inputs.reports import LatestReports, TrackedReports
from clearway.traffic import Intruder, TrackerSettings
from clearway.traffic.tracking.sequels import MOST_NAMESAKES

OWN = State(np.array([0.0, 5_000.0, 0.0]))
JUMPED, TURNED = "intruder: implausible jump", "intruder: implausible velocity"
KINDS = ["latest", "tracked"]


def reports_of(kind: str) -> Any:
    return LatestReports(10.0, "own") if kind == "latest" else TrackedReports(
        TrackerSettings(), 1.0, "own"
    )  # fmt: skip


def report(
    time_s: float, place: Any, velocity: Any = (50.0, 0.0, 0.0), name: str = "a"
) -> Intruder:
    return Intruder(np.array(place, float), np.array(velocity, float), time_s=time_s,
                    name=name, address=name, velocity_std_mps=0.1, position_std_m=1.0)  # fmt: skip


class Told:
    """Reports taken one by one, and what became of them."""

    def __init__(self, kind: str) -> None:
        self.reports, self.counts = reports_of(kind), Counter[str]()

    def take(self, time_s: float, *reported: Intruder) -> dict[str, Intruder]:
        for one in reported:
            flaw = self.reports.take(one)
            self.counts += Counter([flaw] if flaw else [])
        known, left_out = self.reports.intruders(OWN, time_s)
        self.counts += Counter(left_out)
        return {one.name: one for one in known}

    @property
    def implausible(self) -> int:
        return self.counts[JUMPED] + self.counts["report: impossible"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 20.0])
def test_an_aircraft_that_jumps_at_random_flies_on_where_it_was(kind: str, rate_hz: float) -> None:
    told, rng, sent = Told(kind), np.random.default_rng(3), 0
    told.take(0.0, report(0.0, (0, 0, 0)))
    for step in range(1, int(5.0 * rate_hz)):
        time_s = step / rate_hz
        side = rng.normal(size=3)
        place = np.array([50.0 * time_s, 0, 0]) + 1e4 * step * side / np.linalg.norm(side)
        known = told.take(time_s, report(time_s, place))
        sent += 1
        assert set(known) == {"a"}
        on = known["a"].at(time_s).position_m
        np.testing.assert_allclose(on, [50.0 * time_s, 0, 0], atol=1e-6)
    assert told.implausible == sent, "every one is counted"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("step_s", [0.05, 1.0])
def test_two_aircraft_of_one_address_are_both_followed(kind: str, step_s: float) -> None:
    told = Told(kind)
    for step in range(20):
        time_s = step * step_s
        both = [report(time_s, (50.0 * time_s, 0, 0)), report(time_s, (0, 3e3 - 50.0 * time_s, 0),
                                                             (0, -50.0, 0))]  # fmt: skip
        if kind == "tracked":  # one report of an address a moment is all that a tracker hears
            both = both[step % 2 :][:1]
        known = told.take(time_s, *both)
    assert sorted(known) == ["a", "a (2)"]
    places = {name: one.at(time_s).position_m for name, one in known.items()}
    np.testing.assert_allclose(places["a"], [50.0 * time_s, 0, 0], atol=1.0)
    np.testing.assert_allclose(places["a (2)"], [0, 3e3 - 50.0 * time_s, 0], atol=1.0)
    assert told.implausible == 1


@pytest.mark.parametrize("kind", KINDS)
def test_an_aircraft_that_was_moved_for_good_is_found_again(kind: str) -> None:
    told = Told(kind)
    told.take(0.0, report(0.0, (0, 0, 0)))
    for second in range(1, 16):
        known = told.take(float(second), report(float(second), (9e3 + 50.0 * second, 0, 0)))
        assert "a" in known or second > 9
        assert ("a (2)" in known) == (second >= 2)
    assert "a" not in known, "what it left is forgotten after a while"
    np.testing.assert_allclose(known["a (2)"].at(15.0).position_m, [9e3 + 750.0, 0, 0], atol=1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_no_address_is_followed_at_more_places_than_a_few(kind: str) -> None:
    told = Told(kind)
    for step in range(80):
        time_s, place = 0.05 * step, 2e4 * ((step // 2) % 10)
        known = told.take(time_s, report(time_s, (place, 0, 0), (0, 0, 0)))
        assert len(known) <= MOST_NAMESAKES


@pytest.mark.parametrize(
    ("speed", "rate_hz"), [(0.0, 1.0), (10.0, 20.0), (70.0, 1.0), (250.0, 1.0), (250.0, 0.2)]
)
def test_what_flies_is_never_taken_for_what_jumps(speed: float, rate_hz: float) -> None:
    told, rng = Told("latest"), np.random.default_rng(7)
    heading, place, turn = 0.0, np.zeros(3), min(1.0, 9.0 / max(speed, 1.0))
    for step in range(200):
        time_s = step / rate_hz
        heading += turn / rate_hz * rng.choice([-1.0, 0.0, 1.0])
        velocity = speed * np.array([np.cos(heading), np.sin(heading), 0.0])
        place = place + velocity / rate_hz
        noisy = place + rng.normal(scale=5.0, size=3)
        late_s = time_s - rng.uniform(0.0, min(0.9, 0.9 / rate_hz))
        told.take(time_s, report(late_s, noisy, velocity))
    assert told.counts[JUMPED] == 0
    assert told.counts[TURNED] == 0


def test_velocities_that_make_no_sense_are_replaced_and_counted() -> None:
    told, rng = Told("latest"), np.random.default_rng(1)
    told.take(0.0, report(0.0, (0, 0, 0)))
    for step in range(1, 100):
        time_s = 0.05 * step
        wild = rng.normal(size=3)
        wild *= 300.0 / np.linalg.norm(wild)
        known = told.take(time_s, report(time_s, (50.0 * time_s, 0, 0), wild))
        np.testing.assert_allclose(known["a"].position_m, [50.0 * time_s, 0, 0])
    assert told.counts[TURNED] > 90
    assert known["a"].manoeuvre_mps2 <= 60.0


def test_what_stands_does_not_fly_at_300_mps_whatever_it_tells() -> None:
    told = Told("latest")
    for step in range(200):
        known = told.take(0.05 * step, report(0.05 * step, (0, 0, 0), (300.0, 0, 0)))
    np.testing.assert_allclose(known["a"].velocity_mps, 0.0)
    assert told.counts[TURNED] >= 139


def test_a_velocity_that_stays_is_believed() -> None:
    told = Told("latest")
    told.take(0.0, report(0.0, (0, 0, 0), (-300.0, 0, 0)))
    for step in range(1, 4):
        known = told.take(0.1 * step, report(0.1 * step, (5.0 * step, 0, 0)))
    np.testing.assert_allclose(known["a"].velocity_mps, [50.0, 0, 0])
    assert told.counts[TURNED] == 2


def test_reports_of_nobody_in_particular_are_kept_apart() -> None:
    told = Told("latest")
    for step in range(5):
        one = Intruder(np.array([1e4 * step, 0.0, 0.0]), np.zeros(3), time_s=0.1 * step)
        known = told.take(0.1 * step, one)
    assert len(known) == 5
    assert told.counts == {}
