"""One moment assessed: everything known at an instant, and what it means cell by cell.

`assess_scene` is the cycle of `avoidance.decide` without the decision, for looking at a scene. It
knows no files: `clearway.missions.scene_reading` reads them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.avoidance.fusion import (
    CellAssessment,
    Evidence,
    ReachAssessment,
    assess_cells,
    rate_reach_set,
    rating_named,
)
from clearway.base.brief import brief, in_brief, one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.state import IntArray, State
from clearway.obstacles.cells import base_probability
from clearway.obstacles.cells import coated_cells as coated_by_map
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.sets import build_reach_set
from clearway.reach.store import Notice, ReachLibrary
from clearway.reach.tree import ReachSet
from clearway.sensors import Detection, Lidar, Scan, combine_detections, detect
from clearway.sensors import coated_cells as coated_by_points
from clearway.sensors.detection import Rule
from clearway.sensors.space import SpaceCells, classify_space
from clearway.traffic import (
    Intruder,
    IntruderCells,
    VehicleTimes,
    assess_intruders,
    combine_intruders,
    radial_vehicle_times,
    reach_set_vehicle_times,
    up_seen_from,
)
from clearway.vehicle.automaton import MovementAutomaton

MOST_MOVEMENTS = 100
"""In a row; reach sets of more would not fit into memory."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneScan:
    """One scan of one LiDAR, and where its beam pattern is from."""

    lidar: Lidar
    scan: Scan
    pattern_from: str
    """"stated", "file" (which names the sensor), "estimated" or "simulated"."""

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class SceneIntruder:
    """One intruder in the world frame, and how it is to be counted."""

    intruder: Intruder
    models: tuple[str, ...] = ("line",)
    timed: bool | str = False
    """False, True for the paper's (5.5), or the name of a timed rule."""
    up: FloatArray | None = None
    """[3] world up in the grid's frame; None as the state says."""

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class ReachSettings:
    """The reach set to rate."""

    method: str = "flying"
    tuning: Mapping[str, float] = field(default_factory=dict)
    """Of the method, as `build_reach_set` takes it."""
    start_pitch_rad: float | None = None
    """None for the automaton's start pitch that is nearest to the vehicle's."""
    speed_mps: float | None = None
    """None for one layer a movement."""
    turn_step_deg: float = 15.0
    pitch_limit_deg: float = 30.0


@dataclass(frozen=True, slots=True)
class RatingSettings:
    """How evidence becomes ratings."""

    name: str = "total"
    unknown: float = 0.0
    """How far hidden space counts as blocked, u in [0, 1]."""
    unknown_unseen: float = 1.0
    """The same for columns that no beam looks into."""
    detection: Rule = "ratio"
    threshold: float = 0.3
    """Rating from which a trajectory counts as passable."""
    safety_margin_m: float = 0.6
    """How far the coating reaches around hit points and map obstacles."""


@dataclass(frozen=True, slots=True)
class TimingSettings:
    """When the vehicle is in which cell."""

    model: str = "radial"
    """"radial" or "reach-set"."""
    speed_mps: float | None = None
    """None for the reach set's."""


@dataclass(frozen=True, eq=False)
class Scene:
    """All that is known at one moment; the grid sits in the body frame of `state`."""

    name: str
    grid: AvoidanceGrid
    state: State = field(default_factory=lambda: State(np.zeros(3)))
    obstacle_map: ObstacleMap = field(default_factory=ObstacleMap)
    """World frame."""
    sightings: tuple[SceneScan, ...] = ()
    """None at all leaves everything visible (4.19)."""
    traffic: tuple[SceneIntruder, ...] = ()
    timing: TimingSettings = field(default_factory=TimingSettings)
    reach: ReachSettings = field(default_factory=ReachSettings)
    rating: RatingSettings = field(default_factory=RatingSettings)

    __repr__ = brief

    @property
    def speed_mps(self) -> float:
        """Speed of the reach set's vehicle."""
        if self.reach.speed_mps is not None:
            return self.reach.speed_mps
        if self.timing.model == "reach-set" and self.timing.speed_mps is not None:
            return self.timing.speed_mps
        near, far = self.grid.range_edges_m[[0, -1]]
        return float(far - near) / self.grid.layers


@dataclass(frozen=True, eq=False)
class SceneAssessment:
    """What a scene means, cell by cell and trajectory by trajectory."""

    scene: Scene
    detections: tuple[Detection, ...]
    cells: CellAssessment
    intruders: tuple[IntruderCells, ...]
    """One per intruder of the scene."""
    reach_set: ReachSet
    reach: ReachAssessment
    space: SpaceCells
    """What each cell is: free, occupied, hidden or mixed (section 3.5)."""

    def __repr__(self) -> str:
        return one_line("SceneAssessment", (in_brief(self.scene.name), *self._facts.values()))

    def _repr_html_(self) -> str:
        """For notebooks: what was found, and returns and trajectories above the threshold."""
        free = self._free[:: max(1, len(self._free) // 40)]
        samples = self.reach_set.samples_m
        ways = [samples[self.reach_set.path(int(node))].reshape(-1, 3) for node in free]
        marks = [Marks(way, "#a6cde3", size=0.8) for way in ways]
        marks += [Marks(one.points_m, "#c0392b", joined=False) for one in self.detections]
        return html_table(self.scene.name, self._facts, sketch_from_above(marks))

    @property
    def _free(self) -> IntArray:
        """Nodes that end trajectories rated above the threshold."""
        ends = self.reach_set.trajectories
        return ends[self.reach.node_rating[ends] >= self.scene.rating.threshold]

    @property
    def _facts(self) -> dict[str, str]:
        cells, ends = self.cells.obstacle, self.reach_set.trajectories
        return {
            "obstacles": f"{np.count_nonzero(cells)} of {len(cells)} cells with obstacles",
            "trajectories": f"{len(self._free):,} of {len(ends):,} trajectories free",
        }


def assess_scene(scene: Scene, notice: Notice | None = None) -> SceneAssessment:
    """Detect, fuse and rate one moment: (5.40)-(5.54), (5.37), (4.17)-(4.23).

    `notice` is called with sentences about the stored reach sets. Raises ClearwayError when
    nothing leads through the grid.
    """
    rating = scene.rating
    reach_set = reach_set_of(scene, notice)
    detections = tuple(
        detect(scene.grid, sighting.lidar, sighting.scan, rule=rating.detection)
        for sighting in scene.sightings
    )
    intruders = _intruders(scene, _vehicle_times(scene, reach_set))
    evidence = _evidence(scene, detections, intruders)
    cells = assess_cells(evidence, rating_named(rating.name), rating.unknown, rating.unknown_unseen)
    return SceneAssessment(
        scene=scene,
        detections=detections,
        cells=cells,
        intruders=intruders,
        reach_set=reach_set,
        reach=rate_reach_set(reach_set, cells.rating, rating.threshold),
        space=classify_space(evidence.detected, evidence.visibility, evidence.map_base),
    )


def reach_set_of(scene: Scene, notice: Notice | None = None) -> ReachSet:
    """The scene's reach set: from the user's cache where it is the one for flying."""
    settings = scene.reach
    movements = scene.grid.range_m / scene.speed_mps
    if movements > MOST_MOVEMENTS:
        raise ClearwayError(
            f"reach set: {scene.speed_mps:g} m/s need {movements:,.0f} movements of 1 s to cross "
            f"{scene.grid.range_m:g} m; at most {MOST_MOVEMENTS} are possible"
        )
    automaton = MovementAutomaton.plane(
        scene.speed_mps, settings.turn_step_deg, pitch_limit_deg=settings.pitch_limit_deg
    )
    pitch = settings.start_pitch_rad
    wanted = float(scene.state.attitude_rad[1]) if pitch is None else pitch
    nearest = min(automaton.start_pitches_rad, key=lambda start: (abs(start - wanted), abs(start)))
    if settings.method == "flying" and (pitch is None or abs(nearest - wanted) < 1e-9):
        library = ReachLibrary.load_or_build(automaton, scene.grid, notice=notice)
        return library.nearest(wanted)
    start = nearest if pitch is None else pitch
    return build_reach_set(automaton, scene.grid, settings.method, start, **settings.tuning)


def _vehicle_times(scene: Scene, reach_set: ReachSet) -> VehicleTimes:
    if scene.timing.model == "reach-set":
        return reach_set_vehicle_times(reach_set)
    return radial_vehicle_times(scene.grid, scene.timing.speed_mps or scene.speed_mps)


def _intruders(scene: Scene, times: VehicleTimes) -> tuple[IntruderCells, ...]:
    """Each intruder by its own models, in the grid's frame (5.36)."""
    up = up_seen_from(scene.state)
    return tuple(
        assess_intruders(
            scene.grid,
            [traffic.intruder.seen_from(scene.state)],
            traffic.models,
            traffic.timed,
            times,
            up if traffic.up is None else traffic.up,
            "fine",
        )
        for traffic in scene.traffic
    )


def _evidence(
    scene: Scene, detections: Sequence[Detection], intruders: Sequence[IntruderCells]
) -> Evidence:
    """What sensors, map and intruders say of each cell, and the coating around it."""
    grid, margin = scene.grid, scene.rating.safety_margin_m
    shapes = scene.obstacle_map.in_grid(
        scene.state.position_m, scene.state.world_from_body, grid, margin
    )
    evidence = replace(
        Evidence.free(grid),
        map_base=base_probability(shapes, grid, "fine"),
        coated=coated_by_map(shapes, grid, margin),
    )
    if intruders:
        each = np.concatenate([one.each for one in intruders])
        evidence = replace(evidence, intruder=combine_intruders(each))
    if detections:
        sensed = combine_detections(detections)
        coated = evidence.coated
        for detection in detections:
            coated = coated | coated_by_points(
                grid, detection.points_m, detection.radius_m + margin
            )
        evidence = replace(
            evidence,
            detected=sensed.detected,
            visibility=sensed.visibility,
            seen=sensed.seen,
            coated=coated,
        )
    return evidence
