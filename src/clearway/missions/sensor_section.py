"""`[[sensor]]` of a mission file: a sensor of any kind, a user's own among them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from clearway.base.errors import InputError, OwnCodeError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.own_code import describe_raised, guard_call
from clearway.base.state import BoolArray, State
from clearway.base.variants import Variants
from clearway.io.choices import OneOf
from clearway.io.toml import Section, parse_model
from clearway.missions.lidar_section import LidarSection
from clearway.obstacles.world import World
from clearway.sensors import Lidar, Scan
from clearway.sensors.cells.detection import Detection
from clearway.sensors.standing import Standing

ASKED = ("name", "standing", "sigma_m", "detect", "returns", "passes", "scan")
"""What a sensor of a mission answers: the questions of a RangeSensor, and the simulator's."""


@dataclass(frozen=True, eq=False)
class OwnSensor:
    """A user's sensor; what it raises in flight is reported with its file and line."""

    name: str
    standing: Standing
    sigma_m: float
    detect: Callable[..., Detection]
    returns: Callable[[Scan, State, float, float], tuple[FloatArray, FloatArray]]
    passes: Callable[[Scan, State, FloatArray, FloatArray, float], BoolArray]
    scan: Callable[[World, State, np.random.Generator], Scan]
    all_round: bool = False
    """Whether it looks all round the vehicle, where the user's says so."""


AnyKind = Lidar | OwnSensor
MakeSensor = Callable[[AvoidanceGrid, Mapping[str, Any]], AnyKind]
"""(grid of the mission, settings of the file) -> sensor; raises InputError for the settings."""


def _lidar(grid: AvoidanceGrid, settings: Mapping[str, Any]) -> Lidar:
    """Beams that return the range of what they meet; settings as of `[[lidar]]`."""
    return parse_model("settings", settings, LidarSection).to_lidar(grid)


def _own(label: str, found: Any) -> MakeSensor:
    """A user's class or function: called with the settings by name."""
    if not callable(found):
        raise OwnCodeError(label, f"is no class or function but {type(found).__name__}")

    def make(grid: AvoidanceGrid, settings: Mapping[str, Any]) -> OwnSensor:
        del grid
        try:
            sensor = found(**settings)
        except Exception as cause:
            given = ", ".join(settings) or "none"
            raise OwnCodeError(
                label, f"with settings {given} {describe_raised(cause, found)}"
            ) from cause
        missing = [name for name in ASKED if not hasattr(sensor, name)]
        if missing:
            raise OwnCodeError(
                label,
                f"gives {type(sensor).__name__} without {', '.join(missing)}; a sensor of a "
                f"mission has {', '.join(ASKED)}",
            )
        plain = ASKED[:3]
        asked: dict[str, Any] = {
            name: guard_call(f"{label}.{name}", getattr(sensor, name))
            for name in ASKED
            if name not in plain
        }
        asked["all_round"] = bool(getattr(sensor, "all_round", False))
        return OwnSensor(*(getattr(sensor, name) for name in plain), **asked)

    return make


SENSORS: Variants[MakeSensor] = Variants("sensor", {"lidar": _lidar}, _own)
"""Kinds of sensors by name; add one here."""


class SensorSection(Section):
    """`[[sensor]]`: a sensor of any kind; see [sensors.md](sensors.md)."""

    kind: Annotated[str, OneOf(SENSORS)]
    """What makes it: a class or function that takes the settings by name."""
    settings: dict[str, Any] = Field(default={})
    """Whatever the kind takes; of `lidar` the keys of `[[lidar]]`."""

    def __hash__(self) -> int:
        """Of the kind alone: settings can be distinguished, but not hashed."""
        return hash(self.kind)

    def to_sensor(self, grid: AvoidanceGrid) -> AnyKind:
        """The sensor; raises InputError for settings that it refuses."""
        return SENSORS.find(self.kind)(grid, self.settings)


def mission_sensors(
    lidars: tuple[LidarSection, ...],
    others: tuple[SensorSection, ...],
    grid: AvoidanceGrid,
    mission: str,
) -> tuple[AnyKind, ...]:
    """All sensors of a mission; raises InputError where two have one name."""
    sensors = [*(part.to_lidar(grid) for part in lidars), *(one.to_sensor(grid) for one in others)]
    names = [sensor.name for sensor in sensors]
    if len(set(names)) < len(names):
        raise InputError(
            f"mission {mission!r}", f"sensor: names must differ, of [[lidar]] too, got {names}"
        )
    return tuple(sensors)
