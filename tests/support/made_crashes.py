"""Crashes with one injected fault each, flown by a pilot that knows nothing of `clearway why`.

The pilot is a plane's of one metre a second: it remembers what its scans showed, or flies by its
map, and takes the course nearest to its goal that keeps clear. A crash counts only if the flight
without the fault touches nothing, so that the fault is its cause.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from clearway.base.state import State
from clearway.io.toml import parse_model
from clearway.live.mission import Mode
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, prepare
from clearway.sensors import Scan
from clearway.sim import Run, simulate

KEEP_M, LOOKED_M, TURN_RAD, MOST_TURNS = 0.95, 9.0, np.radians(15.0), 9
GOAL_M = (60.0, 0.0, 0.0)
TALL_M = 30.0
BODY_M = 0.3
CAUSES = (
    "unseen",
    "seen late",
    "sensor dead",
    "wrong map",
    "undeclared wind",
    "late decision",
    "no escape",
)


@dataclass(frozen=True)
class Fault:
    """What is wrong; the defaults are nothing."""

    blind_rad: float = 0.0
    """Half width of a sector ahead that returns nothing."""
    farthest_m: float = np.inf
    """Beyond which the sensor returns nothing, whatever it promises."""
    dead_s: float = np.inf
    """From when no scan comes."""
    frozen_s: tuple[float, float] = (np.inf, np.inf)
    """Between which the pilot takes no new course."""
    wind_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Case:
    """One flight to be made: with its fault, and without."""

    cause: str
    boxes: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...]
    """Place and size of what is really there."""
    fault: Fault = Fault()
    charted: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...] = ()
    """Of what the map shows."""
    sound_boxes: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...] | None = None
    """What is there without the fault, where the fault is of the place."""
    by_map: bool = False
    commits: int = 1
    """Movements of a course that are flown before the next is taken."""


@dataclass
class FaultySensor:
    """A sensor whose returns the fault takes away; keeps what is left."""

    sensor: Any
    fault: Fault
    kept: list[Scan] = field(default_factory=list)

    @property
    def name(self) -> str:
        return str(self.sensor.name)

    def scan(self, world: Any, state: State, rng: np.random.Generator) -> Scan:
        from clearway.sensors import simulate_scan

        scan = simulate_scan(self.sensor, world, state, rng)
        points = scan.points_m
        azimuth = np.arctan2(points[:, 1], points[:, 0])
        shown = np.linalg.norm(points, axis=1) <= self.fault.farthest_m
        if self.fault.blind_rad:
            shown &= np.abs(azimuth) > self.fault.blind_rad
        scan = replace(scan, points_m=points[shown])
        if scan.time_s < self.fault.dead_s:
            self.kept.append(scan)
        return scan


@dataclass(frozen=True)
class Chosen:
    """A decision of the pilot."""

    time_s: float
    movements: tuple[str, ...]
    state: State
    mode: Mode = Mode.NAVIGATION
    goal: int = 0
    explanation: str = "the clearest course nearest to the goal"
    counts: Mapping[str, int] = field(default_factory=dict)


class CoursePilot:
    """Takes turns and then a straight course that keep clear of what it knows."""

    def __init__(self, setup: FlightSetup, case: Case, fault: Fault) -> None:
        self.planner, self.mission = setup.planner, setup.mission
        self.counts: dict[str, int] = {}
        self._case, self._fault = case, fault
        self._map, self._seen = setup.obstacle_map, np.zeros((0, 3))
        self._state = setup.mission.start
        self._chosen: Chosen | None = None

    def update(self, reading: Any) -> None:
        if isinstance(reading, State):
            self._state = reading
        elif isinstance(reading, Scan) and reading.time_s < self._fault.dead_s:
            level = reading.points_m @ self._state.world_from_body.T + self._state.position_m
            self._seen = np.concatenate([self._seen, level[::3]])[-20_000:]

    def due(self, now_s: float) -> str | None:
        chosen = self._chosen
        over = chosen is None or now_s >= chosen.time_s + len(chosen.movements) - 1e-6
        return "the course is flown" if over else None

    def decide(self, now_s: float) -> Chosen:
        begin, end = self._fault.frozen_s
        names = ("Straight",) if begin <= now_s < end else self._course()[: self._case.commits]
        self._chosen = Chosen(now_s, names, self._state)
        return self._chosen

    def movement_at(self, time_s: float) -> Any:
        if self._chosen is None:
            return None
        number = int(time_s - self._chosen.time_s + 1e-6)
        if not 0 <= number < len(self._chosen.movements):
            return None
        return self.planner.automaton.chain(self._chosen.movements[number : number + 1])[0]

    def _course(self) -> tuple[str, ...]:
        place, yaw = self._state.position_m, float(self._state.attitude_rad[2])
        away = np.asarray(GOAL_M) - place
        wanted = np.arctan2(away[1], away[0])
        courses = []
        for turns in range(-MOST_TURNS, MOST_TURNS + 1):
            off = yaw + turns * TURN_RAD - wanted
            detour = abs(np.arctan2(np.sin(off), np.cos(off)))
            courses.append((detour, turns, self._clearance(place, yaw, turns)))
        clear = [one for one in courses if one[2] >= KEEP_M]
        _, turns, _ = min(clear) if clear else max(courses, key=lambda one: one[2])
        name = "Left" if turns > 0 else "Right"
        return (name,) * abs(turns) + ("Straight",) * 8

    def _clearance(self, place: Any, yaw: float, turns: int) -> float:
        at, heading, way = place[:2].copy(), yaw, []
        for number in range(int(LOOKED_M / 0.25) + abs(turns) * 4):
            if number < abs(turns) * 4:
                heading += np.sign(turns) * TURN_RAD / 4.0
            at = at + 0.25 * np.array([np.cos(heading), np.sin(heading)])
            way.append(at)
        points = np.column_stack([np.array(way), np.full(len(way), place[2])])
        if self._case.by_map:
            return float(self._map.distance_m(points).min())
        from scipy.spatial import cKDTree

        near = self._seen[np.abs(self._seen[:, 2] - place[2]) < 2.0]
        return float(cKDTree(near).query(points)[0].min()) if len(near) else np.inf


@dataclass(frozen=True)
class MadeCrash:
    """A crash, and its true cause."""

    cause: str
    file: MissionFile
    """What the vehicle declares: it knows of no fault."""
    setup: FlightSetup
    run: Run[Any]
    scans: tuple[Scan, ...]


def make_crash(cause: str, seed: int) -> MadeCrash:
    """The first crash of a cause from a seed on that the flight without its fault does not have."""
    for number in range(30):
        rng = np.random.default_rng([seed, number, CAUSES.index(cause)])
        case = CASES[cause](rng)
        made = _flown(case, case.fault, case.boxes, int(rng.integers(1000)))
        if not made.run.touched or not _blown_into(case, made.run):
            continue
        boxes = case.boxes if case.sound_boxes is None else case.sound_boxes
        charted = case.boxes if case.by_map else case.charted
        sound = _flown(replace(case, charted=charted), Fault(), boxes, 0)
        if not sound.run.touched:
            return made
    raise AssertionError(f"no crash by {cause} from seed {seed}")


def make_sound(cause: str, seed: int) -> MadeCrash:
    """A flight past what crashes of a cause hit, without the fault."""
    case = CASES[cause](np.random.default_rng(seed))
    return _flown(case, Fault(), case.boxes, seed)


def _blown_into(case: Case, run: Run[Any]) -> bool:
    """Whether a wind, where there is one, blows towards what was hit."""
    wind = np.asarray(case.fault.wind_mps)
    towards = np.asarray(case.boxes[0][0]) - run.states[-1, :3]
    return not wind.any() or float(wind[1] * towards[1]) > 0.0


def _flown(case: Case, fault: Fault, boxes: Any, seed: int) -> MadeCrash:
    file = _mission(case, boxes, fault, seed)
    setup = prepare(file)
    sensor = FaultySensor(setup.sensors[0], fault)
    pilot = CoursePilot(setup, case, fault)
    run = simulate(pilot, setup.world, lidars=[sensor], settings=setup.simulation)
    return MadeCrash(case.cause, file, setup, replace(run, planner="made"), tuple(sensor.kept))


def _mission(case: Case, boxes: Any, fault: Fault, seed: int) -> MissionFile:
    shapes = [
        {"shape": "cuboid", "position_m": list(place), "size_m": list(size), "known": known}
        for known, those in (("world", boxes), ("map", case.charted))
        for place, size in those
    ]
    return parse_model(
        "made",
        {
            "mission": {"name": "made", "waypoints_m": [list(GOAL_M)], "reach_radius_m": 2.0},
            "vehicle": {"speed_mps": 1.0, "body_radius_m": BODY_M},
            "grid": {
                "range_m": 10, "layers": 10, "azimuth_deg": 45, "columns": 7,
                "elevation_deg": 30, "rows": 5,
            },
            "safety": {"margin_m": 0.6},
            "lidar": [{"name": "front", "beams_per_cell": [12, 6], "sigma_m": 0.02}],
            "simulation": {
                "seed": seed, "time_limit_s": 45.0, "scan_rate_hz": 4.0,
                "wind_mps": list(fault.wind_mps),
            },
            "obstacle": shapes,
        },
        MissionFile,
    )  # fmt: skip


def _pillar(x: float, y: float, wide: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return (x, y, 0.0), (wide, wide, TALL_M)


def _ahead(rng: np.random.Generator, wide: float) -> tuple[Any, ...]:
    """A pillar in the way, and others beside it that keep the sensor busy."""
    x = float(rng.uniform(16.0, 26.0))
    beside = [
        _pillar(x - float(rng.uniform(4.0, 11.0)), side * float(rng.uniform(3.5, 5.5)), 1.0)
        for side in (-1.0, 1.0)
    ]
    return (_pillar(x, float(rng.uniform(-0.25, 0.25)), wide), *beside)


def _unseen(rng: np.random.Generator) -> Case:
    blind = float(np.radians(rng.uniform(24.0, 32.0)))
    return Case("unseen", _ahead(rng, float(rng.uniform(0.8, 1.1))), Fault(blind_rad=blind))


def _seen_late(rng: np.random.Generator) -> Case:
    wide = float(rng.uniform(3.0, 5.0))
    fault = Fault(farthest_m=float(rng.uniform(2.0, 3.0)))
    return Case("seen late", _ahead(rng, wide), fault)


def _sensor_dead(rng: np.random.Generator) -> Case:
    boxes = _ahead(rng, float(rng.uniform(1.0, 2.5)))
    sees_s = boxes[0][0][0] - 10.0
    return Case("sensor dead", boxes, Fault(dead_s=sees_s - float(rng.uniform(0.5, 4.0))))


def _wrong_map(rng: np.random.Generator) -> Case:
    boxes = _ahead(rng, float(rng.uniform(1.5, 2.5)))
    side = float(rng.choice([-1.0, 1.0]) * rng.uniform(2.6, 3.4))
    charted = tuple(((x, y + side, z), size) for (x, y, z), size in boxes)
    return Case("wrong map", boxes, charted=charted, by_map=True)


def _wind(rng: np.random.Generator) -> Case:
    side = float(rng.choice([-1.0, 1.0]))
    x = float(rng.uniform(16.0, 24.0))
    wide = float(rng.uniform(2.0, 3.0))
    boxes = (
        _pillar(x, side * (0.5 * wide + float(rng.uniform(1.1, 1.5))), wide),
        _pillar(x - 6.0, -side * 5.5, 1.0),
    )
    wind = (0.0, side * float(rng.uniform(0.15, 0.25)), 0.0)
    return Case("undeclared wind", boxes, Fault(wind_mps=wind), commits=8)


def _late(rng: np.random.Generator) -> Case:
    boxes = _ahead(rng, float(rng.uniform(2.5, 4.0)))
    reached_s = boxes[0][0][0] - 0.5 * boxes[0][1][0]
    until = reached_s - float(rng.uniform(0.5, 1.5))
    return Case("late decision", boxes, Fault(frozen_s=(reached_s - 14.0, until)))


def _no_escape(rng: np.random.Generator) -> Case:
    half = float(rng.uniform(1.8, 2.4))
    long = float(rng.uniform(28.0, 34.0))
    walls = tuple(
        ((0.5 * long - 3.0, side * (half + 0.25), 0.0), (long + 6.0, 0.5, 7.0))
        for side in (-1.0, 1.0)
    )
    lids = tuple(
        ((0.5 * long - 3.0, 0.0, side * 2.2), (long + 6.0, 2.0 * half + 1.0, 0.4))
        for side in (-1.0, 1.0)
    )
    end = ((long, 0.0, 0.0), (0.5, 2.0 * half + 1.0, 7.0))
    return Case("no escape", (*walls, *lids, end), sound_boxes=(*walls, *lids))


CASES = {
    "unseen": _unseen,
    "seen late": _seen_late,
    "sensor dead": _sensor_dead,
    "wrong map": _wrong_map,
    "undeclared wind": _wind,
    "late decision": _late,
    "no escape": _no_escape,
}
