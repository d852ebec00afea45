"""Scenes from files: parsed tables become the values that `avoidance.scene` assesses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.avoidance.scene import (
    DEFAULT_MPS2,
    RatingSettings,
    ReachSettings,
    Scene,
    SceneIntruder,
    SceneScan,
    TimingSettings,
)
from clearway.base.brief import brief
from clearway.base.errors import ClearwayError, InputError
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.io.scans.pointcloud import SCAN_LIMIT_M, PointCloud
from clearway.io.scans.sequences import open_scans
from clearway.io.scans.timed_scans import ScanSequence, TimedScan
from clearway.io.scans.usable import read_usable
from clearway.io.toml import parse_model, read_toml
from clearway.missions.left_out import describe_left_out
from clearway.missions.scan_fit import (
    airframe_notes,
    corner_notes,
    fit_to_scan,
    note_direction,
    note_vehicle,
    refuse_other_axes,
)
from clearway.missions.scene_file import ScanSection, SceneFile, SimulateSection
from clearway.missions.sections import fill_left_out
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import (
    BeamPattern,
    Lidar,
    Mounting,
    Scan,
    estimate_pattern,
    find_pattern,
    simulate_scan,
)
from clearway.sensors.beams.pattern import MOST_BEAMS

KEYS = {"grid": "range_m", "rating": "safety_margin_m"}
"""The key of each table that follows from a speed that is stated."""


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A scan of a file: the sequence that it belongs to, and its points."""

    sequence: ScanSequence
    scan: TimedScan
    cloud: PointCloud

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class SceneInput:
    """A scene, and what a user should see of how it was read."""

    scene: Scene
    tables: Mapping[str, Any]
    """The effective scene file: all defaults filled in, paths absolute."""
    notes: tuple[str, ...] = ()
    """What was left out or assumed on the way."""

    __repr__ = brief


def read_scene(path: str | Path, overrides: Mapping[str, Any] | None = None) -> SceneInput:
    """Read a scene file; `overrides` are tables whose keys take the place of the file's; a
    scan's file takes the place of the whole `[scan]`.

    Raises InputError naming every problem of the file, and those of the scan that it names.
    """
    path = Path(path)
    tables = read_toml(path)
    changes = dict(overrides or {})
    if "file" in changes.get("scan", {}):
        tables.pop("scan", None)
    tables = merge_tables(tables, changes)
    return scene_of(str(path), tables, path.parent, path.stem)


def scene_of(source: str, tables: Mapping[str, Any], folder: Path, name: str) -> SceneInput:
    """The scene of plain tables; `folder` is where relative paths in them start."""
    file = parse_model(source, tables, SceneFile, folder)
    file, chosen = _suit(file)
    measured = _read_measured(folder, file.scan)
    state = _state(file, measured)
    seen, notes = None, (*chosen, *_notes_of(measured))
    if measured is not None and file.scan is not None:
        seen = _read_seen(source, file.scan, measured)
        points_m, mounting = measured.cloud.points_m, seen.lidar.mounting
        notes += note_direction(measured.sequence.source, file.scan.frame, mounting, points_m)
        file, fitted = fit_to_scan(file, seen.lidar, seen.pattern_from)
        notes += (*fitted, *airframe_notes(measured.sequence, seen.lidar, points_m))
        notes += corner_notes(measured.sequence.source, points_m)
    grid = file.grid.to_grid()
    scene = Scene(
        name=name,
        grid=grid,
        state=state,
        obstacle_map=ObstacleMap([obstacle.to_obstacle() for obstacle in file.obstacle]),
        sightings=_sightings(source, file, grid, state, seen),
        traffic=_traffic(file, state.time_s),
        timing=TimingSettings(file.vehicle_timing.model, file.vehicle_timing.speed_mps),
        reach=_reach_settings(file),
        rating=_rating(file),
    )
    notes = (*notes, *note_vehicle(file, scene.speed_mps), *_inside(file, state))
    return SceneInput(scene, file.effective(folder), notes)


def merge_tables(tables: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Tables with the keys of `overrides` in place of theirs, tables within tables likewise."""
    result = dict(tables)
    for key, value in overrides.items():
        old = result.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping):
            value = merge_tables(old, value)
        result[key] = value
    return result


def _read_measured(folder: Path, section: ScanSection | None) -> Measured | None:
    """The scan that a file is asked for; None where none is."""
    if section is None or section.file is None:
        return None
    sequence = open_section(folder, section)
    scan, cloud, before = read_usable(sequence, section.at)
    if section.poses is not None and scan.state is None:
        raise InputError(
            str(section.poses),
            f"no pose at scan {scan.index}, {scan.time_s:.3f} s; it has {sequence.poses}",
        )
    return Measured(replace(sequence, notes=(*sequence.notes, *before)), scan, cloud)


def open_section(folder: Path, section: ScanSection) -> ScanSequence:
    """The scans of a file; relative paths begin at `folder`."""
    assert section.file is not None
    poses = section.poses
    if poses is not None and (folder / poses).is_file():
        poses = str(folder / poses)
    return open_scans(folder / section.file, section.topic, poses, section.frame)


def _state(file: SceneFile, measured: Measured | None) -> State:
    """The vehicle's pose as stated, else as the recording tells it, else level at the origin."""
    stated = file.vehicle
    if stated is not None and (stated.position_m is not None or stated.attitude_deg is not None):
        level = (0.0, 0.0, 0.0)
        turn = np.radians(stated.attitude_deg or level)
        return State(np.array(stated.position_m or level), turn)
    if measured is not None and measured.scan.state is not None:
        return measured.scan.state
    return State(np.zeros(3))


def _traffic(file: SceneFile, now_s: float) -> tuple[SceneIntruder, ...]:
    """The intruders, stated for the moment of the scene."""
    return tuple(
        SceneIntruder(
            replace(section.to_intruder(), time_s=now_s),
            section.chosen_models,
            section.timed,
            None if section.up is None else np.array(section.up),
        )
        for section in file.intruder
    )


def _rating(file: SceneFile) -> RatingSettings:
    stated = file.rating.model_dump()
    return RatingSettings(rating=stated.pop("name"), **stated)


def _suit(file: SceneFile) -> tuple[SceneFile, tuple[str, ...]]:
    """The file with the range and margin that suit the speed it states, and a note of them."""
    scale, range_m = _reach_settings(file).scale, {}
    if scale is None:
        return file, ()
    if file.grid.range_edges_m is None:
        range_m = {"range_m": scale.range_m}
    changed = {
        "grid": fill_left_out(file.grid, **range_m),
        "rating": fill_left_out(file.rating, safety_margin_m=scale.margin_m),
    }
    suited = file.model_copy(update=changed)
    note = describe_left_out(KEYS, vars(suited), scale)
    return suited, () if note is None else (note,)


def _reach_settings(file: SceneFile) -> ReachSettings:
    section = file.reach_set
    pitch = section.start_pitch_deg
    return ReachSettings(
        kind=file.vehicle_kind,
        method=section.method,
        tuning=section.tuning,
        start_pitch_rad=None if pitch is None else float(np.radians(pitch)),
        speed_mps=section.speed_mps,
        turn_step_deg=section.turn_step_deg,
        pitch_limit_deg=section.pitch_limit_deg,
        now_mps=section.now_mps,
        acceleration_mps2=section.acceleration_mps2 or DEFAULT_MPS2,
    )


def _read_seen(source: str, section: ScanSection, measured: Measured) -> SceneScan:
    """The scan of a file with its sensor."""
    lidar, pattern_from = lidar_of(source, section, measured.cloud, measured.sequence)
    scan = Scan(measured.cloud.points_m, measured.scan.time_s, sensor=lidar.name)
    return SceneScan(lidar, scan, pattern_from)


def _sightings(
    source: str, file: SceneFile, grid: AvoidanceGrid, state: State, seen: SceneScan | None
) -> tuple[SceneScan, ...]:
    if seen is not None:
        return (seen,)
    if file.scan is None:
        return ()
    assert file.scan.simulate is not None
    return (_simulate(source, file, file.scan.simulate, grid, state),)


def lidar_of(
    source: str, section: ScanSection, cloud: PointCloud, sequence: ScanSequence
) -> tuple[Lidar, str]:
    """The sensor of a scan, and where its beams are from: stated, of the file, or estimated.

    Raises InputError for map coordinates, axes that the file does not settle, and beams that nobody
    knows.
    """
    nearest = float(np.sqrt(np.min(np.einsum("ij,ij->i", cloud.points_m, cloud.points_m))))
    if nearest > SCAN_LIMIT_M:
        raise InputError(
            cloud.source,
            f"the nearest point is {nearest:,.0f} m from the origin: map coordinates, not the scan "
            "of a sensor; valid: points in the sensor's frame (a survey is a world to fly in: "
            "[point_cloud] of a mission)",
        )
    refuse_other_axes(section, cloud, sequence)
    pattern, pattern_from = cloud.pattern, "file"
    try:
        if section.pattern != "auto":
            pattern, pattern_from = find_pattern(section.pattern), "stated"
        elif pattern is None:
            pattern, pattern_from = estimate_pattern(cloud.points_m), "estimated"
    except ClearwayError as error:
        raise InputError(source, f"scan.pattern: {error}; or auto") from error
    if section.min_range_m is not None:
        pattern = replace(pattern, min_range_m=section.min_range_m)
    return Lidar(
        pattern.name,
        pattern,
        mounting=_mounting(section, sequence),
        airframe_radius_m=section.airframe_radius_m,
    ), pattern_from


def _mounting(section: ScanSection, sequence: ScanSequence) -> Mounting:
    """Where the sensor sits: as stated, else as the recording says, else at the origin."""
    told = sequence.mounting or Mounting()
    place, turn = section.position_m, section.attitude_deg
    return Mounting(
        told.position_m if place is None else np.array(place),
        told.attitude_rad if turn is None else np.radians(turn),
    )


def _simulate(
    source: str, file: SceneFile, section: SimulateSection, grid: AvoidanceGrid, state: State
) -> SceneScan:
    """A scan of those obstacles that are really there, cast from the vehicle's position."""
    beams = _beam_count(section, grid)
    if beams > MOST_BEAMS:
        raise InputError(source, f"scan.simulate: {beams:,} beams; at most {MOST_BEAMS:,}")
    lidar = Lidar(
        "simulated",
        _pattern(section, grid),
        sigma_m=section.sigma_m,
        dropout=section.dropout,
    )
    scan = simulate_scan(lidar, _truth(file, section), state, section.seed)
    return SceneScan(lidar, scan, "simulated")


def _truth(file: SceneFile, section: SimulateSection) -> ObstacleMap:
    """The obstacles that the simulated LiDAR meets."""
    chosen = section.obstacles
    if chosen is None:
        chosen = () if section.obstacle else tuple(range(len(file.obstacle)))
    present = [*(file.obstacle[n] for n in chosen), *section.obstacle]
    return ObstacleMap([obstacle.to_obstacle() for obstacle in present])


def _notes_of(measured: Measured | None) -> tuple[str, ...]:
    if measured is None:
        return ()
    return (*measured.sequence.notes, *cloud_notes(measured.cloud))


def cloud_notes(cloud: PointCloud) -> tuple[str, ...]:
    """What was assumed of a cloud, and left out of it."""
    left_out = (f"{count} points left out: {reason}" for reason, count in cloud.counts.items())
    return tuple(f"{cloud.source}: {note}" for note in (*cloud.notes, *left_out))


def _inside(file: SceneFile, state: State) -> tuple[str, ...]:
    """A note where the vehicle is inside something really there: its beams see nothing of it."""
    if file.scan is None or file.scan.simulate is None:
        return ()
    distance_m = _truth(file, file.scan.simulate).distance_m(state.position_m[None])[0]
    if distance_m > 0.0:
        return ()
    return ("scan.simulate: the vehicle is inside an obstacle; its beams see nothing of that",)


def _beam_count(section: SimulateSection, grid: AvoidanceGrid) -> int:
    if section.azimuth_deg is not None and section.elevation_deg is not None:
        return len(section.azimuth_deg) * len(section.elevation_deg)
    azimuths, elevations = section.beams_per_cell
    return azimuths * grid.columns * elevations * grid.rows


def _pattern(section: SimulateSection, grid: AvoidanceGrid) -> BeamPattern:
    range_m = section.max_range_m or grid.range_m
    if section.azimuth_deg is not None and section.elevation_deg is not None:
        return BeamPattern.from_angles(
            np.radians(section.azimuth_deg),
            np.radians(section.elevation_deg),
            name="listed angles",
            max_range_m=range_m,
        )
    azimuths, elevations = section.beams_per_cell
    return BeamPattern.per_cell(grid, azimuths, elevations_per_cell=elevations, max_range_m=range_m)
