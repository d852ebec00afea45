"""Plants: whatever truly moves, by name or one's own, in air that moves; and what they must do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError, OwnCodeError
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_sections import OF_MOVEMENTS
from clearway.missions.setup import prepare
from clearway.sim.plants import PLANTS, Air
from clearway.sim.plants.air import GustScales
from clearway.sim.plants.movements import quadrotor_movements
from clearway.sim.plants.quadrotor import ROTOR_SIDES, Airframe, derivative, step_quadrotor
from clearway.vehicle.automaton import MovementAutomaton
from repository import REPOSITORY

# Made by rotorpy 3.0.0, its Hummingbird: velocity, quaternion, rates; rotor speeds; wind; and what
# its forces and moments make of them, accelerations of the place (world) and of the rates.
ROTORPY = (
    ([1.382337, 3.286473, 1.321748, -0.751695, 0.522233, 0.25748, -0.309729, 1.162236, 0.729145,
      0.588265], [773.057, 481.917, 572.099, 380.425], [0.085267, 1.640139, -2.209362],
     [-10.85997, 7.983685, -7.216786, 30.013847, -62.382831, 12.372744]),
    ([-1.169827, -3.127634, -1.028769, 0.004897, -0.16577, 0.778354, 0.605525, -5.422325, -3.778026,
      -0.349544], [369.519, 674.094, 766.01, 667.802], [-1.266571, 0.640929, 0.651966],
     [-3.950773, 21.37959, -14.120296, -81.88095, 100.830497, -5.989244]),
    ([2.586812, 2.652253, -2.056025, -0.798263, 0.081113, 0.052802, -0.594481, -1.366453, -0.144087,
      -1.889503], [388.753, 791.776, 709.972, 772.258], [-0.29481, 0.286449, 0.106759],
     [-6.058691, -0.064018, 14.073353, -73.02546, 67.314098, -11.695388]),
    ([-3.272921, 2.926609, -2.00576, 0.529355, -0.645338, 0.550614, -0.01208, -2.497498, -0.627799,
      0.108205], [469.127, 429.131, 683.599, 783.033], [0.818374, -2.946564, -3.322119],
     [13.038858, 7.951448, -18.309857, 37.973433, 120.33096, -0.75741]),
)  # fmt: skip


@pytest.mark.parametrize(("moving", "rotors", "wind", "expected"), ROTORPY)
def test_forces_and_moments_of_the_quadrotor_are_those_of_rotorpy(moving, rotors, wind, expected):
    moving = np.array(moving)
    moving[3:7] /= np.linalg.norm(moving[3:7])
    x = np.concatenate([np.zeros(3), moving])
    found = derivative(x, np.array(rotors), np.array(wind), ROTOR_SIDES, Airframe())
    np.testing.assert_allclose(found[[3, 4, 5, 10, 11, 12]], expected, atol=1e-5)


def test_a_quadrotor_without_drag_falls_and_its_motors_lag_as_closed_forms_say():
    bare = Airframe(k_d=0.0, k_z=0.0, k_h=0.0, drag_kgpm=(0.0, 0.0, 0.0))
    x, rotors, asked = np.zeros(13), np.zeros(4), np.zeros(4)
    x[6] = 1.0
    for _ in range(500):
        x, rotors = step_quadrotor(x, rotors, asked, np.zeros(3), ROTOR_SIDES, bare, 0.002)
    np.testing.assert_allclose(x[:6], [0, 0, -0.5 * 9.81, 0, 0, -9.81], atol=1e-9)
    _, rotors = step_quadrotor(x, rotors, np.full(4, 2000.0), np.zeros(3), ROTOR_SIDES, bare, 0.005)
    np.testing.assert_allclose(rotors, 1500.0 * (1.0 - np.exp(-1.0)))  # No faster than it can.


def flown(name: str, names: list[str], wind=(0.0, 0.0, 0.0), gusts: float = 0.0, seed: int = 0):
    """The plant after movements from a trimmed start, and the automaton that it flew."""
    kind = PLANTS.find(name)
    assert kind.movements is not None
    automaton = kind.movements()
    start = np.array([10.0, -20.0, 5.0, 0.0, 0.0, 0.7])
    plant = kind.make(start, automaton.start_mps, Air(wind, gusts, seed))
    np.testing.assert_allclose(plant.state[:3], start[:3], atol=0.2)
    assert abs(plant.state[5] - 0.7) < 0.05
    for movement in automaton.chain(names):
        plant.begin(movement)
        for _ in range(round(movement.duration_s * 20)):
            plant.step(0.05)
    return plant, automaton


def test_the_quadrotor_holds_its_movements_also_in_wind():
    calm, automaton = flown("quadrotor", ["Straight"] * 3)
    before = calm.state
    calm.begin(automaton["Left"])
    for _ in range(30):
        calm.step(0.05)
    asked = automaton.predict(before * [1, 1, 1, 0, 0, 1], automaton["Left"])
    assert np.linalg.norm(calm.state[:3] - asked[:3]) < 0.6
    assert abs(calm.state[5] - asked[5]) < 0.15
    blown, _ = flown("quadrotor", ["Straight"] * 3, wind=(-2.0, 2.0, 0.0))
    assert np.linalg.norm(blown.state[:3] - before[:3]) < 1.0  # Loops hold the way over ground.
    speed = np.hypot(blown.outputs["velocity_x_mps"], blown.outputs["velocity_y_mps"])
    assert speed == pytest.approx(5.0, abs=0.5)


def test_the_same_seed_flies_the_same_and_another_does_not():
    places = [flown("quadrotor", ["Straight"], gusts=1.0, seed=seed)[0].state for seed in (1, 1, 2)]
    assert places[0].tolist() == places[1].tolist() != places[2].tolist()


@pytest.mark.parametrize("name", ["c172x", "F450"])
def test_aircraft_of_jsbsim_hold_their_movements(name: str, capfd: pytest.CaptureFixture[str]):
    pytest.importorskip("jsbsim")
    plant, automaton = flown(name, ["Straight", "Straight", "Left", "Left"])
    flew = plant.state
    way = automaton.rollout([10.0, -20.0, 5.0, 0.0, 0.0, 0.7], ["Straight"] * 2 + ["Left"] * 2)
    turned = way.states[-1, 5] - 0.7
    assert 0.5 * turned < flew[5] - 0.7 < 1.2 * turned
    assert abs(flew[2] - 5.0) < 3.0
    length = np.linalg.norm(way.states[-1, :3] - way.states[0, :3])
    assert np.linalg.norm(flew[:3] - way.states[-1, :3]) < 0.5 * length
    assert capfd.readouterr() == ("", "")  # JSON alone goes to standard output.


@pytest.mark.parametrize("wind", [(-25.8, 9.4, 0.0), (20.0, -18.7, 0.0)])
def test_an_aeroplane_begins_trimmed_in_wind_of_half_its_speed(wind: tuple[float, float, float]):
    """The air carries it, and nothing else: it was 26 m off after its first movement."""
    pytest.importorskip("jsbsim")
    plant, automaton = flown("c172x", ["Straight"], wind=wind)
    asked = automaton.predict([10.0, -20.0, 5.0, 0.0, 0.0, 0.7], automaton["Straight"])
    carried_m = np.array(wind) * automaton["Straight"].duration_s
    assert np.linalg.norm(plant.state[:3] - asked[:3] - carried_m) < 5.0


# --- air ----------------------------------------------------------------------------------


def test_scales_of_gusts_are_those_of_the_specification():
    low = GustScales.at(100.0 * 0.3048)
    shear = 0.177 + 0.0823
    assert low.along_m == pytest.approx(100.0 / shear**1.2 * 0.3048)
    assert low.up_m == pytest.approx(100.0 * 0.3048)
    assert low.up_share == pytest.approx(shear**0.4)
    assert GustScales.at(1000.0 * 0.3048).along_m == pytest.approx(304.8)


def test_gusts_have_the_variance_and_the_spectrum_of_dryden():
    sigma, speed, step, height = 2.0, 10.0, 0.05, 50.0
    air = Air((1.0, 0.0, 0.0), sigma, seed=4, ground_m=0.0)
    gusts = np.array([air.step(step, speed, height, 0.0) for _ in range(60_000)]) - [1.0, 0, 0]
    scales = GustScales.at(height)
    expected = sigma * np.array([1.0, 1.0, scales.up_share])
    np.testing.assert_allclose(gusts.std(axis=0), expected, rtol=0.15)
    # Autocorrelations of (1 + i w T)^-1 and of (1 + sqrt 3 i w T) (1 + i w T)^-2.
    lag = 40
    for axis, length in enumerate((scales.along_m, scales.along_m, scales.up_m)):
        lags = lag * step * speed / length
        shape = np.exp(-lags) * (1.0 if axis == 0 else 1.0 - 0.5 * lags)
        now, later = gusts[:-lag, axis], gusts[lag:, axis]
        assert np.corrcoef(now, later)[0, 1] == pytest.approx(shape, abs=0.12)


def test_gusts_do_not_depend_on_the_step_that_they_are_asked_in():
    def spread(step_s: float) -> float:
        airs = [Air(gusts_mps=1.0, seed=seed) for seed in range(300)]
        steps = round(2.0 / step_s)
        ends = [[air.step(step_s, 10.0, 0.0, 0.0) for _ in range(steps)][-1] for air in airs]
        return float(np.std(ends, axis=0)[1])

    assert spread(1.0) == pytest.approx(1.0, abs=0.15)
    assert spread(0.1) == pytest.approx(1.0, abs=0.15)


# --- by name ------------------------------------------------------------------------------


def mission(**vehicle: object) -> MissionFile:
    """A flight of 60 m past a mast, at the scale of a few metres a second."""
    tables = {
        "mission": {"name": "mast", "waypoints_m": [[60.0, 0.0, 0.0]], "reach_radius_m": 3.0},
        "vehicle": vehicle,
        "grid": {"range_m": 40.0},
        "safety": {"margin_m": 1.5},
        "obstacle": [{"shape": "ball", "position_m": [30.0, 0.5, 0.0], "radius_m": 1.0}],
    }
    return parse_model("mast", tables, MissionFile)


def test_a_mission_names_a_plant_and_flies_its_movements():
    setup = prepare(mission(plant="quadrotor"))
    assert setup.plant is not None
    assert setup.planner.automaton.can_stop
    assert setup.planner.speed_mps == 5.0
    assert prepare(mission(plant="quadrotor", speed_mps=4.0)).planner.speed_mps == 4.0
    with pytest.raises(InputError, match="'quadrotor', 'c172x', 'F450' or your own as module:name"):
        mission(plant="brick")


def test_the_effective_mission_flies_the_same_movements_again(tmp_path: Path):
    own = mission(plant="quadrotor", speed_mps=4.0)
    again = parse_model("again", own.effective(), MissionFile)
    assert again.vehicle.to_automaton() == own.vehicle.to_automaton()
    assert "kind" not in again.effective()["vehicle"]
    measured = mission(plant="quadrotor", automaton=str(tmp_path / "one.toml"))
    assert not set(OF_MOVEMENTS) & set(measured.effective()["vehicle"])
    parse_model("again", measured.effective(), MissionFile)
    closed = mission(plant="quadrotor", kind="inertialess", speed_mps=4.0, turn_step_deg=10.0)
    again = parse_model("again", closed.effective(), MissionFile)
    assert again.vehicle.to_automaton() == closed.vehicle.to_automaton()
    with pytest.raises(InputError, match="turn_step_deg: quadrotor flies its own movements"):
        mission(plant="quadrotor", turn_step_deg=10.0)


def blown(state, inputs, duration_s, air_mps):
    """A dot that the air alone carries."""
    del inputs
    return state + np.concatenate([air_mps * duration_s, np.zeros(3)])


@pytest.mark.parametrize(
    ("own", "wrong"),
    [
        (lambda state: state, "must take"),
        (lambda _state, _inputs, _s, _air: np.zeros(3), "no six finite numbers"),
        (lambda _state, _inputs, _s, _air: 1 / 0, "ZeroDivisionError"),
    ],
)
def test_what_a_plant_of_ones_own_does_wrong_is_told(own: Callable[..., object], wrong: str):
    from clearway.sim.plants.plant import own_plant

    def fly() -> None:
        plant = own_plant("plant own", own).make(np.zeros(6), 1.0, Air())
        plant.begin(MovementAutomaton.plane()["Straight"])
        plant.step(0.05)

    with pytest.raises(OwnCodeError, match=wrong):
        fly()


def test_a_plain_function_is_a_plant():
    from clearway.sim.plants.plant import own_plant

    plant = own_plant("plant own", blown).make(np.ones(6), 1.0, Air((1.0, 0.0, 0.0)))
    plant.begin(MovementAutomaton.plane()["Straight"])
    plant.step(0.05)
    assert plant.state.tolist() == [1.05, 1, 1, 1, 1, 1]


def test_a_plain_function_tells_its_movements_as_any_plant_does():
    from clearway.sim.plants.plant import own_plant

    def still(state, _inputs, _duration_s, _air_mps):
        return state

    assert own_plant("plant own", still).movements is None
    still.movements = quadrotor_movements
    assert own_plant("plant own", still).movements is quadrotor_movements


def test_a_vehicle_of_ones_own_is_under_forty_lines_and_flies():
    example = REPOSITORY / "examples" / "own_plant.py"
    lines = [line for line in example.read_text().splitlines() if line.strip()]
    assert len(lines) < 40
    run = prepare(mission(plant=f"{example}:Blimp")).fly()
    assert run.reached
    assert run.crashed_s is None
    assert run.metrics.margin_violations == 0


@pytest.mark.parametrize("bad", [{"gusts_mps": -1.0}, {"wind_mps": (0.0, np.inf, 0.0)}])
def test_air_that_is_none_is_refused(bad: dict[str, object]):
    with pytest.raises(ClearwayError, match=next(iter(bad))):
        Air(**bad)  # type: ignore[arg-type]
