"""A flight whose promise is not kept, or that leaves its goal, says so."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.live import FlightDecision
from clearway.live.inputs.own_scatter import OwnScatter
from clearway.live.outputs.alarms import AlarmKind
from clearway.sim import Run
from clearway.sim.endings import alarms_of
from in_process import clearway
from random_starts import Tables, flight

LOOKS_UP: Tables = {
    "lidar": {
        "beams_per_cell": None,
        "azimuth_deg": np.linspace(-178.2, 178.2, 100).tolist(),
        "elevation_deg": np.linspace(-7.0, 52.0, 30).tolist(),
        "max_range_m": 20.0,
    },
    "grid": {
        "range_m": 20.0,
        "azimuth_deg": 170.0,
        "columns": 15,
        "elevation_deg": [-7.0, 52.0],
        "rows": 5,
    },
    "prices": {"off_level": 0.0},
    "simulation": {"time_limit_s": 60.0},
}
STAYS = """
[mission]
name = "stays"
waypoints_m = [[14.2, -2.5, 1.3]]
[vehicle]
kind = "inertialess"
position_m = [-5.8, -2.5, 1.3]
[safety]
start_free_m = 0.6
[simulation]
time_limit_s = 30
[[lidar]]
"""


def alarms(run: Run[Any]) -> list[dict[str, Any]]:
    told: list[dict[str, Any]] = run.summary()["alarms"]
    return told


def test_a_plane_that_sinks_away_from_its_goal_says_so() -> None:
    """Its field of view has its lower edge near the horizon, and with no price diving looks
    cheapest."""
    run = flight("plane", 0, LOOKS_UP).fly()
    low_m = min(run.states[0, 2], run.mission.goals_m[0, 2])
    assert run.states[:, 2].min() < low_m - 15.0
    alarm = next(told for told in alarms(run) if told["kind"] == AlarmKind.OFF_HEIGHT)
    assert "below its leg and sinking" in alarm["why"]
    assert "field of view from -7 to 52 deg" in alarm["why"]
    entry = next(one for one in run.decisions if one.flight.alarms)
    assert f"ALARM: {entry.flight.alarms[0].why}" in entry.flight.explanation
    assert low_m - 20.0 < entry.flight.state.position_m[2] < low_m - 10.0
    assert "its time was up" in str(run.summary()["reason"])


def test_a_copter_that_does_not_leave_its_start_says_so(tmp_path: Path) -> None:
    """Its mission declares too little free about the start: that is said before and in flight."""
    file = tmp_path / "stays.toml"
    file.write_text(STAYS)
    done = clearway("fly", file, "--no-plots", "--no-mcap", "--json", cwd=tmp_path)
    assert done.returncode == 1
    assert "it may stay where it starts, start_free_m = 0." in done.stderr
    assert "ALARM: the vehicle has not left its start for 24 s, 20 m from goal 1" in done.stderr
    told = json.loads(done.stdout)
    assert [one["kind"] for one in told["alarms"]] == [AlarmKind.STAYS]
    assert told["guarantee"] is False
    assert "the vehicle has not left its start" in told["reason"]
    rows = (tmp_path / "clearway-out" / "stays" / "decisions.jsonl").read_text().splitlines()
    assert json.loads(rows[-1])["alarms"]
    assert "alarms" not in json.loads(rows[0])


@pytest.mark.parametrize(
    ("untold_m", "stated_m", "kind"),
    [
        *((0.3, 0.0, kind) for kind in ("plane", "inertialess", "multirotor")),
        *((scatter_m, scatter_m, "plane") for scatter_m in (0.3, 0.0)),
        *(
            pytest.param(scatter_m, scatter_m, kind, marks=pytest.mark.nightly)
            for scatter_m in (0.3, 0.0)
            for kind in ("inertialess", "multirotor")
        ),
    ],
)
def test_own_places_that_scatter_untold_are_an_alarm(
    untold_m: float, stated_m: float, kind: str
) -> None:
    asked: Tables = {
        "mission": {"waypoints_m": [[90.0, 0.0, 0.0]]},
        "vehicle": {"kind": kind},
        "faults": {"own_position_sigma_m": untold_m},
        "simulation": {"position_sigma_m": stated_m, "time_limit_s": 25.0},
    }
    kinds = [one["kind"] for one in alarms(flight("copter", 0, asked).fly())]
    assert (AlarmKind.OWN_POSITION in kinds) == (untold_m > stated_m)


@given(
    sigma_m=st.floats(0.05, 1.0),
    carried_m=st.floats(-1.0, 1.0),
    seed=st.integers(0, 2**32 - 1),
)
def test_scatter_is_told_from_what_carries_a_vehicle(
    sigma_m: float, carried_m: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    noisy, carried = OwnScatter(), OwnScatter()
    errors = rng.normal(0.0, sigma_m, (121, 3))
    gusts = np.cumsum(rng.normal(0.0, 0.1 * sigma_m, (120, 3)), axis=0)
    for before, after, gust in zip(errors, errors[1:], gusts, strict=False):
        noisy.take(after - before + carried_m)
        carried.take(carried_m + gust)
    assert noisy.std_m == pytest.approx(sigma_m, rel=0.45)
    assert carried.std_m < 0.2 * sigma_m


def test_a_promised_escape_that_does_not_come_is_an_alarm() -> None:
    """The sensor is dead from the start, and nothing stands there."""
    run = flight("plane", 0, {"faults": {"dead_from_s": 0.0}}).fly()
    assert run.ways_out is not None
    assert run.ways_out.within is not None
    alarm = alarms(run)[0]
    assert alarm["kind"] == AlarmKind.NO_ESCAPE
    assert alarm["breaks_promise"]
    assert alarm["time_s"] >= run.ways_out.within
    assert run.summary()["guarantee"] is False


def test_an_alarm_is_told_once_for_as_long_as_it_lasts() -> None:
    def at(time_s: float, *kinds: AlarmKind) -> FlightDecision:
        raised = tuple(
            SimpleNamespace(kind=kind, why=f"{time_s}", breaks_promise=False) for kind in kinds
        )
        return FlightDecision(
            time_s,
            mode_state=None,  # type: ignore[arg-type]
            goal=0,
            decision=None,  # type: ignore[arg-type]
            obstacle_map=None,
            in_doubt=False,
            scan_age_s=0.0,
            counts={},
            alarms=raised,  # type: ignore[arg-type]
        )

    flights = [at(0.0), at(1.0, AlarmKind.STAYS), at(2.0, AlarmKind.STAYS), at(3.0)]
    flights += [at(4.0, AlarmKind.OFF_HEIGHT, AlarmKind.STAYS)]
    told = [(one["time_s"], one["kind"]) for one in alarms_of(flights)]
    assert told == [(1.0, "stays"), (4.0, "off height"), (4.0, "stays")]
