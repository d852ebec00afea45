"""Old paths of modules: each that the documentation printed still answers, and says where to go."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

import clearway

PRINTED = {
    "clearway.autopilot.simulated": (),
    "clearway.avoidable": (),
    "clearway.avoidance": ("Decision", "decide"),
    "clearway.avoidance.decide": ("decide",),
    "clearway.baselines": ("BaselinePilot", "Manoeuvre"),
    "clearway.campaigns.families": (),
    "clearway.costs": ("Arrival", "Goal", "Prices", "arrival"),
    "clearway.detour": ("known_way",),
    "clearway.fusion": (
        "Evidence",
        "Rating",
        "ReachAssessment",
        "assess_cells",
        "rate_reach_set",
        "untouched",
    ),
    "clearway.grid": ("AvoidanceGrid",),
    "clearway.intruders": ("Intruder", "Report", "track_reports"),
    "clearway.io.sequences": ("open_scans",),
    "clearway.io.traffic": ("read_traffic",),
    "clearway.mission": ("Mission", "Mode"),
    "clearway.movements": ("Movement", "MovementAutomaton"),
    "clearway.obstacle_map": ("ObstacleMap",),
    "clearway.obstacles": ("Obstacle",),
    "clearway.playback": ("Moment", "play"),
    "clearway.recordings": (
        "aircraft_of",
        "closest_pairs",
        "local_reports",
        "take_part",
        "without_ghosts",
    ),
    "clearway.risk.entry": (),
    "clearway.rules": ("Rule", "RuleView", "Verdict", "altitude_floor"),
    "clearway.sensors": ("Detection", "RangeSensor", "Standing", "detection_of_cells"),
    "clearway.sensors.trust": ("heard",),
    "clearway.simulation": ("SimulationSettings", "simulate"),
    "clearway.simulation.pilot": ("Pilot",),
    "clearway.substitute": ("fly_in_place",),
    "clearway.system": ("AvoidanceSystem", "DataLimits"),
    "clearway.traffic": ("AirTraffic", "ScriptedIntruder", "Intruder"),
    "clearway.vehicle": ("PlaneModel", "Vehicle"),
}
"""Paths that README, docs and examples of version 0.1.0 printed, and names of theirs; of those that
were divided since, what has moved on."""
STAYED = ("clearway.avoidance.decide", "clearway.sensors", "clearway.sensors.trust")
NOW_A_PACKAGE = {
    "clearway.avoidance": "Situation",
    "clearway.io.traffic": "what_content",
    "clearway.obstacles": "shapes_of",
    "clearway.traffic": "AirTraffic",
    "clearway.vehicle": "PlaneModel",
}
"""Paths where other things are now, and a name that only the old module had."""


@pytest.fixture(autouse=True)
def _as_if_never_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    for path in list(sys.modules):
        if path in PRINTED and path not in STAYED and path not in NOW_A_PACKAGE:
            monkeypatch.delitem(sys.modules, path)


@pytest.mark.parametrize("path", PRINTED)
@pytest.mark.filterwarnings("ignore:.* is now .*:DeprecationWarning")
def test_printed_paths_answer_with_their_names(path: str) -> None:
    module = import_module(path)
    assert [name for name in PRINTED[path] if not getattr(module, name, None)] == []
    assert not hasattr(module, "no_such_name")


@pytest.mark.parametrize("path", sorted(set(PRINTED) - set(STAYED) - set(NOW_A_PACKAGE)))
def test_they_say_where_to_go(path: str) -> None:
    with pytest.warns(DeprecationWarning, match=r"is now clearway\.\S+; .* version 0\.3") as caught:
        import_module(path)
    assert any(str(one.message).startswith(f"{path} is now ") for one in caught)
    assert {one.filename for one in caught if path in str(one.message)} <= {
        import_module.__code__.co_filename,
        __file__,
    }


@pytest.mark.parametrize("path", NOW_A_PACKAGE)
def test_packages_in_the_place_of_modules_know_their_names(path: str) -> None:
    module = import_module(path)
    with pytest.warns(DeprecationWarning, match=f"{path}.{NOW_A_PACKAGE[path]} is now"):
        assert getattr(module, NOW_A_PACKAGE[path]) is not None


def test_the_decision_is_a_function_where_it_was() -> None:
    from clearway.avoidance import decide

    assert decide is clearway.decide
    assert import_module("clearway.avoidance.decide").decide is decide


def test_the_same_values_and_not_copies_of_them() -> None:
    with pytest.warns(DeprecationWarning, match="clearway.movements is now"):
        from clearway.movements import MovementAutomaton
    assert MovementAutomaton is clearway.MovementAutomaton


@pytest.mark.parametrize("old", clearway._MOVED)
def test_every_row_of_the_table_leads_somewhere(old: str) -> None:
    path = f"clearway.{clearway._MOVED[old]}"
    assert import_module(path).__name__ == path


@pytest.mark.filterwarnings("ignore:.* is now .*:DeprecationWarning")
def test_a_path_that_never_was_is_none() -> None:
    for path in ("clearway.nowhere", "clearway.mission.nowhere", "clearway.io.nowhere"):
        with pytest.raises(ModuleNotFoundError):
            import_module(path)


def test_python_m_runs_what_has_moved() -> None:
    command = [sys.executable, "-m", "clearway.autopilot.simulated", "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "usage" in done.stdout.lower()
    assert "clearway.autopilot.simulated is now clearway.mavlink.simulated" in done.stderr


def test_python_m_clearway_is_the_command_line() -> None:
    command = [sys.executable, "-m", "clearway", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert (done.returncode, done.stdout.strip()) == (0, clearway.__version__)
