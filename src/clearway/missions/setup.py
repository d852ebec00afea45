"""From a mission file's values to everything that a simulated flight needs, and to the flight."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.base.brief import brief
from clearway.base.errors import FlightRefusedError, InputError
from clearway.base.grid import AvoidanceGrid
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.live.preflight.doubts import over_level, over_reach, over_span
from clearway.live.preflight.escape_plan import EscapePlan, escape_plan
from clearway.live.preflight.fineness import too_coarse, what_beams_hold, what_limits_speed
from clearway.live.preflight.sight import expect_of_sight
from clearway.live.preflight.tight_turns import over_turns
from clearway.live.routing.route import check_mission
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_maps import mission_maps
from clearway.missions.mission_place import NOWHERE, MissionPlace, mission_place
from clearway.missions.mission_traffic import RecordedAir, mission_traffic
from clearway.missions.mission_world import mission_world, refuse_absent_files
from clearway.missions.rule_sections import mission_rules
from clearway.missions.sections import values_for
from clearway.missions.sensor_section import AnyKind, mission_sensors
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import World
from clearway.reach import ReachLibrary
from clearway.sensors import Lidar
from clearway.sensors.beams.simulate import Scanner
from clearway.sim import OnDecision, Run, SimulationSettings, simulate
from clearway.sim.baselines import REPORTED_TRAFFIC, Craft, Danger, Source, pilot_named
from clearway.sim.faults import Faults
from clearway.sim.kept_scans import KeepingScanner, TakesScans
from clearway.sim.lying_lidar import LyingLidar
from clearway.sim.pilot import D, Pilot, Steering
from clearway.sim.plants import PlantKind
from clearway.sim.scripted import AirTraffic, ScriptedIntruder, Traffic, TrafficSettings
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import MOST_MOVEMENTS

if TYPE_CHECKING:
    from clearway.live.guard.guardian import Guardian

Notice = Callable[[str], None]
"""Called with a sentence for the user."""


@dataclass(frozen=True, eq=False)
class FlightSetup:
    """A mission, ready to be flown any number of times."""

    planner: Planner
    craft: Craft
    """What baselines know of the vehicle."""
    mission: Mission
    sensors: tuple[AnyKind, ...]
    world: World
    """What is really there."""
    obstacle_map: ObstacleMap
    """What is reported to the vehicle."""
    simulation: SimulationSettings
    script: tuple[ScriptedIntruder, ...]
    """Intruders that appear."""
    traffic: TrafficSettings
    recorded: RecordedAir | None = None
    """Real traffic that plays around the flight."""
    plant: PlantKind | None = None
    """What truly moves; None for what does as the automaton predicts."""
    lies: tuple[LyingLidar, ...] = ()
    """LiDARs that tell the system something else than what is there."""
    notes: tuple[str, ...] = ()
    """What was left out or assumed while reading the mission's files."""
    place: MissionPlace = NOWHERE
    """Where on Earth and when, as far as the mission says."""
    standing: frozenset[Danger] = frozenset()
    """What stands there, by who tells of it."""

    __repr__ = brief

    @property
    def lidars(self) -> tuple[Lidar, ...]:
        """The LiDARs among the sensors."""
        return tuple(one for one in self.sensors if isinstance(one, Lidar))

    @property
    def dangers(self) -> frozenset[Danger]:
        """What can be hit, by who tells of it: what stands there, and what flies."""
        found = {_find_danger(one, seen=bool(self.sensors)) for one in self.script}
        if self.recorded is not None:
            found.add(REPORTED_TRAFFIC)
        return self.standing | found

    @property
    def escape(self) -> EscapePlan:
        """Which escapes clearway holds on this flight, and why."""
        return escape_plan(self.planner, self.sensors, self.obstacle_map, self.mission.start)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What the pilot to its waypoints has to know, beside `notes` and `escape`."""
        told = (
            over_reach(self.mission, self.planner.automaton),
            over_turns(self.mission, self.planner.automaton),
            over_level(self.mission, self.planner.automaton, self.sensors),
            over_span(self.mission, self.planner),
        )
        return tuple(doubt for doubt in told if doubt is not None)

    @property
    def kept_out(self) -> World | None:
        """Volumes that rules keep out of; None without any."""
        volumes = [volume for rule in self.planner.rules for volume in rule.volumes]
        return ObstacleMap(volumes) if volumes else None

    def system(self) -> AvoidanceSystem:
        """A fresh system on the ground."""
        return AvoidanceSystem(
            self.planner, self.mission, lidars=self.sensors, obstacle_map=self.obstacle_map
        )

    def guardian(self, hold_s: float, acceleration_mps2: float | None) -> Guardian:
        """A fresh guardian for the vehicle of the mission; its goals count for nothing."""
        from clearway.live.guard.guardian import Guardian  # Most flights have none.

        return Guardian(
            self.planner,
            self.mission.start,
            lidars=self.sensors,
            obstacle_map=self.obstacle_map,
            hold_s=hold_s,
            acceleration_mps2=acceleration_mps2,
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
        self._refuse(reasons)
        self.refuse_coarse_beams()

    def refuse_coarse_beams(self) -> None:
        """Raise FlightRefusedError if the beams are too coarse for the smallest object declared."""
        reason = too_coarse(self.planner, self.lidars)
        self._refuse([] if reason is None else [reason])

    def _refuse(self, reasons: Sequence[str]) -> None:
        if reasons:
            raise FlightRefusedError(
                "\n".join(f"mission {self.mission.name!r} refused: {reason}" for reason in reasons)
            )

    def fly(self, on_decision: OnDecision | None = None) -> Run:
        """Refuse or fly."""
        return self._fly(self.system(), on_decision)

    def fly_with(
        self,
        planner: str,
        on_decision: OnDecision[Steering] | None = None,
        folder: Path | None = None,
        scans: TakesScans | None = None,
    ) -> Run[Steering]:
        """As `fly`, with a planner by name or a user's own; raises ClearwayError for others.

        folder: where modules of users are looked for before the current one. scans: takes every
        reading of the sensors.
        """
        pilot = pilot_named(planner, self.system(), self.craft, folder)
        run = self._fly(pilot, on_decision, scans=scans)
        return replace(run, planner=planner)

    def fly_deaf(self) -> Run:
        """As `fly`, but nothing of the recorded traffic is reported to the ownship."""
        return self._fly(self.system(), None, deaf=True)

    def _fly(
        self,
        pilot: Pilot[D],
        on_decision: OnDecision[D] | None,
        *,
        deaf: bool = False,
        scans: TakesScans | None = None,
    ) -> Run[D]:
        self.refuse_impossible()
        traffic = self._traffic(deaf)
        lies = {lie.name: lie for lie in self.lies}
        scanners: list[Lidar | Scanner] = [lies.get(one.name, one) for one in self.sensors]
        if scans is not None:
            scanners = [KeepingScanner(scanner, scans) for scanner in scanners]
        return simulate(
            pilot,
            self.world,
            lidars=scanners,
            settings=self.simulation,
            on_decision=on_decision,
            traffic=traffic,
            plant=self.plant,
        )

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
    refuse_absent_files(file)
    grid, automaton = file.grid.to_grid(), file.vehicle.to_automaton()
    check_scale(file, automaton, grid)
    library = ReachLibrary.load_or_build(
        automaton, grid, method=file.reach_set.method, notice=notice
    )
    mission = file.to_mission()
    maps = mission_maps(file)
    recorded = mission_traffic(file)
    world = mission_world(file, maps)
    rules = mission_rules(file.rules, file.keep_out, maps.ground, file.mission.name)
    planner = Planner.of(library, file.to_avoidance(), rules=rules)
    turning_radius_m = file.safety.conservative_turning_radius_m or automaton.turning_radius_m
    lies = (part.to_lie(grid) for part in file.lidar)
    sensors = mission_sensors(file.lidar, file.sensor, grid, file.mission.name)
    lidars = [one for one in sensors if isinstance(one, Lidar)]
    held, limits = what_beams_hold(planner, lidars), what_limits_speed(planner, lidars)
    sight = expect_of_sight(planner, sensors)
    return FlightSetup(
        planner=planner,
        craft=Craft(planner, file.vehicle.body_radius_m, turning_radius_m),
        mission=mission,
        sensors=sensors,
        world=world.there,
        obstacle_map=world.charted,
        simulation=_simulation(file, file.faults.to_faults()),
        script=tuple(part.to_scripted(file.traffic.spawn) for part in file.intruder),
        traffic=file.traffic.to_settings(),
        recorded=recorded,
        plant=file.vehicle.to_plant(),
        lies=tuple(lie for lie in lies if lie is not None),
        notes=(() if file.scale_note is None else (file.scale_note,))
        + maps.notes
        + (recorded.notes if recorded is not None else ())
        + world.notes
        + (() if held is None else (held,))
        + (() if limits is None else (limits,))
        + (() if sight is None else (sight,)),
        place=mission_place(file, maps, recorded),
        standing=world.standing,
    )


def _find_danger(intruder: ScriptedIntruder, *, seen: bool) -> Danger:
    reported = REPORTED_TRAFFIC if intruder.transponder else frozenset()
    return reported | ({Source.SENSORS} if seen and intruder.visible else set())


def check_scale(file: MissionFile, automaton: MovementAutomaton, grid: AvoidanceGrid) -> None:
    """Refuse movements that are out of proportion to what the vehicle sees."""
    step, needed = automaton.step_m, automaton.room_to_turn_m + file.safety.margin_m
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


def _simulation(file: MissionFile, faults: Faults) -> SimulationSettings:
    sigma_rad = float(np.radians(file.simulation.attitude_sigma_deg))
    return SimulationSettings(
        **values_for(SimulationSettings, file.simulation),
        attitude_sigma_rad=sigma_rad,
        faults=faults,
    )
