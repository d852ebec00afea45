"""Several aircraft that report by one address: all are judged, or named; none hides another."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from in_process import clearway as run_here

OWN, SHARED = "3c0001", "000000"


def row(time_s: float, address: str, east_m: float, north_m: float, **more: Any) -> dict[str, Any]:
    """A row of readsb at 3000 ft near 46 N, at 50 m/s east."""
    return {
        "now": 1_700_000_000 + time_s,
        "hex": address,
        "lat": 46.0 + north_m / 111_190.0,
        "lon": 10.0 + east_m / (111_190.0 * math.cos(math.radians(46.0))),
        "alt_baro": 3000,
        "gs": 97.2,
        "track": 90.0,
    } | more


def head_on(phase_s: float, address: str = SHARED, **more: Any) -> list[dict[str, Any]]:
    """Meets the own aircraft after 110 s; corrective at 49 s: 55 s before 610 m."""
    times = [second + phase_s for second in range(120)]
    return [row(t, address, 11_000.0 - 50.0 * t, 10.0, track=270.0, **more) for t in times]


def passing(phase_s: float) -> list[dict[str, Any]]:
    """Never nearer than 60 km, by the address of the other."""
    times = [second + phase_s for second in range(120)]
    return [row(t, SHARED, 40_000.0 + 50.0 * t, 60_000.0) for t in times]


def told(folder: Path, *others: list[dict[str, Any]]) -> tuple[dict[str, Any], str]:
    rows = [row(float(t), OWN, 50.0 * t, 0.0) for t in range(120)]
    rows = sorted([*rows, *(one for group in others for one in group)], key=lambda one: one["now"])
    path = folder / "shared.jsonl"
    path.write_text("".join(json.dumps(one) + "\n" for one in rows))
    done = run_here("alerts", path, "--own", OWN, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), run_here("alerts", path, "--own", OWN).stdout


def first(history: dict[str, Any], level: str) -> float:
    return min(one["time_s"] for one in history["changes"] if one["level"] == level) - 1.7e9


@pytest.mark.parametrize(("hits", "passes"), [(0.2, 0.9), (0.9, 0.2), (0.4, 0.5)])
def test_an_aircraft_does_not_hide_behind_another_of_its_address(
    tmp_path: Path, hits: float, passes: float
) -> None:
    history, text = told(tmp_path, head_on(hits), passing(passes))
    assert first(history, "corrective") == pytest.approx(49.0, abs=2.0)
    assert history["judged"] == [SHARED, f"{SHARED} (2)"]
    assert "2 other aircraft judged" in text


def test_two_places_at_one_time_are_never_no_alert(tmp_path: Path) -> None:
    history, text = told(tmp_path, passing(0.0), head_on(0.0))
    assert "no alert" not in text
    assert [one["reason"].split(" ")[0] for one in history["not_judged"]] == ["120"]
    assert f"{SHARED} is at two places at one time" in text


def test_a_single_wrong_position_makes_no_second_aircraft(tmp_path: Path) -> None:
    rows = head_on(0.0)
    rows[30] |= {"lat": 47.0}
    history, _ = told(tmp_path, rows)
    assert history["judged"] == [SHARED]
    assert first(history, "corrective") == pytest.approx(49.0, abs=2.0)


def test_a_climb_that_no_height_shows_is_not_believed(tmp_path: Path) -> None:
    history, _ = told(tmp_path, head_on(0.0, "3c0002", baro_rate=-6400))
    assert first(history, "corrective") == pytest.approx(49.0, abs=2.0)
