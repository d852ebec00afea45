"""What `warm_up` does beside flying missions: studies, plants, reach sets compared, files read and
written."""

from __future__ import annotations

import tempfile
from pathlib import Path

from clearway.base.grid import AvoidanceGrid
from clearway.io.results_folder import ResultsFolder
from clearway.missions.assess import assess
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.reach.comparison import compare
from clearway.reach.estimate import estimate_footprints
from clearway.reach.footprints import FootprintTree
from clearway.sim.baselines import CLEARWAY
from clearway.sim.plants import PLANTS
from clearway.sim.plants.measuring import MeasureSettings, measure
from clearway.sim.plants.movements import quadrotor_movements
from clearway.studies.encounter_model import made_up_model
from clearway.studies.encounters.encounter import EncounterSettings, random_encounter
from clearway.studies.encounters.flights import fly_encounters, is_avoidable
from clearway.studies.risk.settings import RiskSettings
from clearway.studies.risk.study import study
from clearway.studies.samples import write_samples
from clearway.vehicle.automaton import MovementAutomaton
from clearway.view.replay.messages import cells_message, decision_message

FLOWN_S = 4.0
"""Of missions that are long before all is met in them."""
MET_S = 40.0
"""Of missions in which it is soon met."""
SCENE = """\
[vehicle_timing]
model = "reach-set"

[scan.simulate]
obstacles = [0]

[[obstacle]]
shape = "cuboid"
position_m = [6, 1, 0]
size_m = [1, 2, 2]

[[obstacle]]
shape = "ball"
position_m = [8, 1, 0]
radius_m = 1.5

[[intruder]]
position_m = [6, 8, 0]
velocity_mps = [0, -1, 0]
spread_deg = [15, 11.25]
radius_m = 1.0
timed = {timed}
"""
BY_RULES = """\
[mission]
name = "by-rules"
waypoints_m = [[60, 0, 0]]

[[lidar]]
min_range_m = 0.5

[safety]
obstacles_span_m = [-5, 5]

[rules]
floor_m = -2
ceiling_m = 2
right_of_way = true
route_m = 10

[[intruder]]
name = "head-on"
appears_s = 4
position_m = [10, -0.2, 0]
velocity_mps = [-1, 0, 0]
radius_m = 0.6

[[intruder]]
name = "from the right"
appears_s = 24
position_m = [7, -7, 0]
velocity_mps = [0, 0.95, 0]
radius_m = 0.6
"""


def fly_for(file: MissionFile, seconds: float, planner: str = CLEARWAY) -> None:
    """The beginning of a mission."""
    prepare(file.changed("simulation", time_limit_s=seconds)).fly_with(planner)


def fly_by_rules() -> None:
    """Aircraft that have the right of way, between two heights, along a route, and a LiDAR that is
    blind near by."""
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "rules.toml"
        path.write_text(BY_RULES)
        file = read_mission(str(path))
    fly_for(file, MET_S)
    fly_for(file.changed("prices", ahead=2.0).changed("rating", detection="surface"), MET_S)


def fly_round_the_first() -> None:
    """Long enough to hold the way out in hand again, and to follow what moves unreported."""
    fly_for(read_mission("mixed"), MET_S)
    fly_for(read_mission("static-obstacles"), MET_S)


def tell_of_a_flight() -> None:
    """What recordings and pictures ask of decisions, and nobody works out in flight."""
    file = read_mission("mixed").changed("simulation", time_limit_s=FLOWN_S)
    setup = prepare(file)
    for entry in setup.fly().decisions:
        decision_message(entry)
        cells_message(entry.flight.decision, setup.planner.settings)


def measure_a_quadrotor() -> None:
    """Two flights of a plant and its loops."""
    plant = PLANTS.named("quadrotor")
    measure(plant, quadrotor_movements(), MeasureSettings(flights=1, held_out=1))


def compare_reach_sets() -> None:
    """Footprints counted and estimated, on a small grid, those of many states by walks."""
    automaton = MovementAutomaton.plane(speed_mps=1.0)
    grid = AvoidanceGrid.uniform(range_m=5.0, layers=5)
    compare(automaton, grid, branches=2, repetitions=1)
    tree = FootprintTree(automaton, grid)
    estimate_footprints(tree, branches=2, repetitions=1, held_states=1, walks=16)


def fly_encounters_of_each_kind() -> None:
    """Of random encounters, one of each kind; and whether one could be avoided at all."""
    for settings in (
        EncounterSettings(detected_at_m=6.0),
        EncounterSettings(position_noise_m=0.3, velocity_noise_mps=0.1),
        EncounterSettings(deviates=True),
    ):
        fly_encounters(settings, [0])
    is_avoidable(random_encounter(0, EncounterSettings(detected_at_m=6.0)))


def study_risk() -> None:
    """Draws of a model in the stretched world, and at real scale with each kind of airframe."""
    model = made_up_model()
    study(model, [CLEARWAY], range(2))
    for vehicle in ("copter", "wing"):
        study(model, [CLEARWAY], range(2), RiskSettings.real_scale(vehicle))


def read_samples() -> None:
    """Missions and scenes whose world is in files."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "samples"
        write_samples(ResultsFolder.checked(folder, "sample", ""))
        for name in ("map-mission.toml", "survey-mission.toml"):
            if (folder / name).is_file():
                fly_for(read_mission(str(folder / name)), FLOWN_S)
        assess(folder / "my-scene.toml")
        for timed in ("false", "true", '"future"'):
            (folder / "scene.toml").write_text(SCENE.format(timed=timed))
            assess(folder / "scene.toml")
