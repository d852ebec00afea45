"""All scans of the recording that a scene names, through the avoidance system."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.scene import Scene, VehicleKind, build_scene_automaton
from clearway.base.brief import brief
from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.io.scans.pointcloud import PointCloud
from clearway.io.scans.timed_scans import NO_POSES, ScanSequence, TimedScan
from clearway.io.scans.usable import LeftOut, find_usable
from clearway.live import AvoidanceSystem
from clearway.live.playback import Moment, PlayedScan, mission_along, play
from clearway.missions.scene_file import ScanSection
from clearway.missions.scene_reading import SceneInput, cloud_notes, lidar_of, open_section
from clearway.reach.store import Notice, ReachLibrary
from clearway.sensors import Lidar, Scan
from clearway.vehicle.scale import suit_reach_m

NO_POSE = "no pose at its time"
INCOMPLETE = "incomplete: its missing beams say nothing"
OUT_OF_ORDER = "not later than the one before"
AHEAD_OF_TIME = "later than the one after it"
ONE_SCAN_S = 1e-3
"""Memory of a vehicle that may have moved, nobody knows where to."""


@dataclass(frozen=True, slots=True, eq=False)
class Playback:
    """A recording being played; `left_out` is complete once `scans` is exhausted."""

    sequence: ScanSequence
    lidar: Lidar
    pattern_from: str
    posed: bool
    """Whether the recording tells where the vehicle was."""
    vehicle: VehicleKind
    speed_mps: float
    system: AvoidanceSystem
    """What decides, fed as `scans` are drawn."""
    scans: Iterator[tuple[int, PlayedScan]]
    """(number of the scan, what was decided)"""
    left_out: LeftOut
    """Scans without a decision."""
    notes: tuple[str, ...]

    __repr__ = brief


def play_scene(read: SceneInput, notice: Notice | None = None) -> Playback:
    """Every scan of the file that a scene names, with its grid, map and settings.

    With poses, goals lie on the recorded way; without, the vehicle hovers, has its goal straight
    ahead, and remembers nothing from scan to scan. Raises InputError where the scene names no
    recording, or one that no pose fits.
    """
    section = ScanSection.model_validate(read.tables["scan"]) if "scan" in read.tables else None
    if section is None or section.file is None:
        raise InputError("--all", "needs a scan file, a folder of scans or a recording (--scan)")
    if read.scene.reach.method != "flying":
        raise InputError(
            "--all", f"decides with the reach set flying, not {read.scene.reach.method}"
        )
    sequence = open_section(Path(), section)
    states = _states(sequence, section)
    scene, (first, cloud) = read.scene, find_usable(sequence, LeftOut(), whole=True)
    lidar, pattern_from = _lidar(section, cloud, sequence, scene)
    system = _system(scene, lidar, states, first.time_s, notice)
    left_out = LeftOut()
    moments = _moments(sequence, scene.state, bool(states), lidar, left_out)
    return Playback(
        sequence,
        lidar,
        pattern_from,
        bool(states),
        scene.reach.kind,
        scene.speed_mps,
        system,
        _play(system, moments),
        left_out,
        (*sequence.notes, *cloud_notes(cloud)),
    )


def _states(sequence: ScanSequence, section: ScanSection) -> list[State]:
    """Poses at the scans' times; none where the recording has none."""
    if sequence.poses == NO_POSES:
        return []
    states = [scan.state for scan in sequence if scan.state is not None]
    if not states and section.poses is not None:
        raise InputError(section.poses, f"no pose at the time of any scan; it has {sequence.poses}")
    return states


def _lidar(
    section: ScanSection, cloud: PointCloud, sequence: ScanSequence, scene: Scene
) -> tuple[Lidar, str]:
    """The sensor of the first scan, taken to reach through the grid in the others too."""
    lidar, pattern_from = lidar_of(sequence.source, section, cloud, sequence)
    reach = max(lidar.pattern.max_range_m, scene.grid.range_m)
    return replace(lidar, pattern=replace(lidar.pattern, max_range_m=reach)), pattern_from


def _system(
    scene: Scene, lidar: Lidar, states: list[State], start_s: float, notice: Notice | None
) -> AvoidanceSystem:
    automaton = build_scene_automaton(scene)
    if automaton.has_inertia:
        raise InputError(
            "vehicle.kind",
            "a recording does not tell how fast a multirotor was at each scan: rate one scan of it "
            '(--at), or play it with kind = "inertialess"',
        )
    rating = scene.rating
    settings = AvoidanceSettings(
        rating=rating.rating,
        unknown=rating.unknown,
        unknown_unseen=rating.unknown_unseen,
        threshold=rating.threshold,
        safety_margin_m=rating.safety_margin_m,
        detection=rating.detection,
    )
    if not states:
        settings = replace(settings, memory_s=ONE_SCAN_S)
    planner = Planner.of(ReachLibrary.load_or_build(automaton, scene.grid, notice=notice), settings)
    mission = mission_along(
        states or [replace(scene.state, time_s=start_s)],
        scene.grid.range_m,
        suit_reach_m(automaton),
    )
    system = AvoidanceSystem(
        planner,
        mission,
        lidars=(lidar,),
        obstacle_map=scene.obstacle_map,
    )
    for traffic in scene.traffic:
        system.update(replace(traffic.intruder, time_s=start_s))
    return system


def _moments(
    sequence: ScanSequence, still: State, posed: bool, lidar: Lidar, left_out: LeftOut
) -> Iterator[tuple[int, Moment]]:
    """Scans with their states; those of no use are counted."""
    last_s = -math.inf
    for scan, after_s in _pair_with_next_time(sequence):
        reason = OUT_OF_ORDER if scan.time_s <= last_s else ""
        if last_s < after_s < scan.time_s:
            reason = AHEAD_OF_TIME
        if not reason and posed and scan.state is None:
            reason = NO_POSE
        cloud = None if reason else left_out.read(scan)
        if cloud is not None and not cloud.complete:
            reason, cloud = INCOMPLETE, None
        if reason:
            left_out.add(reason, scan)
        if cloud is None:
            continue
        last_s = scan.time_s
        state = scan.state if posed and scan.state is not None else still
        yield (
            scan.index,
            Moment(
                replace(state, time_s=scan.time_s),
                Scan(cloud.points_m, scan.time_s, sensor=lidar.name),
            ),
        )


def _pair_with_next_time(sequence: ScanSequence) -> Iterator[tuple[TimedScan, float]]:
    """Scans, and when the next one is."""
    held: TimedScan | None = None
    for scan in sequence:
        if held is not None:
            yield held, scan.time_s
        held = scan
    if held is not None:
        yield held, math.inf


def _play(
    system: AvoidanceSystem, moments: Iterator[tuple[int, Moment]]
) -> Iterator[tuple[int, PlayedScan]]:
    for index, moment in moments:
        for played in play(system, [moment]):
            yield index, played
