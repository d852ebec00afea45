"""The vehicle, sensors and map that a log is judged with: those of a mission, or assumed ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.errors import ClearwayError, InputError
from clearway.io.flights.recorded import RecordedFlight, RecordedSensor
from clearway.io.toml import parse_model, parse_toml
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.scene_file import ScanSection
from clearway.missions.scene_reading import lidar_of
from clearway.missions.setup import FlightSetup, Notice, prepare
from clearway.sensors import AnySensor
from clearway.studies.why.speeds import track_speeds

SLOWEST_MPS = 0.5
"""Of an assumed vehicle: a log that never moves tells nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class Judge:
    """Whose eyes and movements a flight is judged by."""

    file: MissionFile
    setup: FlightSetup
    lidars: tuple[AnySensor, ...]
    """For each sensor of the log, under its name."""
    notes: tuple[str, ...]

    @property
    def margin_m(self) -> float:
        return self.setup.planner.settings.safety_margin_m

    @property
    def body_m(self) -> float:
        return self.setup.craft.body_radius_m

    @property
    def needed_m(self) -> float:
        """Distance at which a danger must be seen: one movement, the turn or the stop, and the
        margin."""
        automaton = self.setup.planner.automaton
        return automaton.step_m + automaton.room_to_turn_m + automaton.stopping_m + self.margin_m


def judge_of(flight: RecordedFlight, mission: Path | None, notice: Notice | None) -> Judge:
    """The mission that was given, else the flight's own, else an assumed multirotor."""
    notes: tuple[str, ...] = ()
    if mission is not None:
        file = read_mission_file(str(mission), notice)
    elif flight.mission_toml is not None:
        source = f"{flight.source}, its mission"
        file = parse_model(source, parse_toml(source, flight.mission_toml), MissionFile)
    else:
        file, note = _assume(flight)
        notes = (note,)
    setup = prepare(file, notice)
    lidars = _lidars(flight, setup, stated=not notes)
    return Judge(file, setup, lidars, notes)


def _assume(flight: RecordedFlight) -> tuple[MissionFile, str]:
    """A multirotor as fast as the log's."""
    speed = max(SLOWEST_MPS, round(float(np.percentile(track_speeds(flight.track), 99.0)), 1))
    tables: dict[str, Any] = {
        "mission": {"name": "recorded", "waypoints_m": [[100.0 * speed, 0.0, 0.0]]},
        "vehicle": {"kind": "multirotor", "speed_mps": speed},
    }
    file = parse_model(flight.source, tables, MissionFile)
    note = (
        f"assumed a multirotor of {speed:g} m/s with a margin of {file.safety.margin_m:g} m; "
        "state yours with --mission"
    )
    return file, note


def _lidars(flight: RecordedFlight, setup: FlightSetup, *, stated: bool) -> tuple[AnySensor, ...]:
    """The beams of each sensor of the log: told by it, stated by the mission, or estimated."""
    by_name = {one.name: one for one in setup.sensors} if stated else {}
    in_order = setup.lidars if stated and len(setup.lidars) == len(flight.sensors) else ()
    found: list[AnySensor] = []
    for number, sensor in enumerate(flight.sensors):
        if sensor.lidar is not None:
            found.append(sensor.lidar)
        elif sensor.name in by_name:
            found.append(by_name[sensor.name])
        elif in_order:
            found.append(replace(in_order[number], name=sensor.name))
        else:
            found.extend(_estimate(sensor))
    return tuple(found)


def _estimate(sensor: RecordedSensor) -> list[AnySensor]:
    """Beams estimated from the first scan that shows them; none where no scan does."""
    if sensor.sequence is None:
        return []
    for scan in sensor.sequence:
        try:
            cloud = scan.read()
            if not len(cloud.points_m):
                continue
            section = ScanSection(file=sensor.sequence.source, pattern="auto")
            lidar, _ = lidar_of(sensor.sequence.source, section, cloud, sensor.sequence)
        except (ClearwayError, InputError):
            continue
        return [replace(lidar, name=sensor.name)]
    return []
