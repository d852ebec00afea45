"""What range sensors told: latest scans, memory of earlier ones, and who is believed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards, no_points
from clearway.avoidance.plan.held_escape import Escape
from clearway.avoidance.plan.planner import Planner
from clearway.base.checks import vector_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.state import State
from clearway.live.dynamic_objects import (
    DynamicObjectSettings,
    Following,
    follow,
    forget_dynamic_objects,
)
from clearway.live.inputs.reaction import smallest_object_m
from clearway.live.inputs.sifted_scans import HELD_BACK, SiftedScans
from clearway.sensors import (
    Court,
    Detection,
    Ground,
    Lidar,
    LidarSensor,
    PointMemory,
    RangeSensor,
    Scan,
    detect_nothing,
    hear_reading,
    remember_reading,
)
from clearway.sensors.memory.point_memory import CAPACITY
from clearway.sensors.observed.free_space import FreeSpace
from clearway.traffic import Intruder
from clearway.vehicle.scale import MEMORY_REACH, MEMORY_VOXEL, voxel_m

SEEN_REACH = 1.2
"""How far away free space is marked, in ranges of the grid or of escapes."""
MEMORY_BEAMS = 1.75
"""Beam spacings that a voxel is wide at least, of a vehicle with inertia: finer ones hold a return
each, and fill a memory in ten scans."""
MEMORY_BALLS = 16_000
"""Balls that a vehicle with inertia remembers: it decides often, by what is near."""


def free_space_for(
    planner: Planner, start_m: FloatArray, complete_m: FloatArray | None = None
) -> FreeSpace:
    """Nothing seen yet, a ball about the start that counts as free, and where the escape may go by
    the map, the box in which that is declared complete."""
    settings = planner.settings
    return FreeSpace(
        voxel_m(settings.safety_margin_m, planner.grid.range_m),
        start_m,
        _start_free_m(planner),
        reach_m=SEEN_REACH * max(planner.grid.range_m, planner.escape_reach_m),
        complete_m=complete_m if settings.escape == Escape.MAPPED else None,
        span_m=settings.obstacles_span_m,
        smallest_m=smallest_object_m(planner),
        finds_all=planner.automaton.can_stop,
    )


def _start_free_m(planner: Planner) -> float:
    declared_m = planner.settings.start_free_m
    return start_room_m(planner) if declared_m is None else declared_m


def start_room_m(planner: Planner) -> float:
    """How far about the start counts as free unasked: as far as a movement leads; of a vehicle with
    inertia, which begins at rest, what its body and its margin take."""
    automaton, settings = planner.automaton, planner.settings
    if automaton.classes is None or not automaton.has_inertia:
        return automaton.step_m
    tube_m = float(automaton.classes.class_tube_m[automaton.classes.first])
    return settings.body_radius_m + settings.safety_margin_m + tube_m


class RangeSensing:
    """All that scans have shown up to now; the arguments are those of `live.AvoidanceSystem`."""

    def __init__(
        self,
        planner: Planner,
        sensors: Mapping[str, RangeSensor],
        *,
        start_m: FloatArray,
        complete_m: FloatArray | None = None,
    ) -> None:
        self.sensors = sensors
        self.sigma_m = min((sensor.sigma_m for sensor in sensors.values()), default=0.0)
        """Standard deviation of the range of the best sensor; 0 without any."""
        self._planner = planner
        ground = planner.settings.ground_height_m
        self._ground_m = -np.inf if ground is None else ground
        self._scans: dict[str, Scan] = {}
        margin, reach = planner.settings.safety_margin_m, planner.grid.range_m
        decides_s = max(movement.duration_s for movement in planner.automaton.movements)
        settings = DynamicObjectSettings.of(margin, planner.speed_mps, decides_s)
        self._following = Following(settings) if planner.settings.follow_movers else None
        self.free_space: FreeSpace | None = None
        """What was seen to be free: escapes have to lead through it, or at least those out of dead
        ends are sought in it."""
        mapped = planner.settings.escape == Escape.MAPPED and complete_m is not None
        if (sensors or mapped) and planner.escapes is not None:
            self.free_space = free_space_for(planner, start_m, complete_m)
        self.memory_reach_m = max(MEMORY_REACH * reach, planner.escape_reach_m + 2.0 * margin)
        """How far from the vehicle nothing is forgotten but on evidence."""
        # One each: no sensor wipes out what another has seen.
        self._memories = {
            name: _nothing_remembered(planner, sensor, self.memory_reach_m)
            for name, sensor in sensors.items()
        }
        self._sifted = SiftedScans(planner, sensors)
        # Alone, a sensor has nobody to contradict it.
        court = Court.of(sensors, margin, reach, planner.speed_mps)
        self._court = court if len(sensors) > 1 else None

    # --- scans ----------------------------------------------------------------------------

    def flaw_of(self, scan: Scan) -> str | None:
        """Why a scan cannot be used, or None."""
        if scan.sensor in self._scans and scan.time_s <= self._scans[scan.sensor].time_s:
            return "scan: late or repeated"
        return None

    def take(self, scan: Scan, state: State) -> Mapping[str, int]:
        """Take a scan without flaw, and the own state estimate of its time; what is left out, by
        reason."""
        self._scans[scan.sensor] = scan
        sensor, sigmas = self.sensors[scan.sensor], self._planner.settings.sigmas
        counts, memory, before = self._sifted.take(
            sensor, scan, state, self._memories[scan.sensor], self.free_space, self._ground_m
        )
        self._memories[scan.sensor] = remember_reading(
            memory,
            sensor,
            counts.scan,
            state,
            tolerance_m=sigmas * state.position_std_m,
            angle_rad=sigmas * state.attitude_std_rad,
            ground_m=self._ground_m,
            hiding_m=counts.hiding_m,
        )
        if self._court is not None:
            self._court = hear_reading(
                self._court, self.sensors, scan, state, sigmas=sigmas, ground_m=self._ground_m
            )
        if self.free_space is not None and self.believes(scan.sensor):
            if before is not None and isinstance(sensor, LidarSensor):
                off_m = sigmas * before.state.position_std_m
                self.free_space.correct(sensor.lidar, *before, off_m)
            self.free_space.take(sensor, scan, state, sigmas * state.position_std_m)
            # What is declared free is so only as far as nothing is seen to stand there.
            near = self._memories[scan.sensor].near(*self.free_space.start)
            self.free_space.withdraw_start(*near)
        if self.believes(scan.sensor) and isinstance(sensor, LidarSensor):
            self._follow(sensor.lidar, scan, state)
        return _count_left_out(self._memories[scan.sensor], self._sifted.count_held(scan.sensor))

    def begin_at(self, place_m: FloatArray) -> None:
        """Count the ball about another place than the start as free, where the vehicle is handed
        over elsewhere; never over a return. Raises ClearwayError for what is no place."""
        problem = vector_problem("begin_at", place_m, 3)
        if problem:
            raise ClearwayError(problem)
        free = self.free_space
        if free is None:
            return
        middle_m, radius_m = free.start
        within_m = radius_m - self._planner.settings.body_radius_m
        if float(np.linalg.norm(place_m - middle_m)) <= within_m:
            return
        free.begin_at(place_m, _start_free_m(self._planner))
        for _, memory in self._list_believed_memories():
            free.withdraw_start(*memory.near(*free.start))

    def forget_free_space(self) -> None:
        """Count nothing as seen to be free any more; what was seen to stand there stays."""
        if self.free_space is not None:
            self.free_space.forget()

    def _follow(self, lidar: Lidar, scan: Scan, state: State) -> None:
        """Find what moves, and leave no ghost of it behind."""
        if self._following is None:
            return
        sigmas = self._planner.settings.sigmas
        following = follow(
            self._following, lidar, scan, state, sigmas=sigmas, ground_m=self._ground_m
        )
        self._following = following
        self._memories = {
            name: forget_dynamic_objects(memory, following)
            for name, memory in self._memories.items()
        }

    # --- who is believed ------------------------------------------------------------------

    def believes(self, name: str) -> bool:
        """Whether a sensor counts at all."""
        return self._court is None or self._court.believes(name)

    @property
    def trust(self) -> dict[str, float]:
        """Present trust by sensor; what is not believed at all is at 0."""
        if self._court is None:
            return {name: sensor.standing.trust for name, sensor in self.sensors.items()}
        return {
            name: record.trust if record.believed else 0.0
            for name, record in self._court.records.items()
        }

    # --- what is known now ----------------------------------------------------------------

    @property
    def sees_m(self) -> float:
        """How far the LiDAR that sees farthest shows its way to be free; 0 without any."""
        lidars = (each.lidar for each in self.sensors.values() if isinstance(each, LidarSensor))
        return max((lidar.clears_to_m for lidar in lidars), default=0.0)

    @property
    def false_share(self) -> float:
        """Estimated share of the beams of a LiDAR with false returns, of the worst one."""
        shares = (sieve.share for name, sieve in self._sifted.sieves.items() if self.believes(name))
        return max(shares, default=0.0)

    @property
    def dynamic_objects(self) -> list[Intruder]:
        """Bodies that have proved to move."""
        return [] if self._following is None else self._following.intruders()

    def silent(self, now_s: float) -> list[str]:
        """Names of the sensors without a fresh scan."""
        return [name for name in self.sensors if not self._is_fresh(name, now_s)]

    @property
    def last_scan_s(self) -> float | None:
        """Time of the latest scan of any sensor; None before the first."""
        return max((scan.time_s for scan in self._scans.values()), default=None)

    def usable_scans(self, now_s: float) -> dict[str, Scan]:
        """By sensor, the latest scan of those that are fresh and believed."""
        return {
            name: self._scans[name]
            for name in self.sensors
            if self._is_fresh(name, now_s) and self.believes(name)
        }

    def _is_fresh(self, name: str, now_s: float) -> bool:
        fresh_s = self._planner.settings.scan_s
        return name in self._scans and now_s - self._scans[name].time_s <= fresh_s

    def detections(
        self, scans: Mapping[str, Scan], frame: GridFrame, own_state_at: Callable[[float], State]
    ) -> list[Detection]:
        """One per sensor, in a grid's frame; without a scan all is unobserved."""
        return [
            self._detection(scans[name], frame, own_state_at(scans[name].time_s))
            if name in scans
            else detect_nothing(self._planner.grid, sensor)
            for name, sensor in self.sensors.items()
        ]

    def _detection(self, scan: Scan, frame: GridFrame, pose: State) -> Detection:
        """pose: the own state estimate when the scan was taken."""
        detection = self.sensors[scan.sensor].detect(
            self._planner.grid,
            scan,
            grid_from_body=frame.grid_from_body(pose),
            rule=self._planner.settings.detection,
            ground=self._ground(frame),
        )
        if self._court is None:
            return detection
        return detection.weighing(self._court.records[scan.sensor].weight)

    def _ground(self, frame: GridFrame) -> Ground | None:
        """Ground that is no obstacle, as the grid of a decision sees it."""
        if self._ground_m == -np.inf:
            return None
        return Ground(frame.up, self._ground_m - float(frame.origin_m[2]), 0.0)

    def list_remembered_near(self, position_m: FloatArray, margin_m: float) -> PointHazards:
        """Points of this and earlier scans that a trajectory from there could come near to.

        Those of sensors that measure worse than the best are grown by the difference here, since a
        decision grows all alike.
        """
        settings = self._planner.settings
        reach = max(self._planner.grid.range_m, self._planner.escape_reach_m)
        reach += max(2.0 * settings.safety_margin_m, margin_m)
        best = self.sigma_m
        near = []
        for name, memory in self._list_believed_memories():
            place, radius = memory.near(position_m, reach)
            worse = self.sensors[name].sigma_m - best
            near.append((place, radius + settings.point_sigmas * worse if worse else radius))
        return _together(near + self._at_once)

    @property
    def remembered(self) -> PointHazards:
        """What is reported of this and earlier scans."""
        told = [memory.told for _, memory in self._list_believed_memories()]
        return _together(told + self._at_once)

    @property
    def _at_once(self) -> list[tuple[FloatArray, FloatArray]]:
        """Balls of lone returns that are too near to wait."""
        return [
            sieve.at_once
            for name, sieve in self._sifted.sieves.items()
            if len(sieve.at_once.radius_m) and self.believes(name)
        ]

    def _list_believed_memories(self) -> Iterable[tuple[str, PointMemory]]:
        return ((name, memory) for name, memory in self._memories.items() if self.believes(name))


def _nothing_remembered(planner: Planner, sensor: RangeSensor, reach_m: float) -> PointMemory:
    """The memory of a sensor before its first scan."""
    settings, has_inertia = planner.settings, planner.automaton.has_inertia
    wide_m, widest_m = MEMORY_VOXEL * settings.safety_margin_m, np.inf
    if has_inertia and isinstance(sensor, LidarSensor) and sensor.lidar.pattern.spacing_rad > 0.0:
        widest_m = wide_m / (MEMORY_BEAMS * sensor.lidar.pattern.spacing_rad)
    return PointMemory.empty(
        wide_m,
        settings.memory_s,
        reach_m=reach_m,
        capacity=MEMORY_BALLS if has_inertia else CAPACITY,
        smallest_m=settings.smallest_object_m or 0.0,
        widest_m=widest_m,
    )


def _count_left_out(memory: PointMemory, held: int) -> Mapping[str, int]:
    """What the latest sweep made a memory leave out, or hold more coarsely."""
    if not (memory.merged or memory.dropped or memory.too_small or held):
        return {}
    return +Counter(
        {
            "memory: full, so returns were merged into larger balls": memory.merged,
            "memory: full, so returns out of reach were forgotten": memory.dropped,
            "memory: returns of things smaller than smallest_object_m": memory.too_small,
            HELD_BACK: held,
        }
    )


def _together(balls: Sequence[tuple[FloatArray, FloatArray]]) -> PointHazards:
    """Balls of several sensors as one."""
    if len(balls) == 1:
        return PointHazards(*balls[0])
    if not balls:
        return no_points()
    return PointHazards(
        np.concatenate([place for place, _ in balls]),
        np.concatenate([radius for _, radius in balls]),
    )
