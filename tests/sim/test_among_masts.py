"""What can stop flies verified ways among masts, and does not turn on the spot for freer cells."""

import numpy as np
import pytest

from clearway.avoidance.plan.costs import Prices
from clearway.base.errors import InputError
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from repository import REPOSITORY

LEG_M, SPEED_MPS = 80.0, 5.0


def masts(seed):
    """Round masts 9 m or more from each other's middle, too tall to fly over."""
    rng, places = np.random.default_rng(seed), []
    for place in rng.uniform([14.0, -30.0], [LEG_M - 10.0, 30.0], (800, 2)):
        if all(np.linalg.norm(place - other) >= 9.0 for other in places):
            places.append(place)
    return [
        {"shape": "line", "position_m": [*map(float, place), 0.0], "radius_m": 0.4,
         "orientation_deg": [0.0, 90.0, 0.0], "size_m": [80.0], "known": "world"}
        for place in places
    ]  # fmt: skip


def flown(seed):
    automaton = REPOSITORY / "examples" / "automata" / "quadrotor.toml"
    tables = {
        "mission": {"name": "masts", "waypoints_m": [[LEG_M, 0.0, 0.0]], "reach_radius_m": 6.0},
        "vehicle": {"plant": "quadrotor", "automaton": str(automaton), "body_radius_m": 0.4},
        "grid": {"range_m": 50.0, "layers": 12},
        "safety": {"margin_m": 1.5},
        "simulation": {"seed": seed},
        "lidar": [{"sigma_m": 0.02, "dropout": 0.02}],
        "obstacle": masts(seed),
    }
    return prepare(parse_model("masts", tables, MissionFile)).fly()


@pytest.mark.parametrize("seeds", [3, pytest.param(5, marks=pytest.mark.nightly)])
def test_a_quadrotor_passes_masts_without_looking_about_for_long(seeds):
    runs = [flown(seed) for seed in range(seeds)]
    assert all(run.reached and run.metrics.margin_violations == 0 for run in runs)
    assert np.median([run.metrics.time_s for run in runs]) <= 2.5 * LEG_M / SPEED_MPS


def test_the_price_of_coated_cells_suits_the_vehicle_unless_it_is_given():
    assert Prices().suit_vehicle(can_stop=True).coated == 0.0
    assert Prices().suit_vehicle(can_stop=False).coated == 3.0
    assert Prices(coated=2.0).suit_vehicle(can_stop=True).coated == 2.0
    with pytest.raises(InputError, match="coated"):
        Prices(coated=-1.0)
