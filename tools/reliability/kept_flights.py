"""Flights that clearances are calibrated on and judged by: three scales, four sensors."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from clearway.missions.sensor_section import OwnSensor
from clearway.missions.setup import FlightSetup
from clearway.studies.campaigns.families import make_case
from clearway.studies.reliability.kept import Kept, KeptWatch
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
    flights: dict[str, int]
    """Of each family and set: a fast vehicle decides less often on the same way."""


SCALES = {
    "inertialess 1 m/s": Scale(
        {"kind": "inertialess", "speed_mps": 1.0, "body_radius_m": 0.2},
        {"pitch_limit_deg": 0.0}, 0.6, 10.0, {FIT: 2, HELD_OUT: 1},
    ),
    "multirotor 5 m/s": Scale(
        {**COPTER, "speed_mps": 5.0},
        {"climb_mps": 0.0, "sink_mps": 0.0}, 0.4, 20.0, {FIT: 3, HELD_OUT: 2},
    ),
    "multirotor 15 m/s": Scale(
        {**COPTER, "speed_mps": 15.0},
        {"climb_mps": 0.0, "sink_mps": 0.0}, 0.4, 40.0, {FIT: 4, HELD_OUT: 2},
    ),
}  # fmt: skip
ROTATING, NON_REPEATING, CAMERA, RING = "rotating", "non-repeating", "depth camera", "level ring"
SENSORS = (ROTATING, NON_REPEATING, CAMERA, RING)
CAMERA_M = 10.0
"""Range of the depth camera."""
FIRST_SEED = {FIT: 3_000, HELD_OUT: 70_000}
WORLDS = {
    FIT: ("balls", "forest", "columns", "walls"),
    HELD_OUT: (
        "balls", "columns", "cylinders", "pockets", "mixed", "street", "maze", "wires", "boxes",
        "perlin", "ring-forest",
    ),
}  # fmt: skip
"""Held-out ones are flown with other seeds; all but the first two are never calibrated on."""
LEVEL_WORLDS = {
    FIT: ("forest", "columns", "walls"),
    HELD_OUT: ("forest", "columns", "cylinders", "pockets", "street", "maze"),
}
"""Of the level ring, which sees upright things alone."""

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


def wanted(group: str) -> Iterator[Flight]:
    """All flights of a set, one of each kind after the other."""
    for number in range(max(scale.flights[group] for scale in SCALES.values())):
        for name, scale in SCALES.items():
            for sensor in SENSORS:
                worlds = LEVEL_WORLDS if sensor == RING else WORLDS
                if number < scale.flights[group]:
                    yield from (
                        Flight(group, name, sensor, world, number) for world in worlds[group]
                    )


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
    """A flight with what its decisions stated, and what came of it."""
    watch = KeptWatch()
    run = setup_of(flight).fly_with("clearway", on_decision=watch)
    kept = watch.list_kept(run)
    return {
        "key": flight.key, **flight._asdict(), "reached": run.reached, "touched": run.touched,
        "calibrated_with": kept[0].stated.group if kept else "",
        "decisions": [_listed(one) for one in kept],
    }  # fmt: skip


def _listed(kept: Kept) -> list[float | None]:
    """The numbers of a decision, in the order that `kept_page.decisions_of` reads."""
    stated = kept.stated
    numbers = [stated.predicted_m, stated.scale_m, stated.most_m, stated.level]
    measured_m = None if kept.measured_m is None else round(kept.measured_m, 5)
    return [*(round(one, 5) for one in numbers), measured_m, round(kept.true_m, 5)]


def setup_of(flight: Flight) -> FlightSetup:
    """The flight, ready to fly."""
    scale = SCALES[flight.scale]
    seed = FIRST_SEED[flight.group] + flight.number
    changes = changes_for(scale, flight.sensor)
    if flight.sensor == RING and flight.family in ON_GROUND:
        # A level ring never sees the ground: it stands aside of what is judged.
        changes["columns"] = {"ground_m": FAR_BELOW_M}
    case = make_case(flight.family, seed, {}, changes, Path())
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
    range_m = CAMERA_M if sensor == CAMERA else scale.range_m
    beams: dict[str, Any] = {"max_range_m": range_m, "sigma_m": SIGMA_M}
    vehicle: dict[str, Any] = dict(scale.vehicle)
    # Worlds of others name their thinnest part, by which a coarse sensor would not be flown.
    safety: dict[str, Any] = {"margin_m": scale.margin_m, "smallest_object_m": None}
    # A vehicle of 1 m/s scans once a decision.
    has_inertia = vehicle["kind"] == "multirotor"
    simulation = {"scan_rate_hz": 10.0, "step_s": 0.01} if has_inertia else {}
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
