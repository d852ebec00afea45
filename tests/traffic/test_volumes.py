"""Volumes: exact times of sharing one, alerts that come soon and go late."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError, InputError
from clearway.base.units import FOOT_M, KNOT_MPS, NAUTICAL_MILE_M
from clearway.io.traffic.traffic import read_traffic
from clearway.missions.alert_history import alert_history
from clearway.missions.volume_section import volumes_named
from clearway.traffic import Intruder
from clearway.traffic.recorded import collect_aircraft
from clearway.traffic.volumes import (
    VOLUME_SETS,
    AirVolume,
    AlertLevel,
    Alerts,
    VolumeSet,
    alerts_after,
)
from clearway.vehicle.performance import PERFORMANCES

PLAIN = AirVolume("plain", 600.0, 80.0)
TAU = AirVolume("tau", 1200.0, 140.0, tau_s=35.0)
place = st.tuples(*[st.floats(-4000.0, 4000.0)] * 2, st.floats(-300.0, 300.0)).map(np.array)
motion = st.tuples(*[st.floats(-120.0, 120.0)] * 2, st.floats(-8.0, 8.0)).map(np.array)


def test_head_on_is_entered_and_left_a_radius_before_and_after() -> None:
    begins, ends = PLAIN.find_shared(np.array([3000.0, 0.0, 0.0]), np.array([-50.0, 0.0, 0.0]))
    assert begins == pytest.approx(48.0)
    assert ends == pytest.approx(72.0)


def test_heights_count_too() -> None:
    level = np.array([3000.0, 0.0, 200.0])
    assert PLAIN.find_shared(level, np.array([-50.0, 0.0, 0.0]))[0] == math.inf
    begins, ends = PLAIN.find_shared(level, np.array([-50.0, 0.0, -2.5]))
    assert (begins, ends) == pytest.approx((48.0, 72.0))
    assert PLAIN.find_shared(level, np.array([-50.0, 0.0, -1.8]))[0] == pytest.approx(120.0 / 1.8)


def test_modified_tau_is_met_where_its_definition_says() -> None:
    """(D^2 - r^2) / (r . v) = tau, head on: r^2 - tau v r - D^2 = 0."""
    speed = 100.0
    range_m = 0.5 * (35.0 * speed + math.hypot(35.0 * speed, 2.0 * 1200.0))
    begins, ends = TAU.find_shared(np.array([20_000.0, 0.0, 0.0]), np.array([-speed, 0.0, 0.0]))
    assert begins == pytest.approx((20_000.0 - range_m) / speed)
    assert ends == pytest.approx((20_000.0 + 1200.0) / speed)
    passing = TAU.find_shared(np.array([20_000.0, 1300.0, 0.0]), np.array([-speed, 0.0, 0.0]))
    assert passing == (math.inf, -math.inf), "tau counts for those alone that pass within"


@given(place, motion)
def test_times_are_those_of_a_fine_search(apart: np.ndarray, change: np.ndarray) -> None:
    begins, ends = PLAIN.find_shared(apart, change, 100.0)
    times = np.linspace(0.0, 100.0, 4001)
    there = apart + times[:, None] * change
    inside = (np.hypot(there[:, 0], there[:, 1]) <= 600.0) & (np.abs(there[:, 2]) <= 80.0)
    if inside.any():
        assert begins <= times[inside][0] + 1e-6
        assert ends >= times[inside][-1] - 1e-6
    for moment in (begins, ends, 0.5 * (begins + ends)):
        if math.isfinite(moment):
            at = apart + moment * change
            assert np.hypot(at[0], at[1]) <= 600.0 + 1e-3
            assert abs(at[2]) <= 80.0 + 1e-3


@given(place, motion, st.floats(0.0, 300.0))
def test_a_larger_volume_is_entered_no_later(
    apart: np.ndarray, change: np.ndarray, more: float
) -> None:
    larger = AirVolume("larger", 600.0 + more, 80.0 + more)
    growing = AirVolume("growing", 600.0, 80.0, growth_mps=0.05 * more)
    begins = PLAIN.find_shared(apart, change)[0]
    assert larger.find_shared(apart, change)[0] <= begins + 1e-9
    assert growing.find_shared(apart, change)[0] <= begins + 1e-6


@given(place, motion)
def test_tau_is_never_later_than_its_cylinder(apart: np.ndarray, change: np.ndarray) -> None:
    cylinder = AirVolume("cylinder", TAU.radius_m, TAU.half_height_m)
    assert TAU.find_shared(apart, change)[0] <= cylinder.find_shared(apart, change)[0] + 1e-9


def looked(volumes: VolumeSet, ranges: list[float]) -> list[AlertLevel]:
    """Levels, a second apart, of one that is met head on at 50 m/s from such ranges."""
    now, levels = Alerts(), []
    for second, range_m in enumerate(ranges):
        other = Intruder([range_m, 0.0, 0.0], [-50.0, 0.0, 0.0], name="x", time_s=float(second))
        now = alerts_after(now, volumes, np.zeros(3), np.zeros(3), [other], float(second))
        levels.append(now.level)
    return levels


def test_alerts_come_at_once_and_go_late() -> None:
    small = VOLUME_SETS["f3442"]
    near, far = 1500.0, 60_000.0
    levels = looked(small, [far, near, far, far, far, far])
    assert levels[0] is AlertLevel.NONE
    assert levels[1] is AlertLevel.WARNING
    assert levels[1:4] == [AlertLevel.WARNING] * 3
    assert levels[4] is AlertLevel.NONE
    assert looked(VOLUME_SETS["do-365"], [near, near]) == [AlertLevel.NONE, AlertLevel.WARNING]


@pytest.mark.parametrize("name", [*VOLUME_SETS])
def test_a_closer_one_never_alerts_less(name: str) -> None:
    alone = VolumeSet(name, "", VOLUME_SETS[name].volumes, VOLUME_SETS[name].rules, window_s=0.5)
    levels = looked(alone, list(np.arange(20_000.0, 0.0, -50.0)))
    assert levels == sorted(levels)
    assert levels[-1] >= AlertLevel.WARNING


def test_warnings_without_a_way_are_recoveries() -> None:
    near = Intruder([1500.0, 0.0, 0.0], [-50.0, 0.0, 0.0], name="x")
    zero, small = np.zeros(3), VOLUME_SETS["f3442"]
    assert alerts_after(Alerts(), small, zero, zero, [near], 0.0, saturated=True).level == 4


def test_volumes_must_lie_inside_each_other() -> None:
    with pytest.raises(InputError, match="must lie inside"):
        VolumeSet.of("own", (PLAIN, TAU))
    with pytest.raises(InputError, match="radius_m"):
        AirVolume("none", 0.0, 1.0)
    with pytest.raises(InputError, match="at least one"):
        VolumeSet.of("own", ())
    with pytest.raises(ClearwayError, match="f3442"):
        volumes_named("f3443")


def test_own_volumes_are_read_from_a_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    file = tmp_path / "mine.toml"
    file.write_text(
        '[[volume]]\nname = "wide"\nradius_m = 900\nhalf_height_m = 100\nbuffer_m = 50\n'
        '[[volume]]\nname = "near"\nradius_m = 150\nhalf_height_m = 30\n'
    )
    mine = volumes_named(str(file))
    assert [one.name for one in mine.volumes] == ["wide", "near"]
    assert mine.outermost.kept.radius_m == 950.0
    file.write_text('[[volume]]\nname = "wide"\nradius_m = -1\nhalf_height_m = 100\n')
    with pytest.raises(InputError, match="radius_m"):
        volumes_named(str(file))


def first_times(folder, scenario: str, volumes: str) -> dict[AlertLevel, float]:  # type: ignore[no-untyped-def]
    """When each level is first given to the ownship of an encounter of DAIDALUS."""
    path = folder / "daa" / "daidalus" / "Scenarios" / f"{scenario}.daa"
    if not path.is_file():
        pytest.skip(f"needs data: {path.name}")
    aircraft = collect_aircraft(read_traffic(path))
    told = alert_history(aircraft, "Ownship", VOLUME_SETS[volumes], PERFORMANCES["wing"])
    times: dict[AlertLevel, float] = {}
    for time_s, _, level in told.changes():
        times.setdefault(level, time_s)
    return times


def test_alerts_of_h1_come_within_a_second_of_daidalus_s(data_dir) -> None:  # type: ignore[no-untyped-def]
    """DaidalusqAlerting-no_sum.csv: corrective at 112 s, warning at 142 s, none at 206 s."""
    times = first_times(data_dir, "H1", "do-365")
    assert times[AlertLevel.CORRECTIVE] == pytest.approx(112.0, abs=1.0)
    warning = min(times.get(AlertLevel.WARNING, 999.0), times.get(AlertLevel.RECOVERY, 999.0))
    assert warning == pytest.approx(142.0, abs=1.0)
    assert times[AlertLevel.NONE] == pytest.approx(206.0, abs=1.0)


def test_times_to_volume_of_h1_are_daidalus_s_every_second(data_dir) -> None:  # type: ignore[no-untyped-def]
    gold = data_dir / "daa" / "daidalus" / "gold" / "DaidalusqAlerting-no_sum.csv"
    if not gold.is_file():
        pytest.skip(f"needs data: {gold.name}")
    expected = {}
    for line in gold.read_text().splitlines()[2:]:
        cells = [cell.strip() for cell in line.split(",")]
        if cells[6] != "infty":
            expected[float(cells[0])] = float(cells[6])
    path = data_dir / "daa" / "daidalus" / "Scenarios" / "H1.daa"
    aircraft = collect_aircraft(read_traffic(path))
    told = alert_history(aircraft, "Ownship", VOLUME_SETS["do-365"], PERFORMANCES["wing"])
    compared = 0
    for second in told.seconds:
        (alert,) = second.alerts.alerts
        mine = alert.time_to_volume_s[AlertLevel.CORRECTIVE]
        if second.time_s in expected:
            assert mine == pytest.approx(expected[second.time_s], abs=0.5)
            compared += 1
    assert compared > 200


@pytest.mark.parametrize(
    ("scenario", "closing", "crossing", "closest_s", "miss_nmi"),
    [
        ("C0_0_120", math.hypot(150.0, 120.0), 0.0, 120.0, 0.0),
        ("C1_0_120", math.hypot(120.0, 180.0), 0.0, 104.9, 0.417),
        ("H0_0_120", 300.0, 0.0, 100.0, 0.5),
    ],
)
def test_scripted_encounters_alert_when_their_geometry_says(  # type: ignore[no-untyped-def]
    data_dir, scenario, closing, crossing, closest_s, miss_nmi
) -> None:
    """Straight flight to a known closest point: the time at which modified tau is 35 s, less 55."""
    del crossing
    speed, miss = closing * KNOT_MPS, miss_nmi * NAUTICAL_MILE_M
    radius = TAU_OF.radius_m
    # r^2 = miss^2 + (v s)^2 with s seconds to go: r^2 - tau v^2 s = D^2.
    to_go = 0.5 * (35.0 + math.sqrt(35.0**2 + 4.0 * (radius**2 - miss**2) / speed**2))
    times = first_times(data_dir, scenario, "do-365")
    assert times[AlertLevel.CORRECTIVE] == pytest.approx(closest_s - to_go - 55.0, abs=2.0)
    assert times[AlertLevel.WARNING] == pytest.approx(closest_s - to_go - 25.0, abs=2.0)


TAU_OF = VOLUME_SETS["do-365"].outermost


def test_the_standards_numbers() -> None:
    clear, collision = VOLUME_SETS["f3442"].volumes
    assert (clear.radius_m, clear.half_height_m) == (2000.0 * FOOT_M, 250.0 * FOOT_M)
    assert (collision.radius_m, collision.half_height_m) == (500.0 * FOOT_M, 100.0 * FOOT_M)
    assert TAU_OF.radius_m == pytest.approx(0.66 * NAUTICAL_MILE_M)
