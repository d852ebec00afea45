"""One moment assessed from what somebody has: a scan or several, a file, or a map alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.scene import (
    RatingSettings,
    ReachSettings,
    Scene,
    SceneAssessment,
    SceneIntruder,
    SceneScan,
    VehicleKind,
    assess_scene,
)
from clearway.base.checks import kind_of, positive
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.missions.planned import Notice
from clearway.missions.recorded_scan import RecordedScan, read_scan
from clearway.missions.scan_fit import describe_assumed_vehicle
from clearway.missions.scene_reading import read_scene
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Lidar, Scan, estimate_pattern
from clearway.traffic import Intruder

SCENE = ".toml"
OLDEST_S = 120.0
"""Age of a report that still tells something."""


def assess(
    seen: Scan | Sequence[Scan] | str | Path,
    grid: AvoidanceGrid | None = None,
    *,
    lidar: Lidar | None = None,
    state: State | None = None,
    obstacle_map: ObstacleMap | None = None,
    intruders: Sequence[Intruder] = (),
    speed_mps: float | None = None,
    vehicle: VehicleKind | None = None,
    settings: AvoidanceSettings | None = None,
    notice: Notice | None = None,
) -> SceneAssessment:
    """Rate one moment: how likely, visible and reachable every cell of the grid is, no decision.

    Parameters
    ----------
    seen
        A scan, scans of several LiDARs, the file of a scan, or a scene file (TOML), which states
        all else itself. No scan at all, `[]`, leaves everything visible (4.19).
    grid
        Cells in the body frame of the vehicle; by default the paper's, as deep as suits
        `speed_mps`, else 10 m.
    lidar
        Of the scan; by default what `read_scan` found, or estimated from the points.
    state
        Own pose, world frame; by default the recorded one, else level at the origin.
    obstacle_map
        World frame.
    intruders
        World frame, as reported; predicted to the time of the state.
    speed_mps
        Of the vehicle whose trajectories are rated; by default one layer a second.
    vehicle
        "inertialess" (stops at once), "multirotor" (accelerates and brakes) or "plane" (keeps its
        speed); by default the first for a scan of a file, else a plane.
    settings
        Of decisions, looked at more finely here.
    notice
        Called with sentences about what was assumed or prepared.

    Returns
    -------
    SceneAssessment
        Ratings by cell and by trajectory.

    Raises
    ------
    InputError
        For files that cannot be used.
    ClearwayError
        For values that contradict each other or where nothing leads through the grid.

    Examples
    --------
    >>> import clearway as cw
    >>> rated = cw.assess(cw.read_scan("street.pcd"), cw.AvoidanceGrid.uniform(50.0))
    >>> rated
    SceneAssessment('street', ... of 350 cells with obstacles, ... trajectories free)
    >>> rated.cells.obstacle.shape, rated.reach.reachability.shape
    ((350,), (350,))
    """
    if isinstance(seen, str | Path) and Path(seen).suffix.lower() == SCENE:
        given = (grid, lidar, state, obstacle_map, speed_mps, vehicle, settings)
        if any(value is not None for value in given) or intruders:
            raise ClearwayError(f"{seen}: a scene file states grid, state and settings itself")
        read = read_scene(seen)
        _tell(notice, read.notes)
        return assess_scene(read.scene, notice)
    for name, value, kind in (
        ("grid", grid, AvoidanceGrid),
        ("lidar", lidar, Lidar),
        ("state", state, State),
        ("obstacle_map", obstacle_map, ObstacleMap),
        ("settings", settings, AvoidanceSettings),
    ):
        if value is not None:
            kind_of(f"assess: {name}", value, kind)
    if not np.iterable(intruders):
        raise ClearwayError(f"intruders: a sequence is needed, got {type(intruders).__name__}")
    for intruder in intruders:
        kind_of("assess: intruders", intruder, Intruder)
    if vehicle is not None:
        kind_of("assess: vehicle", vehicle, str)
    if speed_mps is not None:
        positive("assess: speed_mps", speed_mps)
    scans = _scans(seen)
    if lidar is not None and len(scans) > 1:
        raise ClearwayError("lidar: of one scan; scans of several come from read_scan")
    for scan in scans:
        _tell(notice, scan.notes if isinstance(scan, RecordedScan) else ())
    reach = ReachSettings(vehicle or _assume_kind(scans), speed_mps=speed_mps)
    if reach.scale is not None:
        grid = grid or AvoidanceGrid.uniform(reach.scale.range_m)
        settings = settings or AvoidanceSettings(safety_margin_m=reach.scale.margin_m)
    settings = settings or AvoidanceSettings()
    models = settings.intruder_models
    scene = Scene(
        name=_name(scans),
        grid=grid or AvoidanceGrid.uniform(),
        state=state or _find_recorded_state(scans),
        obstacle_map=obstacle_map or ObstacleMap(),
        sightings=tuple(_sighting(scan, lidar) for scan in scans),
        traffic=tuple(SceneIntruder(intruder, models) for intruder in intruders),
        reach=reach,
        rating=RatingSettings.of(settings),
    )
    _check_times(scene)
    if vehicle is None and scene.reach.kind == "inertialess":
        _tell(notice, [describe_assumed_vehicle(scene.speed_mps, "vehicle", "speed_mps")])
    return assess_scene(scene, notice)


def _check_times(scene: Scene) -> None:
    """Refuse reports of another time: predicted so far, they would be anywhere."""
    for seen in scene.traffic:
        age = scene.state.time_s - seen.intruder.time_s
        if abs(age) > OLDEST_S:
            raise ClearwayError(
                f"intruders: {seen.intruder.name or '?'} is of {seen.intruder.time_s:g} s, the "
                f"state estimate of {scene.state.time_s:g} s; valid: at most {OLDEST_S:g} s apart"
            )


def _tell(notice: Notice | None, notes: Sequence[str]) -> None:
    if notice is not None:
        for note in notes:
            notice(note)


def _scans(seen: Scan | Sequence[Scan] | str | Path) -> tuple[Scan, ...]:
    if isinstance(seen, str | Path):
        return (read_scan(seen),)
    if isinstance(seen, Scan):
        return (seen,)
    scans = tuple(seen) if np.iterable(seen) else (seen,)
    strange = [type(one).__name__ for one in scans if not isinstance(one, Scan)]
    if strange:
        raise ClearwayError(
            f"seen: a scan is needed, got {strange[0]}; valid: Scan(points_m), what "
            "read_scan gives, a list of these, or a file"
        )
    return scans


def _sighting(scan: Scan, lidar: Lidar | None) -> SceneScan:
    """The scan with its LiDAR: as given, as recorded, or estimated."""
    if lidar is not None:
        return SceneScan(lidar, scan, "stated")
    if isinstance(scan, RecordedScan):
        return SceneScan(scan.lidar, scan, scan.lidar_from)
    pattern = estimate_pattern(scan.points_m)
    return SceneScan(Lidar(scan.sensor or pattern.name, pattern), scan, "estimated")


def _find_recorded_state(scans: Sequence[Scan]) -> State:
    told = (scan.state for scan in scans if isinstance(scan, RecordedScan))
    return next((state for state in told if state is not None), State(np.zeros(3)))


def _assume_kind(scans: Sequence[Scan]) -> VehicleKind:
    """A multirotor where a file has a scan: few planes carry what records them."""
    recorded = any(isinstance(scan, RecordedScan) for scan in scans)
    return "inertialess" if recorded else "plane"


def _name(scans: Sequence[Scan]) -> str:
    """What pictures call it: after the file."""
    files = (scan.source for scan in scans if isinstance(scan, RecordedScan))
    return next((Path(file).stem for file in files if file), "scene")
