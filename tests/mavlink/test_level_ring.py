"""What is promised with an autopilot's level distances, tilted and wherever it is handed over."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.frames import world_from_body
from clearway.base.state import State
from clearway.mavlink.distances import Sectors, make_sector_scan, sector_lidar
from clearway.mavlink.setup import sensor_of
from clearway.mavlink.simulated_habits import Habits
from clearway.missions.setup import FlightSetup
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld
from clearway.sensors.observed.free_space import FreeSpace
from clearway.sensors.observed.seen_space import is_free
from clearway.sensors.range_sensor import LidarSensor
from companion_missions import CALM, mission
from mavlink_for_tests import distances
from simulated_flight import SimulatedFlight

BODY_M = 0.3


def setup_with(span_m: list[float] | None, waypoint_m: list[float]) -> tuple[Any, FlightSetup]:
    declared = {} if span_m is None else {"obstacles_span_m": span_m}
    return mission(
        mission={"name": "posts", "waypoints_m": [waypoint_m], "reach_radius_m": 1.5},
        vehicle={"kind": "inertialess", "position_m": [0, 0, 7], "speed_mps": 1.0,
                 "pitch_limit_deg": 0},
        grid={**CALM["grid"], "range_m": 10},
        safety={"margin_m": 0.6, **declared},
        lidar=[{"max_range_m": 10}],
    )  # fmt: skip


def flight(
    seed: int, habits: Habits, *, span_m: list[float] | None = None, fan_deg: float = 0.0,
    posts: int = 8, begins_m: tuple[float, float, float] = (0.0, 0.0, 7.0),
) -> SimulatedFlight:  # fmt: skip
    rng = np.random.default_rng(seed)
    file, setup = setup_with(span_m, [begins_m[0] + 16.0, begins_m[1], 7.0])
    found: list[Obstacle] = []
    while len(found) < posts:
        x, y, radius = rng.uniform([2.0, -5.0, 0.1], [15.0, 5.0, 0.6])
        if min(math.hypot(x, y), math.hypot(x - 16.0, y)) > 2.5:
            east, north = begins_m[0] + x, begins_m[1] + y
            ends = (east, north, -40.0), (east, north, 60.0)
            found.append(Obstacle.line_between(*ends, radius_m=radius))
    setup = replace(setup, world=CombinedWorld([ObstacleMap(found)]))
    flown = SimulatedFlight(file, setup, habits, fan_deg=fan_deg)
    flown.autopilot.truth = replace(flown.autopilot.truth, position_m=np.array(begins_m))
    return flown


def certain_of(flown: SimulatedFlight) -> list[bool]:
    """Of each decision, whether it holds an escape through space seen to be free."""
    ways = [o.flight.decision.way_out for o in flown.outcomes if o.flight is not None]
    return [way is not None and way.certain for way in ways]


@pytest.mark.parametrize(("seed", "tilt_deg"), [
    (0, 0.0), (4, 12.0),
    *(pytest.param(seed, 5.0 * (seed % 5), marks=pytest.mark.nightly) for seed in range(10, 40)),
])  # fmt: skip
def test_past_posts_every_decision_keeps_an_escape_tilted_or_not(
    seed: int, tilt_deg: float
) -> None:
    habits = Habits(acceleration_mps2=3.0, tilt_deg=tilt_deg)
    flown = flight(seed, habits, span_m=[0.0, 20.0])
    assert flown.session.core.system.escape.flown == "strict"
    flown.run(120.0)
    certain = certain_of(flown)
    assert all(certain[certain.index(True) :])
    assert certain.index(True) <= 1
    assert flown.autopilot.nearest_obstacle_m >= BODY_M
    if seed < 10:  # Between many posts some turn to and fro, safely, until their time is up.
        assert abs(flown.autopilot.truth.position_m[0] - 16.0) < 1.5


def test_with_an_opening_it_leaves_wherever_it_is_handed_over() -> None:
    """The mission's start is elsewhere; nobody has looked at what is above and below."""
    flown = flight(0, Habits(acceleration_mps2=3.0, tilt_deg=12.0), fan_deg=45.0, posts=0,
                   begins_m=(37.3, -12.9, 11.2))  # fmt: skip
    assert flown.session.core.system.escape.flown == "strict"
    flown.run(12.0)
    assert certain_of(flown)[0]
    assert flown.autopilot.truth.position_m[0] > 37.3 + 5.0


# --- one scan -----------------------------------------------------------------------------------


@given(
    about=st.floats(-3.1, 3.1), tilt=st.floats(0.0, 0.5), heading=st.floats(-3.1, 3.1),
    course=st.floats(-3.1, 3.1), bearing=st.floats(-3.1, 3.1), away_m=st.floats(1.5, 9.0),
    radius_m=st.floats(0.3, 1.0), fan_deg=st.sampled_from([0.0, 30.0]),
)  # fmt: skip
def test_no_column_stands_in_what_a_tilted_ring_shows(
    about: float, tilt: float, heading: float, course: float, bearing: float, away_m: float,
    radius_m: float, fan_deg: float,
) -> None:  # fmt: skip
    """Distances are measured in the body's true plane, and told by bearing in the body."""
    lean = world_from_body([0.0, 0.0, about]) @ world_from_body([0.0, tilt, 0.0])
    body = lean @ world_from_body([0.0, 0.0, heading - about])
    place = (away_m + radius_m) * np.array([math.cos(bearing), math.sin(bearing)])
    told = {}
    for sector in range(72):
        nearest = math.inf
        for clockwise in np.radians(5.0 * sector + np.linspace(-2.5, 2.5, 11)):
            for up in np.radians(np.linspace(-fan_deg, fan_deg, 9 if fan_deg else 1)):
                level = math.cos(up)
                beam = body @ [level * math.cos(-clockwise), level * math.sin(-clockwise),
                               math.sin(up)]  # fmt: skip
                a, b = beam[:2] @ beam[:2], beam[:2] @ place
                root = b * b - a * (place @ place - radius_m**2)
                if root >= 0.0 and b > 0.0:
                    nearest = min(nearest, (b - math.sqrt(root)) / a)
        if nearest <= 10.0:
            told[sector] = math.floor(100.0 * nearest)
    sectors = Sectors.of(distances(1.0, told), Counter())
    assert sectors is not None
    lidar, state = (
        sector_lidar(10.0, math.radians(fan_deg)),
        State(np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, course])),
    )
    nose = body[:, 0]
    yaw = math.atan2(nose[1], nose[0])
    scan = make_sector_scan(sectors, lidar, state, yaw, Counter(), tilt)
    free = FreeSpace(0.25, state.position_m, reach_m=10.0, span_m=(0.0, 12.0))
    free.take(LidarSensor(lidar), replace(scan, blind_m=0.0), state)
    seen = free.seen
    ticks = np.arange(-radius_m, radius_m, 0.125)
    for x in ticks:
        for y in ticks:
            east, north = place[0] + x, place[1] + y
            if math.hypot(x, y) < radius_m:
                assert not is_free(seen, east, north, 5.0, 0.0)


def test_an_opening_shows_less_the_more_the_vehicle_tilts() -> None:
    lidar, state = sector_lidar(10.0, math.radians(30.0)), State(np.zeros(3))
    sectors = Sectors.of(distances(1.0, {}), Counter())
    assert sectors is not None
    heights_m = []
    for tilt_deg in (0.0, 15.0, 20.0, 25.0, 30.0):
        scan = make_sector_scan(sectors, lidar, state, 0.0, Counter(), math.radians(tilt_deg))
        free = FreeSpace(0.25, state.position_m, reach_m=10.0)
        free.take(LidarSensor(lidar), replace(scan, blind_m=0.0), state)
        seen, up_m = free.seen, np.arange(0.125, 3.0, 0.25)
        heights_m.append(sum(is_free(seen, 6.1, 0.1, z, 0.0) for z in up_m) * 0.25)
    assert heights_m == sorted(heights_m, reverse=True)
    assert heights_m[0] == heights_m[1] > 1.0  # So much is taken from the opening for good.
    assert heights_m[1] > heights_m[2] > heights_m[3]
    assert heights_m[-1] == 0.0


def test_nothing_is_cleared_through_what_the_sensor_does_not_measure() -> None:
    """Only where that is farther than the body reaches: where the vehicle is, nothing stands."""
    for near_cm, seen in ((20, True), (80, False)):
        flown = flight(0, Habits(), span_m=[0.0, 20.0], posts=0)
        core = flown.session.core
        message = distances(flown.autopilot.boot_ms * 1e-3, {})
        message.min_distance = near_cm
        flown.autopilot.tell()
        for arrival in flown.inbox.take(flown.wire.told):
            if arrival.message.get_type() != "OBSTACLE_DISTANCE":
                flown.session.take(arrival, flown.wall_s)
        core.system.begin_at(np.array([50.0, 50.0, 7.0]))  # Nothing is declared here.
        core._is_begun = True
        flown.session._surroundings.take_circle(message, flown.wall_s)
        flown.session.tick(flown.wall_s)
        space = core.system._known.sensing.free_space
        assert space is not None
        assert is_free(space.seen, 5.0, 0.1, 7.0, 0.0) is seen


# --- before it flies ----------------------------------------------------------------------------


@pytest.mark.parametrize(("span_m", "fan_deg", "flown"), [
    (None, 0.0, "known"), ([0.0, 20.0], 0.0, "strict"), (None, 15.0, "known"),
    (None, 30.0, "strict"),
])  # fmt: skip
def test_what_level_distances_promise(
    span_m: list[float] | None, fan_deg: float, flown: str
) -> None:
    file, setup = setup_with(span_m, [16, 0, 7])
    sensor = sensor_of(file, setup, math.radians(fan_deg))
    assert sensor is not None
    assert replace(setup, sensors=(sensor,)).escape.flown == flown


@pytest.mark.parametrize(("span_m", "fan_deg", "flown"), [
    (None, 0.0, "known"), ([0.0, 20.0], 0.0, "strict"), (None, 30.0, "strict"),
])  # fmt: skip
def test_what_they_promise_a_copter_with_inertia(
    span_m: list[float] | None, fan_deg: float, flown: str
) -> None:
    """The ball about its start lets it leave, and what one plane shows would not let it go on."""
    declared = {} if span_m is None else {"obstacles_span_m": span_m}
    file, setup = mission(
        mission={"name": "copter", "waypoints_m": [[40, 0, 7]], "reach_radius_m": 1.5},
        vehicle={"kind": "multirotor", "position_m": [0, 0, 7], "speed_mps": 3.0},
        grid={},
        safety={"margin_m": 2.0, **declared},
        lidar=[{}],
    )
    sensor = sensor_of(file, setup, math.radians(fan_deg))
    assert sensor is not None
    promised = replace(setup, sensors=(sensor,)).escape
    assert promised.flown == flown
    assert ("the sensor shows one level plane" in promised.why) is (flown == "known")


def test_goals_at_heights_that_are_not_declared_are_told_of() -> None:
    _, setup = setup_with([0.0, 10.0], [16, 0, 12])
    assert "goal 1 at 12 m is not between 0 and 10 m" in " ".join(setup.doubts)
    assert not setup_with([0.0, 10.0], [16, 0, 9])[1].doubts


def test_who_may_pitch_is_told_that_other_heights_are_not_reached() -> None:
    file, setup = mission(
        mission={"name": "up", "waypoints_m": [[16, 0, 12]], "reach_radius_m": 1.5},
        vehicle={"kind": "inertialess", "position_m": [0, 0, 7], "speed_mps": 1.0},
        grid={**CALM["grid"], "range_m": 10},
        safety={"margin_m": 0.6},
        lidar=[{"max_range_m": 10}],
    )
    sensor = sensor_of(file, setup, 0.0)
    assert sensor is not None
    doubts = " ".join(replace(setup, sensors=(sensor,)).doubts)
    assert "vehicle.pitch_limit_deg = 0 flies at one height" in doubts


def led_to(height_m: float, from_m: float, kind: str) -> SimulatedFlight:
    """Handed over at a height, with a ring of level distances and nothing in the way."""
    file, setup = mission(
        mission={"name": "plan", "waypoints_m": [[30, 0, 10], [40, 10, height_m]],
                 "reach_radius_m": 4.5},
        vehicle={"position_m": [0, 0, 10], "speed_mps": 3.0, "kind": kind},
        grid={},
        safety={"margin_m": 2.0},
        lidar=[{}],
    )  # fmt: skip
    flown = SimulatedFlight(file, setup)
    flown.autopilot.truth = replace(flown.autopilot.truth, position_m=np.array([0.0, 0.0, from_m]))
    return flown


@pytest.mark.parametrize("kind", ["inertialess", "plane"])
@pytest.mark.parametrize(("height_m", "from_m", "said"), [
    (20.0, 10.0, "goal 2 at 20.0 m is 10.0 m above the vehicle"),
    (10.0, 25.0, "goal 1 at 10.0 m is 15.0 m below the vehicle"),
])  # fmt: skip
def test_goals_that_one_level_plane_never_leads_to_are_refused(
    kind: str, height_m: float, from_m: float, said: str
) -> None:
    """It circled below or above them for ever, and nobody was told why."""
    flown = led_to(height_m, from_m, kind)
    flown.run(3.0)
    assert flown.states[-1] == "refused"
    why = flown.outcomes[-1].why_state
    assert why.startswith(said)
    assert "vehicle.pitch_limit_deg = 0" in why
    assert all(outcome.set_point is None for outcome in flown.outcomes)
    assert any("refused: goal" in text for text in flown.autopilot.texts)


@pytest.mark.parametrize(("height_m", "from_m", "kind"), [
    (13.0, 10.0, "inertialess"), (20.0, 10.0, "multirotor"), (10.0, 25.0, "multirotor"),
])  # fmt: skip
def test_goals_that_are_reached_are_not(height_m: float, from_m: float, kind: str) -> None:
    flown = led_to(height_m, from_m, kind)
    flown.run(60.0)
    assert "refused" not in flown.states
    assert flown.autopilot.has_arrived
