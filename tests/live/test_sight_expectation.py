"""Before take-off a plane is told what to expect of its turns and its sight, and what would do."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from clearway.live.preflight.sight import FAR, NARROW_M, expect_of_sight, field_deg
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import FlightSetup, prepare
from clearway.sensors import BeamPattern, Lidar

PLANE = read_mission_file("static-obstacles")
WIDE = {
    "grid": {"range_m": 20.0, "azimuth_deg": 90.0},
    "lidar": {"beams_per_cell": None, "field_deg": [180, 60], "spacing_deg": 1.0},
}


def changed(file: MissionFile = PLANE, **tables: dict[str, object]) -> FlightSetup:
    for table, values in tables.items():
        file = file.with_values(table, **values)
    return prepare(file)


def told(setup: FlightSetup) -> str | None:
    return expect_of_sight(setup.planner, setup.sensors)


@pytest.mark.parametrize(
    ("tables", "share"),
    [
        ({}, "most"),
        ({"vehicle": {"turn_step_deg": 20}}, "about half of the"),
        (WIDE, "about half of the"),
        ({"vehicle": {"turn_step_deg": 30}}, None),
    ],
)
def test_what_was_measured_is_what_is_told(
    tables: dict[str, dict[str, object]], share: str | None
) -> None:
    """Radius 3.8, 2.9 and 1.9 m at 10 m, and 3.8 m where 20 m are seen."""
    setup = changed(**tables)
    said = told(setup)
    assert (said is None) == (share is None)
    if said is not None:
        assert f", {share} paths take over 1.5 times the straight way" in said
        assert said in setup.notes
        assert len(re.findall(r"[.;:]\s", said)) <= 3


def test_the_radius_that_would_do_does() -> None:
    said = told(changed())
    assert said is not None
    found = re.search(r"a turning radius of ([\d.]+) m \(([\d.]+) m/s\) would do", said.lower())
    assert found is not None
    radius_m, slower_mps = map(float, found.groups())
    enough = changed(vehicle={"turn_step_deg": float(np.degrees(1.0 / radius_m))})
    assert told(enough) is None
    assert told(changed(vehicle={"speed_mps": slower_mps})) is None
    assert told(changed(vehicle={"turn_step_deg": float(np.degrees(0.8 / radius_m))})) is not None


def test_each_thing_that_would_help_is_told_until_it_is_there() -> None:
    few, wide = told(changed()), told(changed(**WIDE))
    spends = told(changed(**WIDE, safety={"unobserved_m": 4.0}))
    assert few is not None
    assert wide is not None
    assert spends is not None
    circle_m = float(re.search(r"a circle of ([\d.]+) m", few)[1])  # type: ignore[index]
    assert f"{FAR * circle_m:.2g} m of range, a field 180 degrees wide and safety.un" in few
    assert "m of range" not in wide
    assert "a field" not in wide
    assert "safety.unobserved_m = 3.8" in wide
    assert "safety.unobserved_m" not in spends


@pytest.mark.parametrize("escape", ["known", "off"])
def test_nothing_is_told_where_escapes_need_not_be_seen(escape: str) -> None:
    assert told(changed(safety={"escape": escape})) is None


def test_nothing_is_told_of_who_can_stop_or_sees_nothing() -> None:
    assert told(changed(vehicle={"kind": "inertialess"})) is None
    assert told(replace(changed(), sensors=())) is None
    assert told(prepare(read_mission_file("copter-forest"))) is None


def test_a_fast_plane_is_given_no_radius_that_it_cannot_fly() -> None:
    said = told(changed(vehicle={"speed_mps": 15.0}, grid={"range_m": 100.0}))
    assert said is not None
    assert "turning radius of" not in said
    assert float(re.search(r"([\d.]+) m of range", said)[1]) > 2.0 * NARROW_M  # type: ignore[index]


@pytest.mark.parametrize("width", [90.0, 180.0, 360.0])
def test_a_field_is_as_wide_as_its_beams(width: float) -> None:
    azimuths = np.radians(np.arange(-0.5 * width, 0.5 * width, 1.0) + 0.5)
    pattern = BeamPattern.from_angles(azimuths, np.radians([-10.0, 0.0, 10.0]), max_range_m=9.0)
    assert field_deg(Lidar("one", pattern)) == pytest.approx(width)
