"""A run as one MCAP file: clearway's own messages for reading back, Foxglove's for looking at."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from pydantic_core import to_json

from clearway.base.errors import MissingExtraError
from clearway.base.frames import geodetic_from_enu
from clearway.base.version import __version__
from clearway.live import FlightDecision
from clearway.missions.setup import FlightSetup
from clearway.sensors import Scan
from clearway.sensors.beams.lidar import Mounting
from clearway.sim import LoggedDecision, Run
from clearway.sim.pilot import Steering
from clearway.view.replay import schemas
from clearway.view.replay.about import list_surveyed_points, mission_message
from clearway.view.replay.messages import (
    cells_message,
    decision_message,
    intruders_message,
    list_seen_points,
    reach_message,
    reach_set_message,
    scalars_message,
    state_messages,
)

INTRUDER_STEP_S = 0.2
"""Intruders and places on Earth are written this often."""
ARROW_SHARE = 0.2
"""How far ahead arrows of intruders show, as a share of the time to the end of the grid."""
CHUNK_BYTES = 4 * 1024 * 1024


def write_mcap(
    run: Run[Steering],
    setup: FlightSetup,
    mission_toml: str,
    path: Path,
    scans: Iterable[Scan] = (),
) -> None:
    """Write the file; raises MissingExtraError without the extra `foxglove`, OSError where the disk
    refuses it.

    mission_toml: the effective mission, kept as an attachment, from which it can be flown again.
    scans: raw readings to be kept too. The flight begins when the mission says, by its zones or its
    recorded traffic, and else now.
    """
    try:
        import foxglove
        from foxglove.mcap import MCAPWriteOptions
    except ImportError as cause:
        raise MissingExtraError("writing run.mcap", "foxglove") from cause
    context = foxglove.Context()
    options = MCAPWriteOptions(chunk_size=CHUNK_BYTES, compression_threads=0)
    with (
        path.open("wb") as disk,
        _Sink(disk) as sink,
        foxglove.open_mcap(cast(BinaryIO, sink), context=context, writer_options=options) as file,
    ):
        begins = setup.place.begins or datetime.now(UTC).replace(microsecond=0)
        writer = _Writer(run, setup, context, begins)
        start = writer.nanoseconds(float(run.time_s[0]))
        file.write_metadata("clearway", _metadata(run, setup, begins))
        file.attach(
            log_time=start,
            create_time=start,
            name="mission.toml",
            media_type="application/toml",
            data=mission_toml.encode(),
        )
        writer.write(scans)


class _Sink:
    """A file whose first refusal is raised at the end: foxglove, whose calls do not fail, would
    print a line for each message after it."""

    def __init__(self, disk: BinaryIO) -> None:
        self._disk = disk
        self._at = self._end = 0
        self._refused: OSError | None = None

    def __enter__(self) -> _Sink:
        return self

    def __exit__(self, *_: object) -> None:
        if self._refused is not None:
            raise self._refused

    def write(self, data: bytes) -> int:
        """Write all of it, or nothing after a refusal."""
        self._do(self._disk.write, data)
        self._at += len(data)
        self._end = max(self._end, self._at)
        return len(data)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place, and return it from the start."""
        self._at = offset + {os.SEEK_CUR: self._at, os.SEEK_END: self._end}.get(whence, 0)
        self._do(self._disk.seek, self._at)
        return self._at

    def _do(self, ask: Callable[[Any], object], what: object) -> None:
        if self._refused is None:
            try:
                ask(what)
            except OSError as cause:
                self._refused = cause

    def flush(self) -> None:
        """Nothing to do: it is flushed when it is closed."""


def _metadata(run: Run[Steering], setup: FlightSetup, begins: datetime) -> dict[str, str]:
    """What a reader may want to know before the messages."""
    dated = "by the mission" if setup.place.begins else "when the file was written"
    return {
        "clearway": __version__,
        "mission": run.mission.name,
        "planner": run.planner,
        "seed": str(run.seed),
        "reached": "yes" if run.reached else "no",
        "begins": begins.isoformat(),
        "begins_is": dated,
    }


class _Writer:
    """Messages in the order of their times."""

    def __init__(
        self, run: Run[Steering], setup: FlightSetup, context: Any, begins: datetime
    ) -> None:
        # Imported here, for the module needs the extra.
        from foxglove import Channel, channels

        from clearway.view.replay import decision_entities, entities

        self.run, self.setup, self.context = run, setup, context
        self.begins_ns = round(begins.timestamp() * 1e6) * 1000
        self.fox, self.scene_of = entities, decision_entities
        self.settings = setup.planner.settings
        self.ahead_s = ARROW_SHARE * setup.planner.grid.range_m / setup.planner.speed_mps
        self.mission = mission_message(run, setup, begins.timestamp())
        self.own = {
            topic: Channel(topic, schema=schema, context=context)
            for topic, schema in schemas.SCHEMAS.items()
        }
        self.log = channels.LogChannel(schemas.LOG, context=context)
        self.transforms = channels.FrameTransformsChannel(schemas.TRANSFORMS, context=context)
        self.scenes = {
            topic: channels.SceneUpdateChannel(topic, context=context)
            for topic in (
                schemas.SCENE,
                schemas.PLAN_SCENE,
                schemas.WAY_OUT_SCENE,
                schemas.CELL_SCENE,
                schemas.REACH_SCENE,
                schemas.INTRUDER_SCENE,
            )
        }
        self.clouds = {
            topic: channels.PointCloudChannel(topic, context=context)
            for topic in (schemas.POINTS, schemas.WORLD_POINTS)
        }
        self.origin = setup.place.origin
        if self.origin is not None:
            self.fix = channels.LocationFixChannel(schemas.FIX, context=context)
        self.cells = decision_entities.CellScene(setup.planner.grid)
        self.trajectories = decision_entities.ReachScene()
        self.reach_sets: set[float] = set()

    def nanoseconds(self, time_s: float) -> int:
        """Since 1970."""
        return self.begins_ns + int(np.rint(time_s * 1e9))

    def write(self, scans: Iterable[Scan]) -> None:
        run = self.run
        self._write_what_stays()
        self._write_scans(scans)
        waiting = list(run.decisions)[::-1]
        intruders_s = float(run.time_s[0])
        turned = self.fox.quaternions(run.states[:, 3:])
        for at, (time_s, state) in enumerate(
            zip(run.time_s.tolist(), state_messages(run), strict=True)
        ):
            while waiting and waiting[-1].flight.time_s <= time_s + 1e-9:
                self._write_decision(waiting.pop())
            self._write_own(schemas.STATE, time_s, state)
            at_ns = self.nanoseconds(time_s)
            placed = self.fox.transform(at_ns, run.states[at, :3], turned[at])
            self.transforms.log(placed, log_time=at_ns)
            if time_s >= intruders_s - 1e-9:
                intruders_s = time_s + INTRUDER_STEP_S
                self._write_fix(at, at_ns)
                self._write_intruders(time_s)

    def _write_what_stays(self) -> None:
        start = float(self.run.time_s[0])
        self._write_own(schemas.MISSION, start, self.mission)
        at_ns = self.nanoseconds(start)
        scene = self.fox.scene(self.mission, self.run.states[::4, :3], at_ns)
        self.scenes[schemas.SCENE].log(scene, log_time=at_ns)
        surveyed = list_surveyed_points(self.setup.world)
        if len(surveyed):
            cloud = self.fox.point_cloud(at_ns, surveyed)
            self.clouds[schemas.WORLD_POINTS].log(cloud, log_time=at_ns)

    def _write_scans(self, scans: Iterable[Scan]) -> None:
        """Every reading in the frame of its sensor, which sits on the vehicle."""
        from foxglove import channels

        start, clouds = self.nanoseconds(float(self.run.time_s[0])), {}
        mountings = {one.name: one.mounting for one in self.setup.lidars}
        for scan in scans:
            name = scan.sensor
            if name not in clouds:
                topic = f"{schemas.SCANS}{name}"
                clouds[name] = channels.PointCloudChannel(topic, context=self.context)
                mounting = mountings.get(name, Mounting())
                placed = self.fox.mount_sensor(
                    start, name, mounting.position_m, mounting.attitude_rad
                )
                self.transforms.log(placed, log_time=start)
            at_ns = self.nanoseconds(scan.time_s)
            cloud = self.fox.point_cloud(at_ns, scan.points_m, name)
            clouds[name].log(cloud, log_time=at_ns)

    def _write_fix(self, at: int, at_ns: int) -> None:
        """Where on Earth the vehicle is, if the mission says where its world is."""
        if self.origin is None:
            return
        state = self.run.states[at]
        place = geodetic_from_enu(state[:3], self.origin)
        self.fix.log(self.fox.location_fix(at_ns, place, state), log_time=at_ns)

    def _write_decision(self, entry: LoggedDecision[Steering]) -> None:
        flight = entry.flight
        time_s, log_time = flight.time_s, self.nanoseconds(flight.time_s)
        told = decision_message(entry)
        self._write_own(schemas.DECISION, time_s, told)
        self._write_own(schemas.SCALARS, time_s, scalars_message(told))
        line = self.fox.log_line(log_time, flight.mode, flight.explanation)
        self.log.log(line, log_time=log_time)
        if isinstance(flight, FlightDecision):
            self._write_evidence(flight, log_time)

    def _write_evidence(self, flight: FlightDecision, log_time: int) -> None:
        decision, time_s = flight.decision, flight.time_s
        reach_set = decision.prepared.reach_set
        if reach_set.start_pitch_rad not in self.reach_sets:
            self.reach_sets.add(reach_set.start_pitch_rad)
            self._write_own(schemas.REACH_SET, time_s, reach_set_message(reach_set))
        self._write_own(schemas.CELLS, time_s, cells_message(decision, self.settings))
        self._write_own(schemas.REACH, time_s, reach_message(decision))
        points = list_seen_points(decision, self.mission["voxel_m"])
        cloud = self.fox.point_cloud(log_time, points)
        self.clouds[schemas.POINTS].log(cloud, log_time=log_time)
        plan = self.scene_of.plan(decision, log_time)
        self.scenes[schemas.PLAN_SCENE].log(plan, log_time=log_time)
        way_out = self.scene_of.way_out(decision, log_time)
        self.scenes[schemas.WAY_OUT_SCENE].log(way_out, log_time=log_time)
        cells = self.cells.update(decision, log_time)
        self.scenes[schemas.CELL_SCENE].log(cells, log_time=log_time)
        trajectories = self.trajectories.update(decision, log_time)
        self.scenes[schemas.REACH_SCENE].log(trajectories, log_time=log_time)

    def _write_intruders(self, time_s: float) -> None:
        message = intruders_message(self.run, time_s)
        if not message["intruders"]:
            return
        self._write_own(schemas.INTRUDERS, time_s, message)
        radii, at_ns = self.mission["intruder_radius_m"], self.nanoseconds(time_s)
        scene = self.fox.draw_intruders(message, radii, self.ahead_s, at_ns)
        self.scenes[schemas.INTRUDER_SCENE].log(scene, log_time=at_ns)

    def _write_own(self, topic: str, time_s: float, message: dict[str, Any]) -> None:
        self.own[topic].log(_as_json(message), log_time=self.nanoseconds(time_s))


def _as_json(message: dict[str, Any]) -> bytes:
    """Raises ValueError for what is no finite number."""
    data = to_json(message)
    if any(word in data for word in (b"NaN", b"Infinity")):  # perhaps only in a text
        return json.dumps(message, separators=(",", ":"), allow_nan=False).encode()
    return data
