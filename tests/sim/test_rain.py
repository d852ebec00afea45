"""Whole flights in rain: they arrive as in the dry, and say what they see."""

from __future__ import annotations

from dataclasses import replace

import pytest

import clearway as cw
from clearway.base.errors import InputError
from clearway.live.outputs.alarms import AlarmKind
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from clearway.sim import simulate

DRY = cw.read_mission("static-obstacles").with_values("simulation", seed=3)
HELD_BACK = "scan: lone returns that wait for a second scan: rain or dust?"


def in_rain(share: float) -> MissionFile:
    return DRY.with_values("lidar", false_returns=share)


@pytest.mark.parametrize("kind", ["plane", "inertialess"])
def test_a_mission_in_rain_is_flown_as_in_the_dry(kind: str) -> None:
    dry = cw.fly(DRY.with_values("vehicle", kind=kind))
    setup = prepare(in_rain(0.004).with_values("vehicle", kind=kind))
    assert "0.4 % of the beams return falsely" in str(setup.escape)
    run = setup.fly()
    assert run.safe
    assert run.emergencies == 0
    assert run.metrics.path_length_m < 1.5 * dry.metrics.path_length_m
    assert run.counts[HELD_BACK] > 10 * len(run.decisions)
    assert "% of the beams return alone: rain or dust?" in run.decisions[-1].flight.explanation
    assert not run.summary()["alarms"]
    assert HELD_BACK not in dry.counts


def test_rain_that_nobody_declares_is_noticed() -> None:
    dry, wet = prepare(DRY), prepare(in_rain(0.004))
    run = simulate(dry.system(), wet.world, lidars=wet.lidars, settings=wet.simulation)
    assert run.safe
    assert run.decisions[-1].flight.false_share == pytest.approx(0.004, rel=0.4)


def test_heavy_rain_is_an_alarm() -> None:
    limited = in_rain(0.015).with_values("simulation", time_limit_s=15.0)
    alarms = cw.fly(limited).summary()["alarms"]
    assert [alarm["kind"] for alarm in alarms] == [AlarmKind.FALSE_RETURNS]
    assert "% of the beams return alone" in alarms[0]["why"]


def test_the_same_seed_rains_the_same() -> None:
    short = in_rain(0.004).with_values("simulation", time_limit_s=10.0)
    first, again = (cw.fly(short).states for _ in range(2))
    assert first.tobytes() == again.tobytes()


@pytest.mark.parametrize("share", [-0.1, 1.0, "some"])
def test_a_share_that_is_none_is_refused_by_its_name(share: float | str) -> None:
    with pytest.raises(InputError, match="false_returns"):
        DRY.with_values("lidar", false_returns=share)


def test_a_range_without_end_cannot_return_falsely() -> None:
    (lidar,) = prepare(DRY).lidars
    endless = cw.BeamPattern.per_cell(cw.AvoidanceGrid.uniform(), 4)
    with pytest.raises(cw.ClearwayError, match="false_returns needs a range that ends"):
        replace(lidar, pattern=endless, false_returns=0.01)
