"""One moment assessed: everything known at an instant, and what it means cell by cell.

`assess_scene` is the cycle of `avoidance.decide` without the decision, for looking at a scene: what
it says of cells and trajectories is what a decision goes by. It knows no files:
`clearway.missions.scene_reading` reads them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.clear.verify import paths_of
from clearway.avoidance.plan.evidence import CountedAs, evidence_of, gather_in_reach, intruder_cells
from clearway.avoidance.plan.prepared import reach_of
from clearway.avoidance.plan.settings import EvidenceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rate.fusion import CellAssessment, Rating, assess_cells, rating_named
from clearway.avoidance.rate.reach_rating import ReachAssessment, rate_reach_set
from clearway.base.brief import brief, in_brief, one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.grid_frame import GridFrame
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.state import IntArray, State
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.flown import fly_reach_set, is_flown, turns_of
from clearway.reach.sets import build_reach_set
from clearway.reach.store import Notice, ReachLibrary
from clearway.reach.tree import ReachSet
from clearway.sensors import Detection, Lidar, Scan, detect
from clearway.sensors.cells.space import SpaceCells, classify_space
from clearway.traffic import (
    Intruder,
    IntruderCells,
    VehicleTimes,
    radial_vehicle_times,
    reach_set_vehicle_times,
)
from clearway.traffic.models.cells import Accuracy
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import Scale, scale_of

VehicleKind: TypeAlias = Literal["plane", "multirotor", "inertialess"]
DEFAULT_MPS2 = 3.0
"""Acceleration of a multirotor of which none is stated."""
MOST_MOVEMENTS = 100
"""In a row; reach sets of more would not fit into memory."""
FARTHEST_OUT = 10
"""Ranges of the grid that one movement may lead: all of it is traced, however little is inside."""


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

    kind: VehicleKind = "plane"
    """Of the vehicle: "plane" keeps its speed, "multirotor" accelerates and brakes, "inertialess"
    changes its speed at once."""
    method: str = "flying"
    tuning: Mapping[str, float] = field(default_factory=dict)
    """Of the method, as `build_reach_set` takes it."""
    start_pitch_rad: float | None = None
    """None for the automaton's start pitch that is nearest to the vehicle's."""
    speed_mps: float | None = None
    """None for one layer a movement; of a multirotor the greatest."""
    turn_step_deg: float = 15.0
    pitch_limit_deg: float = 30.0
    now_mps: float | None = None
    """Own speed ahead of a multirotor; None for its greatest."""
    acceleration_mps2: float = DEFAULT_MPS2
    """Greatest of a multirotor."""

    def build_automaton(self, speed_mps: float) -> MovementAutomaton:
        """What the vehicle can do at a speed."""
        if self.kind == "multirotor":
            return MovementAutomaton.multirotor(
                speed_mps=speed_mps, acceleration_mps2=self.acceleration_mps2
            )
        if self.kind == "inertialess":
            return MovementAutomaton.inertialess(
                speed_mps, self.turn_step_deg, steepest_deg=self.pitch_limit_deg
            )
        return MovementAutomaton.plane(
            speed_mps, self.turn_step_deg, pitch_limit_deg=self.pitch_limit_deg
        )

    @property
    def scale(self) -> Scale | None:
        """Range and margin that suit the vehicle; None without its speed, for then the range of the
        grid says that."""
        return None if self.speed_mps is None else scale_of(self.build_automaton(self.speed_mps))


@dataclass(frozen=True, slots=True)
class RatingSettings(EvidenceSettings):
    """How evidence becomes ratings: as in a decision, but looked at finely."""

    accuracy: Accuracy = "fine"

    __repr__ = brief

    @classmethod
    def of(cls, settings: EvidenceSettings) -> RatingSettings:
        """Those of a decision."""
        same = {one.name: getattr(settings, one.name) for one in fields(EvidenceSettings)}
        return cls(**same | {"accuracy": "fine"})


@dataclass(frozen=True, slots=True)
class TimingSettings:
    """When the vehicle is in which cell."""

    model: str = "radial"
    """"radial" or "reach-set"."""
    speed_mps: float | None = None
    """None for the reach set's."""


@dataclass(frozen=True, eq=False)
class Scene:
    """All that is known at one moment; the grid sits where `state` is, its roll left out."""

    name: str
    grid: AvoidanceGrid
    state: State = field(default_factory=lambda: State(np.zeros(3)))
    obstacle_map: ObstacleMap = field(default_factory=ObstacleMap)
    """World frame."""
    sightings: tuple[SceneScan, ...] = ()
    """None at all leaves everything visible (4.19)."""
    traffic: tuple[SceneIntruder, ...] = ()
    remembered: PointHazards | None = None
    """Points of earlier scans and of these, world frame; None takes those of the scans alone."""
    timing: TimingSettings = field(default_factory=TimingSettings)
    reach: ReachSettings = field(default_factory=ReachSettings)
    rating: RatingSettings = field(default_factory=RatingSettings)

    __repr__ = brief

    @property
    def settings(self) -> RatingSettings:
        """How its evidence is gathered and rated."""
        return self.rating

    @property
    def cell_rating(self) -> Rating:
        """How evidence becomes a rating."""
        return rating_named(self.rating.rating)

    @property
    def speed_mps(self) -> float:
        """Speed of the reach set's vehicle."""
        if self.reach.speed_mps is not None:
            return self.reach.speed_mps
        if self.timing.model == "reach-set" and self.timing.speed_mps is not None:
            return self.timing.speed_mps
        near, far = self.grid.range_edges_m[[0, -1]]
        return float(far - near) / self.grid.layers

    @property
    def now_mps(self) -> float:
        """Own speed ahead."""
        return self.speed_mps if self.reach.now_mps is None else self.reach.now_mps


@dataclass(frozen=True, eq=False)
class SceneAssessment:
    """What a scene means, cell by cell and trajectory by trajectory.

    >>> import clearway as cw
    >>> rated = cw.assess("two-balls.toml")
    >>> rated.cells.rating.shape, len(rated.reach_set.trajectories) > 0
    ((350,), True)
    """

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
    """Detect, fuse and rate one moment: (5.37)-(5.54), (4.17)-(4.23), as a decision does.

    `notice` is called with sentences about the stored reach sets. Raises ClearwayError when
    nothing leads through the grid.
    """
    reach_set = load_scene_reach_set(scene, notice)
    situation = situation_of(scene)
    near = gather_in_reach(
        scene,
        situation,
        reach_of(paths_of(reach_set), scene.grid.range_m),
        max(scene.grid.range_m / scene.speed_mps, float(reach_set.end_time_s.max())),
    )
    intruders = intruder_cells(scene, near, _count_intruders(scene, reach_set))
    evidence, settings = evidence_of(scene, situation, near, intruders), scene.settings
    cells = assess_cells(evidence, scene.cell_rating, settings.unknown, settings.unknown_unseen)
    return SceneAssessment(
        scene=scene,
        detections=tuple(situation.detections),
        cells=cells,
        intruders=intruders,
        reach_set=reach_set,
        reach=rate_reach_set(reach_set, cells.rating, settings.threshold),
        space=classify_space(evidence.detected, evidence.visibility, evidence.map_base),
    )


def situation_of(scene: Scene) -> Situation:
    """The scene as it would be reported to a decision; its waypoint is where the vehicle is."""
    state = scene.state
    grid_from_body = GridFrame.of(state).grid_from_body(state)
    detections = tuple(
        detect(
            scene.grid,
            sighting.lidar,
            sighting.scan,
            grid_from_body=grid_from_body,
            rule=scene.rating.detection,
        )
        for sighting in scene.sightings
    )
    sigmas = [sighting.lidar.sigma_m for sighting in scene.sightings]
    # What is remembered of the worse sensors has grown by how much worse they are.
    sigma_of = max if scene.remembered is None else min
    return Situation(
        state,
        state.position_m,
        detections=detections,
        remembered=scene.remembered,
        obstacle_map=scene.obstacle_map,
        intruders=tuple(traffic.intruder for traffic in scene.traffic),
        range_sigma_m=sigma_of(sigmas, default=0.0),
    )


def build_scene_automaton(scene: Scene) -> MovementAutomaton:
    """What the vehicle of its reach set can do; raises ClearwayError where no grid is for it."""
    if scene.reach.kind == "multirotor":
        return scene.reach.build_automaton(scene.speed_mps)
    movements = scene.grid.range_m / scene.speed_mps
    if movements > MOST_MOVEMENTS:
        raise ClearwayError(
            f"reach set: {scene.speed_mps:g} m/s need {movements:,.0f} movements of 1 s to cross "
            f"{scene.grid.range_m:g} m; at most {MOST_MOVEMENTS} are possible"
        )
    if movements * FARTHEST_OUT < 1.0:
        raise ClearwayError(
            f"reach set: {scene.speed_mps:g} m/s are through a grid of {scene.grid.range_m:g} m "
            f"in {movements:.3g} s; at most {FARTHEST_OUT * scene.grid.range_m:g} m/s are rated, "
            f"{FARTHEST_OUT} times its range in a movement of 1 s"
        )
    return scene.reach.build_automaton(scene.speed_mps)


def load_scene_reach_set(scene: Scene, notice: Notice | None = None) -> ReachSet:
    """The scene's reach set: from the user's cache where it is the one for flying."""
    settings, automaton = scene.reach, build_scene_automaton(scene)
    if automaton.classes is not None:
        if settings.method != "flying":
            raise ClearwayError(
                f"reach set: method {settings.method!r} is for vehicles without inertia; a "
                'multirotor has "flying" alone'
            )
        library = ReachLibrary.load_or_build(automaton, scene.grid, notice=notice)
        return library.reach_sets[automaton.classes.class_near(scene.now_mps, 0.0)]
    pitch = settings.start_pitch_rad
    wanted = float(scene.state.attitude_rad[1]) if pitch is None else pitch
    nearest = min(automaton.start_pitches_rad, key=lambda start: (abs(start - wanted), abs(start)))
    if settings.method == "flying" and (pitch is None or abs(nearest - wanted) < 1e-9):
        library = ReachLibrary.load_or_build(automaton, scene.grid, notice=notice)
        return _as_flown(library.nearest(wanted), automaton, scene, pitch)
    start = nearest if pitch is None else pitch
    return build_reach_set(
        automaton, scene.grid, method=settings.method, start_pitch_rad=start, **settings.tuning
    )


def _as_flown(
    reach_set: ReachSet, automaton: MovementAutomaton, scene: Scene, pitch_rad: float | None
) -> ReachSet:
    """The trajectories as decisions take them: from the true attitude, unless one is asked for."""
    roll, pitch, _ = scene.state.attitude_rad.tolist()
    if pitch_rad is not None or is_flown(reach_set, automaton, roll, pitch):
        return reach_set
    return fly_reach_set(reach_set, turns_of(reach_set), automaton, roll, pitch).reach_set


def _vehicle_times(scene: Scene, reach_set: ReachSet) -> VehicleTimes:
    if scene.timing.model == "reach-set":
        return reach_set_vehicle_times(reach_set)
    return radial_vehicle_times(scene.grid, scene.timing.speed_mps or scene.speed_mps)


def _count_intruders(scene: Scene, reach_set: ReachSet) -> tuple[CountedAs, ...]:
    """How each intruder of a scene is counted."""
    times = _vehicle_times(scene, reach_set)
    return tuple(
        CountedAs(traffic.models, traffic.timed, times, traffic.up) for traffic in scene.traffic
    )
