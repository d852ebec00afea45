"""Def. 13 and 3.4.2: predictions in bounded noise, and Lyapunov's function on the way to a goal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim import SimulationSettings, simulate
from clearway.studies.reproduction.flights import flight_of
from clearway.studies.reproduction.target import Exhibit, Findings, Measure
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.prediction import NoiseBounds, deviation_bound_m

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FLIGHTS = 400
STEP_S = 0.02
BUFFER = (
    "Left",
    "Left",
    "Straight",
    "Up-Right",
    "Right",
    "Straight",
    "Down",
    "Left",
    "Right",
    "Up",
)
NOISE = NoiseBounds(
    pitch_rad=float(np.radians(1.0)),
    yaw_rad=float(np.radians(1.0)),
    speed_mps=0.02,
    pitch_rate_rps=float(np.radians(1.0)),
    yaw_rate_rps=float(np.radians(1.0)),
    drift_mps=0.05,
)
"""w, v and drift of (3.20): a degree, a degree a second, 2 % of the speed, and 5 cm/s."""


@dataclass(frozen=True, eq=False)
class Deviations:
    """Flights of one buffer in bounded noise against its prediction."""

    time_s: FloatArray
    """[n]"""
    deviation_m: FloatArray
    """[flights, n]"""
    bound_m: FloatArray
    """[n] by (3.28)."""


def measure_deviations(flights: int = FLIGHTS, seed: int = 0) -> Deviations:
    """Fly the buffer again and again: half in white noise, half with noise held at its bounds."""
    automaton = MovementAutomaton.plane()
    rng = np.random.default_rng(seed)
    held = rng.choice([-1.0, 1.0], (flights, 5))
    heading = rng.normal(size=(flights, 3))
    drift = NOISE.drift_mps * heading / np.linalg.norm(heading, axis=1, keepdims=True)
    true, predicted = np.zeros((flights, 5)), np.zeros((1, 5))
    still, rows = np.zeros((1, 5)), []
    white = np.arange(flights) % 2 == 0
    for name in BUFFER:
        movement = automaton[name]
        for _ in range(round(movement.duration_s / STEP_S)):
            noise = np.where(white[:, None], rng.uniform(-1.0, 1.0, (flights, 5)), held)
            true = _move(true, movement, noise)
            true[:, :3] += STEP_S * drift
            predicted = _move(predicted, movement, still)
            rows.append(np.linalg.norm(true[:, :3] - predicted[:, :3], axis=1))
    time_s = STEP_S * np.arange(1, len(rows) + 1, dtype=np.float64)
    speed = automaton.movements[0].speed_mps
    return Deviations(
        time_s, np.array(rows, dtype=np.float64).T, deviation_bound_m(NOISE, speed, time_s)
    )


def _move(state: FloatArray, movement: Movement, noise: FloatArray) -> FloatArray:
    """States [n, 5] x, y, z, pitch, yaw of (3.20) a step later; noise [n, 5] in [-1, 1]."""
    pitch_rate = movement.pitch_rate_rps + NOISE.pitch_rate_rps * noise[:, 0]
    yaw_rate = movement.yaw_rate_rps + NOISE.yaw_rate_rps * noise[:, 1]
    speed = movement.speed_mps + NOISE.speed_mps * noise[:, 2]
    pitch = state[:, 3] + 0.5 * STEP_S * pitch_rate + NOISE.pitch_rad * noise[:, 3]
    yaw = state[:, 4] + 0.5 * STEP_S * yaw_rate + NOISE.yaw_rad * noise[:, 4]
    rates = (
        speed * np.cos(pitch) * np.cos(yaw),
        speed * np.cos(pitch) * np.sin(yaw),
        -speed * np.sin(pitch),
        pitch_rate,
        yaw_rate,
    )
    moved: FloatArray = state + STEP_S * np.stack(rates, axis=1)
    return moved


def prediction_ball() -> tuple[Exhibit, ...]:
    """Def. 13, measured."""
    found = measure_deviations()
    share = found.deviation_m / found.bound_m
    last = found.deviation_m[:, -1]
    return (
        Exhibit(
            "Definition 13",
            "prediction ball in bounded noise",
            Findings(
                claim="With bounded noise a flown buffer stays in a ball around its prediction "
                "whose radius grows by at most rho per second (3.28).",
                ours=f"{len(found.deviation_m)} flights of a buffer of {len(BUFFER)} movements: "
                f"after {found.time_s[-1]:g} s they are {np.median(last):.2f} m off in the middle "
                f"and {last.max():.2f} m at most, within the bound of {found.bound_m[-1]:.2f} m; "
                f"at any time at most {share.max():.0%} of it.",
                difference="rho is not the constant of (3.27): noise of turn rates adds up in the "
                "attitude, so that deviation grows with the square of time, and rho holds for the "
                "horizon that it was taken for. (3.22) would need g to be linear.",
                measures=(
                    Measure(
                        "flights outside the ball", int((share > 1.0).any(axis=1).sum()), 0, "paper"
                    ),
                    Measure("bound after 10 s, m", float(found.bound_m[-1])),
                    Measure("largest deviation after 10 s, m", float(last.max())),
                    Measure("largest share of the bound at any time", float(share.max())),
                ),
            ),
            partial(_draw_ball, found),
        ),
    )


def _draw_ball(found: Deviations) -> Figure:
    from clearway.studies.figures.stability import draw_deviations

    return draw_deviations(
        found.time_s,
        found.deviation_m,
        found.bound_m,
        f"Definition 13: {len(found.deviation_m)} flights of one buffer in bounded noise",
    )


@dataclass(frozen=True, eq=False)
class LyapunovFlight:
    """A flight to one waypoint, and Lyapunov's function (3.30) of it."""

    time_s: FloatArray
    track_m: FloatArray
    """[n, 3]"""
    world: ObstacleMap
    goal_m: FloatArray
    reached: bool
    nearest_surface_m: float

    @property
    def lyapunov_m2(self) -> FloatArray:
        """[n] V = |y|^2 / 2 of the position, y as in (3.29)."""
        squared: FloatArray = 0.5 * np.sum((self.track_m - self.goal_m) ** 2, axis=1)
        return squared

    @property
    def rising_s(self) -> float:
        """How long V rises, its derivative (3.31) being positive."""
        return float(np.diff(self.time_s)[np.diff(self.lyapunov_m2) > 1e-9].sum())


GOAL_M = (30.0, 0.0, 0.0)
WALL = Obstacle.cuboid([12.0, 0.0, 0.0], (1.0, 24.0, 40.0), name="wall")
SHELL = Obstacle.ball(GOAL_M, 4.0, name="round the waypoint")
CASES = (
    ("converging", "nothing in the way", (), 60.0),
    ("wall", "an enormous obstacle in the way", (WALL,), 120.0),
    ("enclosed", "a waypoint that cannot be reached", (SHELL,), 120.0),
)
"""Name, title, obstacles, and how long it may take."""


def approach(obstacles: tuple[Obstacle, ...], time_limit_s: float) -> LyapunovFlight:
    """Fly to the waypoint with sensors and settings of 6.4."""
    setup = flight_of("static-obstacles").setup
    world = ObstacleMap(obstacles)
    mission = Mission(
        "waypoint", State(np.zeros(3)), waypoints_m=np.array([GOAL_M]), reach_radius_m=1.5
    )
    system = AvoidanceSystem(setup.planner, mission, lidars=setup.lidars)
    settings = SimulationSettings(time_limit_s=time_limit_s)
    run = simulate(system, world, lidars=setup.lidars, settings=settings)
    return LyapunovFlight(
        run.time_s,
        run.states[:, :3],
        world,
        np.array(GOAL_M),
        run.reached,
        run.metrics.min_obstacle_distance_m,
    )


def lyapunov() -> tuple[Exhibit, ...]:
    """3.4.2: one run that converges, and two that an obstacle keeps from it."""
    flown = {name: approach(there, limit) for name, _, there, limit in CASES}
    return tuple(
        Exhibit(
            f"Section 3.4.2 {name}",
            title,
            _words(name, flown[name]),
            partial(_draw_approach, flown[name], f"Section 3.4.2: {title}"),
        )
        for name, title, _, _ in CASES
    )


CLAIMS = {
    "converging": "Without an obstacle V falls all the way, and the vehicle converges to the "
    "waypoint exponentially fast.",
    "wall": "V may rise while an enormous obstacle is avoided.",
    "enclosed": "Whether the waypoint is reached depends on the obstacles: it must be in the reach "
    "set.",
}


def _words(name: str, flown: LyapunovFlight) -> Findings:
    value = flown.lyapunov_m2
    end = f"reached after {flown.time_s[-1]:.1f} s" if flown.reached else "never reached"
    expected = {"converging": 0.0}.get(name)
    return Findings(
        claim=CLAIMS[name],
        ours=f"The waypoint is {end}; V rises for {flown.rising_s:.1f} of {flown.time_s[-1]:.1f} s "
        f"and comes down to {value.min():.2f} m^2 from {value[0]:.0f} m^2.",
        difference="It falls with constant speed, and so V with the square of the time left: not "
        "exponentially, but in finite time; and it ends at the reach radius, not at 0."
        if name == "converging"
        else "",
        measures=(
            Measure("waypoint reached", float(flown.reached), float(name != "enclosed"), "paper"),
            Measure("time during which V rises, s", flown.rising_s, expected, "paper"),
            Measure("least V, m^2", float(value.min())),
        )
        + (
            ()
            if name == "converging"
            else (Measure("smallest distance to the obstacle, m", flown.nearest_surface_m),)
        ),
    )


def _draw_approach(flown: LyapunovFlight, title: str) -> Figure:
    from clearway.studies.figures.stability import draw_approach

    return draw_approach(
        flown.time_s, flown.track_m, flown.lyapunov_m2, flown.world, flown.goal_m, title
    )
