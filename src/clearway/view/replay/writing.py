"""A run as one MCAP file: clearway's own messages for reading back, Foxglove's for looking at."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.errors import MissingExtraError
from clearway.live import FlightDecision
from clearway.missions.setup import FlightSetup
from clearway.sim import LoggedDecision, Run
from clearway.sim.pilot import Steering
from clearway.view.replay import schemas
from clearway.view.replay.about import mission_message, surveyed_points
from clearway.view.replay.messages import (
    cells_message,
    decision_message,
    intruders_message,
    reach_message,
    reach_set_message,
    seen_points,
    state_message,
)

INTRUDER_STEP_S = 0.2
"""Intruders are written this often."""
ARROW_SHARE = 0.2
"""How far ahead arrows of intruders show, as a share of the time to the end of the grid."""
CHUNK_BYTES = 4 * 1024 * 1024


def write_mcap(run: Run[Steering], setup: FlightSetup, mission_toml: str, path: Path) -> None:
    """Write the file; raises MissingExtraError without the extra `foxglove`.

    mission_toml: the effective mission, kept as an attachment, from which it can be flown again.
    """
    try:
        import foxglove
        from foxglove.mcap import MCAPWriteOptions
    except ImportError as cause:
        raise MissingExtraError("writing run.mcap", "foxglove") from cause
    context = foxglove.Context()
    options = MCAPWriteOptions(chunk_size=CHUNK_BYTES, compression_threads=0)
    with foxglove.open_mcap(str(path), context=context, writer_options=options) as file:
        start = _nanoseconds(float(run.time_s[0]))
        file.attach(
            log_time=start,
            create_time=start,
            name="mission.toml",
            media_type="application/toml",
            data=mission_toml.encode(),
        )
        _Writer(run, setup, context).write()


class _Writer:
    """Messages in the order of their times."""

    def __init__(self, run: Run[Steering], setup: FlightSetup, context: Any) -> None:
        # Imported here, for the module needs the extra.
        from foxglove import Channel, channels

        from clearway.view.replay import decision_entities, entities

        self.run, self.setup = run, setup
        self.fox, self.scene_of = entities, decision_entities
        self.settings = setup.planner.settings
        self.ahead_s = ARROW_SHARE * setup.planner.grid.range_m / setup.planner.speed_mps
        self.mission = mission_message(run, setup)
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
        self.cells = decision_entities.CellScene(setup.planner.grid)
        self.trajectories = decision_entities.ReachScene()
        self.reach_sets: set[float] = set()

    def write(self) -> None:
        run = self.run
        self._write_what_stays()
        waiting = list(run.decisions)[::-1]
        intruders_s = float(run.time_s[0])
        for at, time_s in enumerate(run.time_s.tolist()):
            while waiting and waiting[-1].flight.time_s <= time_s + 1e-9:
                self._write_decision(waiting.pop())
            self._write_own(schemas.STATE, time_s, state_message(run, at))
            transform = self.fox.transform(time_s, run.states[at])
            self.transforms.log(transform, log_time=_nanoseconds(time_s))
            if run.intruder_tracks and time_s >= intruders_s - 1e-9:
                intruders_s = time_s + INTRUDER_STEP_S
                self._write_intruders(time_s)

    def _write_what_stays(self) -> None:
        start = float(self.run.time_s[0])
        self._write_own(schemas.MISSION, start, self.mission)
        scene = self.fox.scene(self.mission, self.run.states[::4, :3])
        self.scenes[schemas.SCENE].log(scene, log_time=_nanoseconds(start))
        surveyed = surveyed_points(self.setup.world)
        if len(surveyed):
            cloud = self.fox.point_cloud(start, surveyed)
            self.clouds[schemas.WORLD_POINTS].log(cloud, log_time=_nanoseconds(start))

    def _write_decision(self, entry: LoggedDecision[Steering]) -> None:
        flight = entry.flight
        time_s, log_time = flight.time_s, _nanoseconds(flight.time_s)
        self._write_own(schemas.DECISION, time_s, decision_message(entry))
        line = self.fox.log_line(time_s, flight.mode, flight.explanation)
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
        points = seen_points(decision, self.mission["voxel_m"])
        cloud = self.fox.point_cloud(time_s, points)
        self.clouds[schemas.POINTS].log(cloud, log_time=log_time)
        self.scenes[schemas.PLAN_SCENE].log(self.scene_of.plan(decision), log_time=log_time)
        way_out = self.scene_of.way_out(decision)
        self.scenes[schemas.WAY_OUT_SCENE].log(way_out, log_time=log_time)
        self.scenes[schemas.CELL_SCENE].log(self.cells.update(decision), log_time=log_time)
        self.scenes[schemas.REACH_SCENE].log(self.trajectories.update(decision), log_time=log_time)

    def _write_intruders(self, time_s: float) -> None:
        message = intruders_message(self.run, time_s)
        if not message["intruders"]:
            return
        self._write_own(schemas.INTRUDERS, time_s, message)
        scene = self.fox.traffic(message, self.mission["intruder_radius_m"], self.ahead_s)
        self.scenes[schemas.INTRUDER_SCENE].log(scene, log_time=_nanoseconds(time_s))

    def _write_own(self, topic: str, time_s: float, message: dict[str, Any]) -> None:
        data = json.dumps(message, separators=(",", ":"), allow_nan=False).encode()
        self.own[topic].log(data, log_time=_nanoseconds(time_s))


def _nanoseconds(time_s: float) -> int:
    return int(np.rint(time_s * 1e9))
