"""Sensors that scan at a rate of their own, between decisions too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import ClearwayError
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from clearway.sensors import Scan
from clearway.sim import Run, SimulationSettings


def flown(**simulation: Any) -> tuple[list[float], Run[Any]]:
    """Times at which scans were taken in six seconds, and the flight."""
    file = cw.read_mission("static-obstacles").with_values(
        "simulation", time_limit_s=6.0, **simulation
    )
    scans: list[Scan] = []
    run = prepare(file).fly_with("clearway", scans=scans)
    return [scan.time_s for scan in scans], run


@pytest.mark.parametrize("rate_hz", [2.0, 5.0, 10.0])
def test_scans_come_at_their_rate_whatever_a_movement_lasts(rate_hz: float) -> None:
    times, run = flown(scan_rate_hz=rate_hz)
    np.testing.assert_allclose(times, np.arange(len(times)) / rate_hz, atol=0.051)
    assert len(times) == pytest.approx(6.0 * rate_hz, abs=1)
    assert len(run.decisions) == 6


def test_without_a_rate_there_is_a_scan_a_decision() -> None:
    times, run = flown()
    assert times == [entry.flight.time_s for entry in run.decisions]


def test_scans_between_decisions_are_late_by_the_latency_too() -> None:
    times, _ = flown(scan_rate_hz=5.0, scan_latency_s=0.3)
    late = np.arange(len(times)) / 5.0 - np.array(times)
    np.testing.assert_allclose(late[3:], 0.3, atol=0.051)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 21.0, float("nan")])
def test_a_rate_that_steps_cannot_keep_is_refused(rate_hz: float) -> None:
    with pytest.raises(ClearwayError, match="scan_rate_hz"):
        SimulationSettings(scan_rate_hz=rate_hz)


# --- fields of view ------------------------------------------------------------------------------


def lidar_of(**keys: Any) -> Any:
    file = MissionFile.model_validate(
        {"mission": {"name": "m", "waypoints_m": [[9, 0, 0]]}, "lidar": [keys]}
    )
    (lidar,) = prepare(file).lidars
    return lidar


@pytest.mark.parametrize(
    ("field", "spacing", "beams"), [((360, 50), 1.0, 18_000), ((90, 60), 1.0, 5_400)]
)
def test_a_field_of_view_has_a_beam_in_every_square(
    field: tuple[float, float], spacing: float, beams: int
) -> None:
    pattern = lidar_of(field_deg=field, spacing_deg=spacing, max_range_m=40.0).pattern
    assert (pattern.beams, pattern.max_range_m) == (beams, 40.0)
    assert pattern.spacing_rad == pytest.approx(np.radians(spacing))
    azimuths = np.unique(np.round(np.degrees(pattern.azimuth_rad), 6))
    elevations = np.unique(np.round(np.degrees(pattern.elevation_rad), 6))
    np.testing.assert_allclose(np.diff(azimuths), spacing)
    np.testing.assert_allclose(np.diff(elevations), spacing)
    for angles, width in ((azimuths, field[0]), (elevations, field[1])):
        assert -angles[0] == angles[-1] == 0.5 * (width - spacing)


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"field_deg": (90, 60)}, "spacing_deg"),
        ({"field_deg": (90, 60), "spacing_deg": 1.0, "pattern": "vlp16"}, "only one"),
        ({"field_deg": (400, 60), "spacing_deg": 1.0}, "360"),
        ({"field_deg": (90, 0.5), "spacing_deg": 1.0}, "spacing_deg at least"),
    ],
)
def test_a_field_of_view_that_cannot_be_is_refused(keys: dict[str, Any], problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        lidar_of(**keys)
