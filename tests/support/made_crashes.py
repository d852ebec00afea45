"""Crashes drawn from a seed, each with one fault that alone is to blame.

Cause, format, vehicle, speed and place are drawn, in this order, before anything is flown. A crash
counts only if the same flight without its fault touches nothing, and if the geometry proves what
the cause claims (`_proven`). Nothing here knows `clearway why`: neither its code nor its limits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.place_sections import WorldObstacleSection
from clearway.missions.sensor_section import mission_sensors
from clearway.obstacles.obstacle_map import ObstacleMap
from crash_cases import CAUSES, DRAW, NO_FAULT, Case, Shape
from crash_flights import Course, Craft, Fault, Flight, Place, escapes, fly

FORMATS = ("run", "ROS", "ULog", "DataFlash")
PLANES_ONLY = ("undeclared wind", "no escape")
"""A copter that sees a wall in time stops; of its wind no log of poses shows anything."""
PLANE_MPS, COPTER_MPS = (1.0, 3.0, 8.0), (2.0, 4.0, 8.0)
MOST_DRAWS = 200


@dataclass(frozen=True)
class MadeCrash:
    """A crash, and its true cause."""

    cause: str
    form: str
    case: Case
    file: MissionFile
    """What the vehicle declares: it knows of no fault."""
    flight: Flight
    sound: Flight
    """The same without the fault."""
    draws: int
    seed: int

    @property
    def sees_m(self) -> float:
        """How far its sensor promises to see."""
        return sees_m(self.case.craft)


def make_crash(seed: int, cause: str | None = None, form: str | None = None) -> MadeCrash:
    """The first proven crash of a seed; cause and format are drawn where they are not given."""
    drawn = np.random.default_rng([seed, 56])
    cause = cause or str(drawn.choice(CAUSES))
    form = form or str(drawn.choice(FORMATS))
    for number in range(MOST_DRAWS):
        rng = np.random.default_rng([seed, number, CAUSES.index(cause)])
        case, file = _case(cause, rng)
        flight = _flown(case, file, rng)
        if not flight.hit_danger or not _proven(case, flight):
            continue
        sound = _flown_soundly(case, file, rng)
        if not sound.touched:
            return MadeCrash(cause, form, case, file, flight, sound, number + 1, seed)
    raise AssertionError(f"no crash by {cause} from seed {seed}")


def _case(cause: str, rng: Any) -> tuple[Case, MissionFile]:
    plane = cause in PLANES_ONLY or rng.random() < 0.5
    speed = float(rng.choice(PLANE_MPS if plane else COPTER_MPS))
    margin = max(0.6, 0.4 * speed) if plane else 0.6
    craft = Craft(not plane, speed, float(rng.uniform(0.35, 0.6)) * margin, margin)
    unit = sees_m(craft) / 10.0
    case = DRAW[cause](rng, craft, unit)
    case = replace(
        case,
        scans_hz=float(rng.choice([2.0, 4.0, 5.0, 10.0])),
        heading_rad=float(rng.uniform(-np.pi, np.pi)),
        origin_m=tuple(float(one) for one in rng.uniform(-200.0, 200.0, 3)),
        ahead_m=case.danger.x + 10.0 * unit,
    )
    if cause != "wrong map" and rng.random() < 0.25:
        case = replace(case, charted=(case.danger, *case.others))
    return case, _mission(case)


def sees_m(craft: Craft) -> float:
    """How far a vehicle's sensor promises to see: what suits it."""
    from clearway.vehicle.scale import scale_of

    return scale_of(_file(craft, {}).vehicle.to_automaton()).range_m


def _proven(case: Case, flight: Flight) -> bool:
    """Whether geometry proves what the cause claims, beside the flight without the fault."""
    craft, place = case.craft, place_of(case, case.charted)
    outside = [one for one in flight.shown if one[1] > craft.margin_m]
    if case.cause == "unseen":
        return not outside  # What appears within the margin has been seen by nobody in time.
    if case.cause == "sensor dead":
        return not flight.shown
    if case.cause == "seen late":
        return bool(outside) and not escapes(craft, flight, place, outside[0][0])
    if case.cause in ("late decision", "no escape"):
        if not outside:
            return False
        free = escapes(craft, flight, place, outside[0][0])
        return free is (case.cause == "late decision")
    return bool(outside)


def _flown(case: Case, file: MissionFile, rng: Any) -> Flight:
    return _fly(case, file, place_of(case, case.charted), case.fault, rng)


def _flown_soundly(case: Case, file: MissionFile, rng: Any) -> Flight:
    """Without the fault: of a map the true one, of a dead end the open one."""
    truth = (case.danger, *case.others)
    place = place_of(case, truth if case.by_map else case.charted)
    if case.cause == "no escape":
        place = place_of(replace(case, danger=_far(case.danger)), case.charted)
    return _fly(case, file, place, NO_FAULT, rng)


def _fly(case: Case, file: MissionFile, place: Place, fault: Fault, rng: Any) -> Flight:
    sensors = mission_sensors(file.lidar, file.sensor, file.grid.to_grid(), file.mission.name)
    return fly(case.craft, course_of(case), place, sensors[0], fault, int(rng.integers(1000)))


def _far(shape: Shape) -> Shape:
    return replace(shape, x=1e5)


def course_of(case: Case) -> Course:
    """Where the flight begins and leads."""
    ahead = np.array([np.cos(case.heading_rad), np.sin(case.heading_rad), 0.0])
    start = np.asarray(case.origin_m)
    goal = start + case.ahead_m * ahead
    return Course(start, case.heading_rad, goal, case.decides_s, case.scans_hz)


def place_of(case: Case, charted: tuple[Shape, ...]) -> Place:
    """The true world, and the map by which it is flown, if it is."""
    parts = [_obstacle(case, one) for one in (case.danger, *case.others)]
    known = ObstacleMap([_obstacle(case, one) for one in charted]) if case.by_map else None
    return Place(ObstacleMap(parts), ObstacleMap(parts[:1]), known)


def _obstacle(case: Case, shape: Shape) -> Any:
    return WorldObstacleSection.model_validate(_section(case, shape, "world")).to_obstacle()


def _section(case: Case, shape: Shape, known: str) -> dict[str, Any]:
    cosine, sine = np.cos(case.heading_rad), np.sin(case.heading_rad)
    x, y, z = case.origin_m
    place = [
        float(x + cosine * shape.x - sine * shape.y),
        float(y + sine * shape.x + cosine * shape.y),
        z + shape.up,
    ]
    if shape.ball:
        radius = 0.5 * shape.wide
        return {"shape": "ball", "position_m": place, "radius_m": radius, "known": known}
    yaw = float(np.degrees(case.heading_rad + shape.turned_rad))
    return {
        "shape": "cuboid", "position_m": place, "size_m": [shape.long, shape.wide, shape.tall],
        "orientation_deg": [0.0, 0.0, yaw], "known": known,
    }  # fmt: skip


def _mission(case: Case) -> MissionFile:
    shapes = [_section(case, one, "world") for one in (case.danger, *case.others)]
    shapes += [_section(case, one, "map") for one in case.charted]
    course = course_of(case)
    start = {
        "position_m": list(case.origin_m),
        "attitude_deg": [0.0, 0.0, float(np.degrees(case.heading_rad))],
    }
    values: dict[str, Any] = {"obstacle": shapes}
    if case.complete:
        values["map"] = {"complete": True}
    return _file(case.craft, values, start, [course.goal_m.tolist()])


def _file(
    craft: Craft, values: dict[str, Any], start: dict[str, Any] | None = None, goals: Any = None
) -> MissionFile:
    kind = "multirotor" if craft.stops else "plane"
    return parse_model(
        "made",
        {
            "mission": {"name": "made", "waypoints_m": goals or [[100.0, 0.0, 0.0]]},
            "vehicle": {
                "kind": kind, "speed_mps": craft.speed_mps, "body_radius_m": craft.body_m,
                **(start or {}),
            },
            "safety": {"margin_m": craft.margin_m},
            "lidar": [{"name": "front", "beams_per_cell": [6, 4], "sigma_m": 0.02}],
            **values,
        },
        MissionFile,
    )  # fmt: skip
