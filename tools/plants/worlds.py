"""Random worlds at each plant's own scale, and what goes wrong in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.obstacles.obstacle import Obstacle

REPOSITORY = Path(__file__).resolve().parent.parent.parent
AUTOMATA = REPOSITORY / "examples" / "automata"


@dataclass(frozen=True)
class Scale:
    """One plant's worlds, in its own lengths."""

    plant: str
    leg_m: float
    apart_m: tuple[float, float]
    """Between masts, at least: where they stand far apart, and where they stand close."""
    radius_m: tuple[float, float]
    """Of masts."""
    wide_m: float
    """That they stand in, across the leg."""
    range_m: float
    margin_m: float
    body_m: float
    reach_m: float
    speed_mps: float
    beams: tuple[float, float]
    """Deviation (m) and drop-out of its range sensor."""
    mapped: bool = False
    """Whether it flies by a complete map without a sensor, where that is not what fails."""


SCALES = (
    Scale(
        "quadrotor",
        leg_m=120.0,
        apart_m=(20.0, 12.0),
        radius_m=(0.3, 1.5),
        wide_m=60.0,
        range_m=50.0,
        margin_m=1.5,
        body_m=0.4,
        reach_m=4.0,
        speed_mps=5.0,
        beams=(0.03, 0.05),
    ),
    Scale(
        "F450",
        leg_m=100.0,
        apart_m=(18.0, 11.0),
        radius_m=(0.3, 1.5),
        wide_m=50.0,
        range_m=40.0,
        margin_m=1.5,
        body_m=0.4,
        reach_m=4.0,
        speed_mps=3.0,
        beams=(0.03, 0.05),
    ),
    Scale(
        "c172x",
        leg_m=12_000.0,
        apart_m=(2_600.0, 1_700.0),
        radius_m=(5.0, 60.0),
        wide_m=6_000.0,
        range_m=3_500.0,
        margin_m=80.0,
        body_m=6.0,
        reach_m=300.0,
        speed_mps=55.0,
        beams=(5.0, 0.05),
        mapped=True,
    ),
)


@dataclass(frozen=True)
class Family:
    """What is flown in many worlds."""

    about: str
    close: bool = True
    """Whether masts stand close."""
    wind: float = 0.0
    """Share of the speed."""
    gusts: float = 0.0
    fault: str | None = None
    senses: bool = False
    """Flown with a range sensor by those too that fly by a map else."""


FAMILIES = {
    "far": Family("masts far apart", close=False),
    "close": Family("masts close to each other"),
    "wind": Family("close, wind of a quarter of the speed, gusts of 5 %", wind=0.25, gusts=0.05),
    "half-wind": Family("close, wind of half the speed, gusts of 5 %", wind=0.5, gusts=0.05),
    "dead": Family("close, the sensor dies on the way", fault="dead", senses=True),
    "late": Family("close, a decision 3 s late", fault="late"),
    "wall": Family("close, a wall appears at half the range", fault="wall", senses=True),
}


def masts(scale: Scale, family: Family, seed: int) -> list[dict[str, Any]]:
    """Masts too tall to fly over, at random in front of a leg."""
    rng = np.random.default_rng([seed, 41])
    apart_m = scale.apart_m[int(family.close)]
    places: list[FloatArray] = []
    for _ in range(4000):
        place = rng.uniform(
            [0.15 * scale.leg_m, -0.5 * scale.wide_m], [0.9 * scale.leg_m, 0.5 * scale.wide_m]
        )
        if all(np.linalg.norm(place - other) >= apart_m for other in places):
            places.append(place)
    return [
        {
            "shape": "line",
            "position_m": [float(x), float(y), 0.0],
            "orientation_deg": [0.0, 90.0, 0.0],
            "size_m": [2.0 * scale.range_m],
            "radius_m": float(rng.uniform(*scale.radius_m)),
            "known": "both" if scale.mapped and not family.senses else "world",
        }
        for x, y in places
    ]


def fault_s(scale: Scale, seed: int) -> float:
    """When something goes wrong: amid the masts."""
    share = np.random.default_rng([seed, 43]).uniform(0.15, 0.6)
    return float(share * scale.leg_m / scale.speed_mps)


def mission(scale: Scale, family: Family, seed: int) -> MissionFile:
    """A leg through masts."""
    from_rad = np.random.default_rng([seed, 42]).uniform(-np.pi, np.pi)
    strength = family.wind * scale.speed_mps
    wind = [strength * float(np.cos(from_rad)), strength * float(np.sin(from_rad)), 0.0]
    at_s = fault_s(scale, seed)
    # Without a sensor it only holds: three times the leg's time is enough to see that.
    until_s = at_s + 3.0 * scale.leg_m / scale.speed_mps if family.fault == "dead" else None
    faults: dict[str, dict[str, Any]] = {
        "dead": {"dead_from_s": at_s},
        "late": {"late_from_s": at_s, "late_s": 3.0},
    }
    tables: dict[str, Any] = {
        "mission": {
            "name": f"{scale.plant}-{seed}",
            "waypoints_m": [[scale.leg_m, 0.0, 0.0]],
            "reach_radius_m": scale.reach_m,
        },
        "vehicle": {
            "plant": scale.plant,
            "automaton": str(AUTOMATA / f"{scale.plant}.toml"),
            "body_radius_m": scale.body_m,
        },
        "grid": {"range_m": scale.range_m, "layers": 12},
        "safety": {"margin_m": scale.margin_m},
        "simulation": {
            "seed": seed,
            "wind_mps": wind,
            "gusts_mps": family.gusts * scale.speed_mps,
            **({} if until_s is None else {"time_limit_s": until_s}),
        },
        "faults": faults.get(family.fault or "", {}),
        "obstacle": masts(scale, family, seed),
    }
    if scale.mapped:  # Air carries it: what holds its way over the ground need not be told.
        tables["safety"]["wind_mps"] = wind
    if scale.mapped and not family.senses:
        tables["safety"]["escape"] = "mapped"
        tables["map"] = {"files": [], "complete": True}
        tables["lidar"] = []
    else:
        tables["lidar"] = [{"sigma_m": scale.beams[0], "dropout": scale.beams[1]}]
    return parse_model(f"{scale.plant} {seed}", tables, MissionFile)


def wall_ahead(scale: Scale, state: FloatArray) -> Obstacle:
    """A wall across the way at half the range, from a state [6], as wide as the range."""
    yaw = float(state[5])
    away_m = 0.5 * scale.range_m * np.array([np.cos(yaw), np.sin(yaw), 0.0])
    thick_m = 0.02 * scale.range_m
    size_m = (thick_m, 0.5 * scale.range_m, 2.0 * scale.range_m)
    middle = state[:3] + away_m + 0.5 * thick_m * away_m / np.linalg.norm(away_m)
    return Obstacle.cuboid(
        middle, size_m, radius_m=0.0, orientation_rad=np.array([0.0, 0.0, yaw]), name="wall"
    )
