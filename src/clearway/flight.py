"""From a mission file's values to everything that a simulated flight needs, and to the flight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clearway.baselines import CLEARWAY, BaselinePilot, Craft, rule_named
from clearway.costs import Prices
from clearway.errors import FlightRefusedError, InputError
from clearway.grid import AvoidanceGrid
from clearway.intruders import TrackerSettings
from clearway.io.lidar_section import LidarSection
from clearway.io.mission_file import OWN_ADDRESS, MissionFile
from clearway.io.mission_maps import mission_maps
from clearway.io.mission_traffic import RecordedAir, mission_traffic
from clearway.io.place_sections import PointCloudSection
from clearway.io.rule_sections import mission_rules
from clearway.io.traffic_sections import FlyingIntruderSection
from clearway.mission import Mission
from clearway.movements import MovementAutomaton
from clearway.obstacle_map import ObstacleMap
from clearway.pilot import D, Pilot, Steering
from clearway.planner import AvoidanceSettings, Planner
from clearway.point_world import PointWorld
from clearway.reach import ReachLibrary
from clearway.recordings.aircraft import LONGEST_GAP_S
from clearway.route import check_mission
from clearway.sensors import BeamPattern, Lidar, Mounting, Standing, named_pattern
from clearway.sensors.detection import Rule
from clearway.sensors.lies import LyingLidar
from clearway.simulation import OnDecision, Run, SimulationSettings, simulate
from clearway.state import State
from clearway.system import AvoidanceSystem, DataLimits
from clearway.traffic import AirTraffic, ScriptedIntruder, Spawn, Traffic, TrafficSettings
from clearway.world import CombinedWorld, World

MOST_MOVEMENTS = 100
"""Movements that may fit in the range of the grid: more make trees that nobody needs."""
COAST_S = 30.0
"""How long an aircraft of a recording is believed to fly on without a report."""
Notice = Callable[[str], None]
"""Called with a sentence for the user."""


@dataclass(frozen=True, eq=False)
class FlightSetup:
    """A mission, ready to be flown any number of times."""

    planner: Planner
    craft: Craft
    """What baselines know of the vehicle."""
    mission: Mission
    lidars: tuple[Lidar, ...]
    world: World
    """What is really there."""
    obstacle_map: ObstacleMap
    """What the vehicle is told."""
    simulation: SimulationSettings
    limits: DataLimits
    detection_rule: Rule
    ground_m: float
    script: tuple[ScriptedIntruder, ...]
    """Intruders that appear."""
    traffic: TrafficSettings
    follow_movers: bool
    tracker: TrackerSettings | None
    recorded: RecordedAir | None = None
    """Real traffic that plays around the flight."""
    lies: tuple[LyingLidar, ...] = ()
    """LiDARs that tell the system something else than what is there."""
    notes: tuple[str, ...] = ()
    """What was left out or assumed while reading the mission's files."""

    @property
    def kept_out(self) -> World | None:
        """Volumes that rules keep out of; None without any."""
        volumes = [volume for rule in self.planner.rules for volume in rule.volumes]
        return ObstacleMap(volumes) if volumes else None

    def system(self) -> AvoidanceSystem:
        """A fresh system on the ground."""
        return AvoidanceSystem(
            self.planner,
            self.mission,
            self.lidars,
            self.obstacle_map,
            limits=self.limits,
            detection_rule=self.detection_rule,
            ground_m=self.ground_m,
            follow_movers=self.follow_movers,
            tracker=self.tracker,
            address=OWN_ADDRESS,
        )

    def refuse_impossible(self) -> None:
        """Raise FlightRefusedError with the reasons if the map shows that the mission cannot be."""
        reasons = check_mission(
            np.concatenate([self.mission.start.position_m[None], self.mission.goals_m]),
            self.obstacle_map,
            self.planner.settings.safety_margin_m,
            self.mission.reach_radius_m,
        )
        start = self.mission.start.position_m
        inside = -float(self.world.distance_m(start[None])[0])
        if inside > 0.0:
            reasons.append(f"the start lies {inside:.2f} m inside something that is really there")
        if reasons:
            raise FlightRefusedError(
                "\n".join(f"mission {self.mission.name!r} refused: {reason}" for reason in reasons)
            )

    def fly(self, on_decision: OnDecision | None = None) -> Run:
        """Refuse or fly; the decisions of the flight never compile, a warm-up has done it."""
        return self._flown(self.system(), on_decision)

    def fly_with(
        self, planner: str, on_decision: OnDecision[Steering] | None = None
    ) -> Run[Steering]:
        """As `fly`, with clearway or a baseline by name; raises ClearwayError for other names."""
        if planner == CLEARWAY:
            return self._flown(self.system(), on_decision)
        rule = rule_named(planner, self.craft)
        return self._flown(BaselinePilot(self.system(), rule), on_decision)

    def fly_deaf(self) -> Run:
        """As `fly`, but nothing of the recorded traffic is told to the ownship."""
        return self._flown(self.system(), None, deaf=True)

    def _flown(
        self, pilot: Pilot[D], on_decision: OnDecision[D] | None, *, deaf: bool = False
    ) -> Run[D]:
        self.refuse_impossible()
        pilot.warm_up()
        traffic = self._traffic(deaf)
        lies = {lie.name: lie for lie in self.lies}
        scanners = [lies.get(lidar.name, lidar) for lidar in self.lidars]
        return simulate(pilot, self.world, scanners, self.simulation, on_decision, traffic)

    def _traffic(self, deaf: bool) -> AirTraffic | None:
        """Fresh traffic for one flight."""
        if self.recorded is not None:
            return self.recorded.play(deaf=deaf)
        if not self.script:
            return None
        speed = self.planner.speed_mps
        return Traffic(self.script, self.mission, speed, self.traffic, self.simulation.seed)


def prepare(file: MissionFile, notice: Notice | None = None) -> FlightSetup:
    """Build automaton, reach sets, sensors and worlds of a mission.

    Raises InputError for files that cannot be read and values that contradict each other.
    """
    grid = file.grid.to_grid()
    vehicle, ground = file.vehicle, file.safety.ground_height_m
    automaton = MovementAutomaton.plane(
        vehicle.speed_mps, vehicle.turn_step_deg, vehicle.movement_s, vehicle.pitch_limit_deg
    )
    _check_scale(file, automaton, grid)
    library = ReachLibrary.load_or_build(automaton, grid, file.reach_set.method, notice=notice)
    start = State(np.array(vehicle.position_m), np.radians(vehicle.attitude_deg))
    mission = Mission(
        file.mission.name,
        start,
        np.array(file.mission.waypoints_m),
        file.mission.reach_radius_m,
        np.array(file.mission.landing_m).reshape(-1, 3),
        file.mission.pass_within_m,
    )
    there = [part.to_obstacle() for part in file.obstacle if part.known != "map"]
    charted = [part.to_obstacle() for part in file.obstacle if part.known != "world"]
    maps = mission_maps(file)
    there.extend(maps.there)
    charted.extend(maps.charted)
    worlds: list[World] = [ObstacleMap(there)]
    recorded = mission_traffic(file)
    notes = maps.notes + (recorded.notes if recorded is not None else ())
    if file.point_cloud is not None:
        cloud, left_out = point_world(file.point_cloud)
        notes += left_out
        worlds.append(cloud)
    rules = mission_rules(file.rules, file.keep_out, maps.ground, file.mission.name)
    planner = Planner.of(library, avoidance_settings(file), rules=rules)
    return FlightSetup(
        planner=planner,
        craft=Craft(
            planner,
            vehicle.body_radius_m,
            file.safety.conservative_turning_radius_m or automaton.turning_radius_m,
        ),
        mission=mission,
        lidars=tuple(lidar_of(part, grid) for part in file.lidar),
        world=worlds[0] if len(worlds) == 1 else CombinedWorld(worlds),
        obstacle_map=ObstacleMap(charted),
        simulation=SimulationSettings(
            **file.simulation.model_dump(), faults=file.faults.to_faults()
        ),
        limits=DataLimits(patience_turns=file.safety.patience_turns),
        detection_rule=file.rating.detection,
        ground_m=-np.inf if ground is None else ground,
        script=tuple(_scripted(part, file.traffic.spawn) for part in file.intruder),
        traffic=TrafficSettings(
            file.traffic.position_sigma_m,
            file.traffic.velocity_sigma_mps,
            file.traffic.deviates,
            file.traffic.report_s,
        ),
        follow_movers=file.traffic.follow_movers,
        tracker=_tracker(file),
        recorded=recorded,
        lies=tuple(
            LyingLidar(lidar_of(part, grid), part.lie, part.lies_from_s)
            for part in file.lidar
            if part.lie != "none"
        ),
        notes=notes,
    )


def _tracker(file: MissionFile) -> TrackerSettings | None:
    """Recordings hold fewer reports than a receiver hears, so silence means less there."""
    if not file.traffic.tracker:
        return None
    if file.traffic.recording is None:
        return TrackerSettings()
    return TrackerSettings(stale_s=LONGEST_GAP_S, coast_s=COAST_S)


def _check_scale(file: MissionFile, automaton: MovementAutomaton, grid: AvoidanceGrid) -> None:
    """Refuse movements that are out of proportion to what the vehicle sees."""
    step, needed = automaton.step_m, automaton.turning_radius_m + file.safety.margin_m
    if grid.range_m > MOST_MOVEMENTS * step:
        raise InputError(
            f"mission {file.mission.name!r}",
            f"vehicle.speed_mps x movement_s: a movement of {step:.3g} m is too short for a grid "
            f"of {grid.range_m:.3g} m; at most {MOST_MOVEMENTS} movements may fit in its range",
        )
    if grid.range_m < step + needed:
        raise InputError(
            f"mission {file.mission.name!r}",
            f"grid.range_m: {grid.range_m:.3g} m is too short to turn away in time; one movement "
            f"({step:.3g} m), the turning radius and the margin ({needed:.3g} m) must fit in it",
        )


def _scripted(part: FlyingIntruderSection, spawn: Spawn) -> ScriptedIntruder:
    return ScriptedIntruder(
        part.name,
        part.appears_s,
        np.array(part.position_m),
        np.array(part.velocity_mps),
        np.radians(part.spread_deg),
        part.radius_m,
        spawn,
        part.transponder,
        part.seen_by_lidar,
    )


def avoidance_settings(file: MissionFile) -> AvoidanceSettings:
    """How decisions of a mission are taken."""
    rating, safety = file.rating, file.safety
    return AvoidanceSettings(
        rating=rating.name,
        unknown=rating.unknown,
        unknown_unseen=rating.unknown_unseen,
        threshold=rating.threshold,
        verify=file.verify.method == "evidence",
        safety_margin_m=safety.margin_m,
        sigmas=safety.sigmas,
        own_drift_mps=safety.own_drift_mps,
        intruder_models=file.traffic.models,
        point_sigmas=safety.point_sigmas,
        prices=Prices(**file.prices.model_dump()),
        sensor_fusion=rating.sensors,
    )


def lidar_of(section: LidarSection, grid: AvoidanceGrid) -> Lidar:
    """A sensor with its beams: evenly through the grid's cells unless the file says otherwise."""
    far = section.max_range_m or grid.range_m
    if section.pattern is not None:
        pattern = named_pattern(section.pattern)
    elif section.azimuth_deg is not None:
        pattern = BeamPattern.from_angles(
            np.radians(section.azimuth_deg),
            np.radians(section.elevation_deg or ()),
            min_range_m=section.min_range_m,
            max_range_m=far,
        )
    else:
        pattern = BeamPattern.per_cell(
            grid,
            *(section.beams_per_cell or (20, 10)),
            min_range_m=section.min_range_m,
            max_range_m=far,
        )
    return Lidar(
        section.name,
        pattern,
        Mounting(np.array(section.position_m), np.radians(section.attitude_deg)),
        section.sigma_m,
        section.dropout,
        section.airframe_radius_m,
        Standing(section.precision, section.trust),
    )


def point_world(section: PointCloudSection) -> tuple[PointWorld, tuple[str, ...]]:
    """A surveyed place as balls at its points, and what was left out of it."""
    from clearway.io.pointcloud import read_points

    cloud = read_points(section.file)
    points = cloud.points_m
    keep = np.ones(len(points), dtype=np.bool_)
    if section.leave_out_classes:
        if cloud.classes is None:
            raise InputError(section.file, "leave_out_classes: the file has no classes")
        keep = ~np.isin(cloud.classes, section.leave_out_classes)
    if not keep.any():
        raise InputError(section.file, "leave_out_classes: no point is left")
    if section.origin_m == "lowest-corner":
        points = points - points.min(axis=0)
    elif section.origin_m != "file":
        points = points - np.array(section.origin_m)
    left_out = [f"{number} points left out: {reason}" for reason, number in cloud.counts.items()]
    if not keep.all():
        left_out.append(f"{int((~keep).sum())} points left out: class not wanted")
    world = PointWorld(np.ascontiguousarray(points[keep]), section.point_radius_m)
    return world, tuple(f"{section.file}: {note}" for note in (*left_out, *cloud.notes))
