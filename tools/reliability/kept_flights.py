"""Flights that clearances are calibrated on, and ratings too are judged by: scales and sensors."""

from __future__ import annotations

import json
import random
from collections import Counter
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from clearway.missions.sensor_section import OwnSensor
from clearway.missions.setup import FlightSetup
from clearway.studies.campaigns.families import make_case
from clearway.studies.reliability.kept import Kept, KeptWatch
from clearway.studies.reliability.record import look_at_flight
from tools.reliability.flights import listed
from tools.reliability.sensors import NonRepeatingLidar

FIT, HELD_OUT = "fit", "held out"
SIGMA_M = 0.02
"""Of every sensor's range."""
COPTER = {
    "kind": "multirotor", "acceleration_mps2": 8.0, "yaw_rate_deg_s": 180.0, "body_radius_m": 0.2,
}  # fmt: skip


class Scale(NamedTuple):
    """A vehicle, how much room it keeps, and how far it looks."""

    vehicle: dict[str, Any]
    level: dict[str, Any]
    """Keys that keep it level."""
    margin_m: float
    range_m: float
    camera_m: float
    """Range of the depth camera."""
    limit_s: float
    """End of a held-out flight: decisions of many worlds tell more than many of one."""
    flights: int
    """Through each kind of world to calibrate on: a fast vehicle decides less often on one way."""
    camera_flights: int
    """With a depth camera, which is calibrated on fewer kinds."""
    kinds: int = 99
    """Of worlds to calibrate on with each sensor, at most."""
    times_larger: float = 1.0
    """How many times as large the worlds are."""


INERTIALESS_LEVEL = {"pitch_limit_deg": 0.0}
COPTER_LEVEL = {"climb_mps": 0.0, "sink_mps": 0.0}
SCALES = {
    "inertialess 1 m/s": Scale(
        {"kind": "inertialess", "speed_mps": 1.0, "body_radius_m": 0.2},
        INERTIALESS_LEVEL, 0.6, 10.0, 10.0, 40.0, 1, 2,
    ),
    "multirotor 5 m/s": Scale(
        {**COPTER, "speed_mps": 5.0}, COPTER_LEVEL, 0.4, 20.0, 10.0, 15.0, 2, 3,
    ),
    "multirotor 15 m/s": Scale(
        {**COPTER, "speed_mps": 15.0}, COPTER_LEVEL, 0.4, 40.0, 10.0, 10.0, 2, 4,
    ),
    "inertialess 10 m/s": Scale(
        {"kind": "inertialess", "speed_mps": 10.0, "body_radius_m": 1.0},
        INERTIALESS_LEVEL, 6.0, 100.0, 100.0, 40.0, 1, 0, 2, 10.0,
    ),
}  # fmt: skip
ROTATING, NON_REPEATING, CAMERA, RING = "rotating", "non-repeating", "depth camera", "level ring"
SENSORS = (ROTATING, NON_REPEATING, CAMERA, RING)
FIRST_SEED = {FIT: 70_000, HELD_OUT: 90_000}
CALIBRATED_ON = (
    "balls", "columns", "cylinders", "pockets", "mixed", "street", "maze", "wires", "boxes",
    "perlin", "ring-forest",
)  # fmt: skip
NEVER_CALIBRATED_ON = ("forest", "walls", "warehouse", "nets", "cave", "room")
WORLDS = {FIT: CALIBRATED_ON, HELD_OUT: (*CALIBRATED_ON, *NEVER_CALIBRATED_ON)}
"""Held-out flights have other seeds."""
CAMERA_WORLDS = ("balls", "forest", "columns", "walls")
"""To calibrate on with a depth camera: things that it misses beside it."""
CAMERA_SEED = 3_000
"""The first of these flights."""
UPRIGHT = ("forest", "columns", "walls", "cylinders", "pockets", "street", "maze")
"""Worlds of the level ring, which sees upright things alone."""
MOST_FLIGHTS = 96
"""Held out, of all scales and sensors together."""
RATED_EVERY = 6
"""Ratings of the first of so many decisions are looked at: those between are much like it."""

ON_GROUND = ("forest", "columns", "cylinders")
"""Worlds with solid ground."""
FAR_BELOW_M = -1000.0
"""Height of ground that nobody comes near."""


class Flight(NamedTuple):
    """One flight of the study."""

    group: str
    scale: str
    sensor: str
    family: str
    number: int

    @property
    def key(self) -> str:
        return "/".join(map(str, self))


def wanted(group: str) -> list[Flight]:
    """All flights of a set in the order of a draw, as many of each scale and sensor."""
    drawn = [
        Flight(group, name, sensor, world, number)
        for world in WORLDS[group]
        for name, scale in SCALES.items()
        for sensor in SENSORS
        if sensor != RING or world in UPRIGHT
        for number in range(scale.flights if group == FIT else 1)
    ]
    random.Random(FIRST_SEED[group]).shuffle(drawn)
    before: Counter[tuple[str, str]] = Counter()
    rounds = []
    for flight in drawn:
        kind = flight.scale, flight.sensor
        if group != FIT or before[kind] < SCALES[flight.scale].kinds:
            rounds.append((before[kind], flight))
        before[kind] += 1
    in_rounds = [flight for _, flight in sorted(rounds, key=lambda each: each[0])]
    if group == HELD_OUT:
        return in_rounds[:MOST_FLIGHTS]
    return [each for each in in_rounds if each.sensor != CAMERA] + _with_camera()


def _with_camera() -> list[Flight]:
    """Flights with a depth camera to calibrate on."""
    return [
        Flight(FIT, name, CAMERA, world, number)
        for world in CAMERA_WORLDS
        for name, scale in SCALES.items()
        for number in range(scale.camera_flights)
    ]


def flights(journal: Path, group: str) -> list[dict[str, Any]]:
    """All of a set, those of the journal not flown again."""
    lines = journal.read_text(encoding="utf-8").splitlines() if journal.exists() else []
    known = {row["key"]: row for row in map(json.loads, lines)}
    rows = []
    for flight in wanted(group):
        if flight.key not in known:
            known[flight.key] = flown(flight)
            with journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps(known[flight.key]) + "\n")
        rows.append(known[flight.key])
    return rows


def flown(flight: Flight) -> dict[str, Any]:
    """A flight with what its decisions stated, and what came of it; of ratings too, if held out."""
    watch, setup = KeptWatch(), setup_of(flight)
    run = setup.fly_with("clearway", on_decision=watch)
    kept = watch.list_kept(run)
    row = {
        "key": flight.key, **flight._asdict(), "reached": run.reached, "touched": run.touched,
        "calibrated_with": kept[0].stated.group if kept else "",
        "decisions": [_listed(one) for one in kept],
    }  # fmt: skip
    if flight.group == HELD_OUT:
        planner = setup.system().planner
        horizon_s = planner.grid.range_m / planner.speed_mps
        found = look_at_flight(run, planner.settings, horizon_s, RATED_EVERY)
        row["rated"] = found.decisions
        row["counts"] = {
            f"{kind}/{rating}": listed(one) for (kind, rating), one in found.counts.items()
        }
    return row


def _listed(kept: Kept) -> list[float | None]:
    """The numbers of a decision, in the order that `kept_page.decisions_of` reads."""
    stated = kept.stated
    numbers = [stated.predicted_m, stated.scale_m, stated.most_m, stated.level]
    measured_m = None if kept.measured_m is None else round(kept.measured_m, 5)
    return [*(round(one, 5) for one in numbers), measured_m, round(kept.true_m, 5)]


def setup_of(flight: Flight) -> FlightSetup:
    """The flight, ready to fly."""
    scale = SCALES[flight.scale]
    is_camera_fit = (flight.group, flight.sensor) == (FIT, CAMERA)
    seed = flight.number + (CAMERA_SEED if is_camera_fit else FIRST_SEED[flight.group])
    changes = changes_for(scale, flight.sensor)
    if flight.group == HELD_OUT:
        changes["simulation"]["time_limit_s"] = scale.limit_s
    if flight.sensor == RING and flight.family in ON_GROUND:
        # A level ring never sees the ground: it stands aside of what is judged.
        changes["columns"] = {"ground_m": FAR_BELOW_M}
    parameters = {"times_larger": scale.times_larger}
    case = make_case(flight.family, seed, parameters, changes, Path())
    if flight.sensor != NON_REPEATING:
        return case.setup
    return replace(case.setup, sensors=(_non_repeating(scale.range_m),))


@lru_cache(maxsize=4)
def _non_repeating(range_m: float) -> OwnSensor:
    one = NonRepeatingLidar.of((360.0, 50.0), 2.0, range_m, SIGMA_M)
    plain = one.name, one.standing, one.sigma_m
    return OwnSensor(*plain, one.detect, one.returns, one.passes, one.scan, all_round=True)


def changes_for(scale: Scale, sensor: str) -> dict[str, dict[str, Any]]:
    """What vehicle and sensor change in a mission."""
    range_m = scale.camera_m if sensor == CAMERA else scale.range_m
    beams: dict[str, Any] = {"max_range_m": range_m, "sigma_m": SIGMA_M}
    vehicle: dict[str, Any] = dict(scale.vehicle)
    # Worlds of others name their thinnest part, by which a coarse sensor would not be flown.
    safety: dict[str, Any] = {"margin_m": scale.margin_m, "smallest_object_m": None}
    # A vehicle of 1 m/s scans once a decision.
    has_inertia = vehicle["kind"] == "multirotor"
    simulation: dict[str, Any] = {"scan_rate_hz": 10.0, "step_s": 0.01} if has_inertia else {}
    if sensor == ROTATING:
        beams |= {"field_deg": [360, 50], "spacing_deg": 2.0}
    elif sensor == CAMERA:
        beams |= {"field_deg": [90, 60], "spacing_deg": 1.0}
    elif sensor == NON_REPEATING:
        # Free space by a sensor of one's own, not by a Lidar, takes a tenth of a second a scan.
        safety |= {"escape": "off"}
    elif sensor == RING:
        beams |= {"azimuth_deg": list(range(-180, 180, 2)), "elevation_deg": [0.0]}
        vehicle |= scale.level
        safety |= {"escape": "known"}
    return {
        "vehicle": vehicle, "safety": safety, "grid": {"range_m": range_m},
        "simulation": simulation, "lidar": beams,
    }  # fmt: skip
