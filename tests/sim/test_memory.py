"""A flight keeps bounded memory: of a past decision what is told of it, and little else."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from clearway.avoidance.past import VOXELS_IN_RANGE, past
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.live.inputs.reports import MOST_UNASKED, reports_for
from clearway.missions.setup import FlightSetup, prepare
from clearway.missions.world_file import read_mission
from clearway.sensors import Scan
from clearway.sim import LoggedDecision, Run, closed_loop
from clearway.sim.kept_scans import ScanFile
from clearway.sim.logbook import Logbook
from clearway.traffic import Intruder, TrackerSettings
from clearway.view.plot.flight import draw_snapshot
from clearway.view.replay.messages import (
    cells_message,
    decision_message,
    list_seen_points,
    reach_message,
)
from held_bytes import held_bytes

PAST_BYTES = 40_000
"""That a past decision holds at most: 150 MB in an hour at one a second, and mostly a third."""
HOUR_MB, REPLAY_MB = 450, 450
"""That an hour of flight takes with its recording and pictures; and to show it again."""


@lru_cache
def setup(wind_mps: float = 0.0, sigma_deg: float = 0.0, seconds: float = 25.0) -> FlightSetup:
    """The mixed mission in wind, with an attitude that is measured so badly, above a floor."""
    mission = read_mission("mixed", lambda _: None)
    changed = mission.with_values(
        "simulation",
        time_limit_s=seconds,
        wind_mps=[wind_mps, 0.0, 0.0],
        attitude_sigma_deg=sigma_deg,
    )
    return prepare(changed)


@pytest.mark.parametrize(("wind_mps", "sigma_deg"), [(0.0, 0.0), (0.2, 0.0), (0.0, 1.0)])
def test_a_past_decision_tells_all_that_it_told(wind_mps: float, sigma_deg: float) -> None:
    flight = setup(wind_mps, sigma_deg)
    settings = flight.planner.settings
    for entry in flight.fly().decisions:
        before = entry.flight.decision
        after = past(before)
        told = replace(entry, flight=replace(entry.flight, decision=after))
        assert decision_message(told) == decision_message(entry)
        assert cells_message(after, settings) == cells_message(before, settings)
        assert reach_message(after) == reach_message(before)
        voxel_m = flight.planner.grid.range_m / VOXELS_IN_RANGE
        np.testing.assert_array_equal(
            list_seen_points(after, voxel_m), list_seen_points(before, voxel_m)
        )
        np.testing.assert_array_equal(after.tube_m, before.tube_m)
        np.testing.assert_array_equal(after.reach.reachability, before.reach.reachability)
        for ours, theirs in zip(after.hazards.shapes, before.hazards.shapes, strict=True):
            np.testing.assert_array_equal(ours, theirs)
        assert told.flight.explanation == entry.flight.explanation
        assert past(after) is after


def test_single_returns_of_a_past_decision_are_refused_with_what_to_do() -> None:
    decision = past(setup().fly().decisions[-1].flight.decision)
    for name in ("points", "bins"):
        with pytest.raises(ClearwayError, match=r"seen_m.*on_decision"):
            getattr(decision.hazards, name)
    assert len(decision.seen_m)
    assert "PastHazards" in repr(decision.hazards)
    assert "Decision(" in repr(decision)
    assert "<" in decision._repr_html_()


def packed_flight(monkeypatch: pytest.MonkeyPatch, flight: FlightSetup) -> Run:
    """A flight that has no room for whole decisions."""
    monkeypatch.setattr(closed_loop, "Logbook", lambda: Logbook(0))
    return flight.fly()


def test_past_decisions_hold_little_and_none_holds_another(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = setup(0.1, 1.0)
    run = packed_flight(monkeypatch, flight)
    shared: dict[int, object] = {}
    held_bytes((flight, run.decisions[-1]), shared)
    for entry in run.decisions[:-1]:
        entry.flight.explanation  # noqa: B018 - kept from now on.
        assert held_bytes(entry, shared) < PAST_BYTES
    assert held_bytes(run.decisions, shared) < 8 * len(run.decisions) + 200


def test_a_flight_is_the_same_however_much_of_it_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, packed = setup().fly(), packed_flight(monkeypatch, setup())
    np.testing.assert_array_equal(whole.states, packed.states)
    for one, other in zip(whole.decisions, packed.decisions, strict=True):
        ours, theirs = decision_message(one), decision_message(other)
        assert ours | {"elapsed_ms": 0.0} == theirs | {"elapsed_ms": 0.0}
    draw_snapshot(packed, None, "")
    draw_snapshot(packed, 5, "")


def test_whoever_watches_is_handed_every_decision_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(closed_loop, "Logbook", lambda: Logbook(0))
    taken: list[LoggedDecision] = []
    setup(seconds=10.0).fly(lambda entry, _: taken.append(entry))
    assert all(entry.flight.decision.hazards.points is not None for entry in taken)


def test_a_system_holds_no_more_after_many_decisions_than_after_few() -> None:
    flight = prepare(
        read_mission("static-obstacles", lambda _: None)
        .with_values("mission", waypoints_m=[[12.0, 0.0, 0.0], [0.0, 0.0, 0.0]] * 8)
        .with_values("simulation", time_limit_s=200.0)
    )
    system, sizes = flight.system(), []
    shared: dict[int, object] = {}
    held_bytes(flight, shared)

    def weigh(entry: LoggedDecision, _: object) -> None:
        if entry.flight.time_s > 60.0:  # Once all about is known.
            sizes.append(held_bytes(system, dict(shared)))

    closed_loop.simulate(
        system,
        flight.world,
        lidars=flight.sensors,
        settings=flight.simulation,
        on_decision=weigh,
    )
    half = len(sizes) // 2
    assert half > 40
    assert max(sizes[half:]) < 1.1 * max(sizes[:half])


@pytest.mark.parametrize("tracker", [None, TrackerSettings()])
def test_reports_that_nobody_asks_for_fill_no_memory(tracker: TrackerSettings | None) -> None:
    reports = reports_for(AvoidanceSettings(tracker=tracker), 1.0)
    sizes = []
    for number in range(3 * MOST_UNASKED):
        place, name = np.array([30.0 + number % 7, 0.0, 0.0]), f"{number:06x}"
        reports.take(Intruder(place, np.zeros(3), name=name, time_s=0.01 * number))
        sizes.append(held_bytes(reports) if number % 1024 == 1023 else 0)
    assert max(sizes) <= 1.1 * max(sizes[:MOST_UNASKED])
    now_s = 0.01 * 3 * MOST_UNASKED
    _, left_out = reports.intruders(State(np.zeros(3), time_s=now_s), now_s)
    assert sum(left_out.values()) > MOST_UNASKED  # Counted, not lost in silence.


def test_kept_scans_come_back_as_they_were() -> None:
    kept = ScanFile()
    taken: list[Scan] = []
    setup(seconds=3.0).fly_with("clearway", scans=taken)
    for scan in taken:
        kept.append(scan)
    assert len(kept) == len(taken) > 0
    for _ in range(2):
        for ours, theirs in zip(kept, taken, strict=True):
            assert (ours.sensor, ours.time_s) == (theirs.sensor, theirs.time_s)
            np.testing.assert_array_equal(ours.points_m, theirs.points_m)


HOUR = """
[mission]
name = "hour"
waypoints_m = [{waypoints}]

[vehicle]
position_m = [-4, 0, 4]
kind = "{kind}"

[simulation]
time_limit_s = 3600

[[lidar]]
sigma_m = 0.03
dropout = 0.05
"""


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["plane", "inertialess"])
def test_an_hour_of_flight_with_all_that_it_leaves_keeps_bounded_memory(
    tmp_path: Path, kind: str
) -> None:
    there_and_back = ", ".join(["[52, 0, 4]", "[-4, 0, 4]"] * 60)
    text, rng = HOUR.format(waypoints=there_and_back, kind=kind), np.random.default_rng(1)
    for x, y in rng.uniform([3.0, -30.0], [48.0, 30.0], (90, 2)).round(2).tolist():
        text += (
            f'[[obstacle]]\nshape = "line"\nposition_m = [{x}, {y}, 11.0]\n'
            "orientation_deg = [0, -90, 0]\nsize_m = [22.0]\nradius_m = 0.25\n"
        )
    (tmp_path / "hour.toml").write_text(text)
    out = tmp_path / "out"
    program = [sys.executable, "-m", "clearway"]
    subprocess.run([*program, "fly", tmp_path / "hour.toml", "--out", out], check=False)
    assert json.loads((out / "summary.json").read_text())["time_s"] > 3500.0
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0 < HOUR_MB
    subprocess.run([*program, "replay", out, "--html", tmp_path / "page.html"], check=True)
    assert (tmp_path / "page.html").stat().st_size > 100_000
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0 < REPLAY_MB
