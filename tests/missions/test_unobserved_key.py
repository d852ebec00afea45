"""`[safety] unobserved_m`: none is strict to the bit, and some is never called strict."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.live.guard.guardian import Guardian
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.sim import Run

ROOT = Path(__file__).parents[2]


def flown(file: MissionFile, **safety: object) -> Run:
    return prepare(file.with_values("safety", **safety) if safety else file).fly()


@pytest.fixture(
    scope="module",
    params=[60.0, pytest.param(900.0, marks=pytest.mark.nightly)],
    ids="{:g}s".format,
)
def walls(request: pytest.FixtureRequest) -> MissionFile:
    """A plane that turns in 3.8 m, past walls with gaps: no escape is seen behind them."""
    return read_mission("walls:0").with_values("simulation", time_limit_s=request.param)


@pytest.fixture(scope="module")
def strict(walls: MissionFile) -> Run:
    return flown(walls)


def test_a_budget_of_nothing_flies_as_strict_to_the_bit(walls: MissionFile, strict: Run) -> None:
    """And so does one of less than any movement is looked at by, which searches all the same."""
    settings = prepare(walls.with_values("safety", unobserved_m=0.0)).planner.settings
    assert settings == prepare(walls).planner.settings
    least = flown(walls, unobserved_m=1e-9)
    assert least.summary()["escape_mode"] == "budgeted"
    assert np.array_equal(least.time_s, strict.time_s)
    assert np.array_equal(least.states, strict.states)


def test_a_flight_with_a_budget_promises_nothing(walls: MissionFile, strict: Run) -> None:
    run = flown(walls, unobserved_m=4.0)
    summary = run.summary()
    assert strict.summary()["guarantee"] is True
    assert strict.summary()["unobserved_m"] is None
    assert summary["guarantee"] is False
    assert (summary["escape_asked"], summary["escape_mode"]) == ("budgeted", "budgeted")
    assert "strict" not in summary["escape_why"]
    assert "at most 4 m lead through unobserved space: no guarantee" in summary["escape_why"]
    assert "docs/sight.md" in summary["escape_why"]
    assert (ROOT / "docs" / "sight.md").exists()
    assert 0.0 < summary["unobserved_m"] <= 4.0
    assert not np.array_equal(run.states, strict.states)
    spends = [entry.flight for entry in run.decisions if _spent_m(entry.flight.decision) > 0.0]
    assert spends
    for flight in spends:
        told = f"crosses {_spent_m(flight.decision):.1f} m of unobserved space, as allowed"
        assert told in flight.explanation


def _spent_m(decision: object) -> float:
    way = decision.way_out  # type: ignore[attr-defined]
    return 0.0 if way is None else float(way.unobserved_m)


@pytest.mark.parametrize("escape", ["known", "mapped", "off"])
def test_only_strict_is_softened(escape: str) -> None:
    file = read_mission_file("static-obstacles")
    with pytest.raises(
        InputError, match=f'unobserved_m: 4 m soften escape = "strict", and "{escape}"'
    ):
        file.with_values("safety", unobserved_m=4.0, escape=escape)
    with pytest.raises(InputError, match="unobserved_m"):
        file.with_values("safety", unobserved_m=-1.0)


def test_who_brakes_is_refused() -> None:
    file = read_mission_file("copter-forest").with_values("safety", unobserved_m=4.0)
    with pytest.raises(InputError, match="only vehicles without inertia may cross unobserved"):
        prepare(file)


def test_what_sees_too_little_for_a_budget_flies_as_known() -> None:
    """As with strict; of the budget nothing is left."""
    file = read_mission_file("static-obstacles").with_values("safety", unobserved_m=4.0)
    setup = prepare(file.with_values("lidar", max_range_m=2.0))
    system = setup.system()
    assert (system.escape.asked, system.escape.flown) == ("budgeted", "known")
    assert system.planner.settings.escape == "known"
    assert system.planner.settings.unobserved_m == 0.0


def test_a_guardian_passes_it_through() -> None:
    setup = prepare(read_mission_file("static-obstacles").with_values("safety", unobserved_m=4.0))
    guardian = setup.guardian(0.5, None)
    assert isinstance(guardian, Guardian)
    assert guardian.escape.flown == "budgeted"
    assert guardian.planner.settings.unobserved_m == 4.0
