"""A key of a mission goes by name to what it sets, so that a new one needs no third place."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pytest

from clearway.avoidance.plan.costs import Prices
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.io.toml import Section, parse_model
from clearway.missions.fault_section import FaultsSection
from clearway.missions.lidar_section import LidarSection
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_sections import (
    PricesSection,
    RatingSection,
    SafetySection,
    SimulationSection,
)
from clearway.missions.sections import values_for
from clearway.missions.setup import prepare
from clearway.missions.traffic_sections import TrafficSection
from clearway.sensors import Lidar, Standing
from clearway.sim.faults import Faults
from clearway.sim.scripted import TrafficSettings
from clearway.sim.settings import SimulationSettings

MISSION = {"mission": {"name": "m", "waypoints_m": [[9, 0, 0]]}}
ELSEWHERE = {
    RatingSection: {"name", "sensors"},
    SafetySection: {"margin_m", "conservative_turning_radius_m"},
    PricesSection: set(),
    SimulationSection: {"attitude_sigma_deg"},
    FaultsSection: {"blind_deg", "dead_from_s"},
    LidarSection: {
        "pattern", "beams_per_cell", "azimuth_deg", "elevation_deg", "position_m", "attitude_deg",
        "min_range_m", "max_range_m", "field_deg", "spacing_deg", "lie", "lies_from_s",
    },
    TrafficSection: {
        "spawn", "models", "tracker", "follow_movers", "recording", "recording_from",
        "own_address", "heights", "heard_within_m", "volumes", "keep_volumes",
    },
}  # fmt: skip
"""Keys that are called otherwise than what they set, or set nothing by themselves."""
SETS = {
    RatingSection: (AvoidanceSettings,),
    SafetySection: (AvoidanceSettings,),
    PricesSection: (Prices,),
    SimulationSection: (SimulationSettings,),
    FaultsSection: (Faults,),
    LidarSection: (Lidar, Standing),
    TrafficSection: (TrafficSettings,),
}


@pytest.mark.parametrize("section", SETS, ids=lambda section: section.__name__)
def test_every_key_is_called_as_what_it_sets(section: type[Section]) -> None:
    settable = {field.name for target in SETS[section] for field in fields(target)}
    assert set(section.model_fields) - settable == ELSEWHERE[section] - settable


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("rating", "unknown", 0.25),
        ("rating", "unknown_unseen", 0.25),
        ("rating", "threshold", 0.25),
        ("safety", "sigmas", 2.5),
        ("safety", "own_drift_mps", 0.25),
        ("safety", "point_sigmas", 2.5),
    ],
)
def test_keys_of_decisions_arrive(table: str, key: str, value: float) -> None:
    file = parse_model("m", MISSION | {table: {key: value}}, MissionFile)
    assert getattr(file.to_avoidance(), key) == value
    assert getattr(parse_model("m", MISSION, MissionFile).to_avoidance(), key) != value


def test_all_others_arrive_too() -> None:
    tables: dict[str, Any] = {
        "rating": {"name": "visible", "sensors": "weighted", "detection": "surface"},
        "safety": {"margin_m": 0.5, "patience_turns": 2.5, "ground_height_m": -9.0},
        "verify": {"method": "none"},
        "prices": {"turn": 0.75},
        "traffic": {"models": ["line"], "report_s": 2.5, "deviates": True},
        "simulation": {"seed": 5, "input_noise": 0.25, "wind_mps": [1, 0, 0]},
        "faults": {"range_bias_m": 0.25, "dead_from_s": 9, "blind_deg": [-90, 90]},
        "lidar": [{"name": "nose", "sigma_m": 0.25, "dropout": 0.5, "trust": 0.75}],
    }
    setup = prepare(parse_model("m", MISSION | tables, MissionFile))
    settings = setup.planner.settings
    assert (settings.rating, settings.sensor_fusion) == ("visible", "weighted")
    assert (settings.safety_margin_m, settings.verify) == (0.5, False)
    assert (settings.prices.turn, settings.intruder_models) == (0.75, ("line",))
    assert (settings.detection, settings.ground_height_m) == ("surface", -9.0)
    assert settings.patience_turns == 2.5
    assert (setup.traffic.report_s, setup.traffic.deviates) == (2.5, True)
    simulation = setup.simulation
    assert (simulation.seed, simulation.input_noise) == (5, 0.25)
    assert (simulation.wind_mps, simulation.faults.range_bias_m) == ((1.0, 0.0, 0.0), 0.25)
    assert (simulation.faults.dead_from_s, simulation.faults.blind_to_rad) == (9.0, np.pi / 2)
    (lidar,) = setup.lidars
    assert (lidar.name, lidar.sigma_m, lidar.dropout) == ("nose", 0.25, 0.5)
    assert lidar.standing.trust == 0.75


def test_one_name_in_two_tables_is_refused_where_it_is_written() -> None:
    @dataclass
    class Target:
        depth_m: float

    class Some(Section):
        depth_m: float = 1.0

    assert values_for(Target, Some()) == {"depth_m": 1.0}
    with pytest.raises(TypeError, match="depth_m"):
        values_for(Target, Some(), Some())
