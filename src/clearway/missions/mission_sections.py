"""Tables of a mission file: the way, the vehicle, how it decides, and what its truth is like."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from clearway.avoidance.plan.held_escape import Escape
from clearway.avoidance.rate.fusion import RATINGS
from clearway.base.checks import span_problem
from clearway.io.choices import OneOf
from clearway.io.toml import Section
from clearway.missions.automaton_file import read_automaton
from clearway.missions.sections import (
    Attitude,
    Coordinate,
    NotNegative,
    OnEarth,
    Place,
    Point,
    Positive,
    Share,
)
from clearway.reach import METHODS
from clearway.sensors import COMBINE_RULES
from clearway.sensors.cells.detection import RULES
from clearway.sim.plants import PLANTS, PlantKind
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import MARGIN_M, MOVEMENT_S, REACH_RADIUS_M, movement_s

OF_INERTIALESS = ("spot_turn_deg", "slow_mps")
OF_MULTIROTORS = ("acceleration_mps2", "sink_mps", "yaw_rate_deg_s", "lag_s", "gusts_mps")
OF_MOVEMENTS = ("kind", "speed_mps", "turn_step_deg", "movement_s", "pitch_limit_deg")
NOT_OF_MULTIROTORS = {
    "turn_step_deg": "turns follow from acceleration_mps2 and yaw_rate_deg_s",
    "movement_s": "it follows from speed_mps and acceleration_mps2",
    "pitch_limit_deg": "give climb_mps and sink_mps; 0 keeps it level",
    "spot_turn_deg": "give yaw_rate_deg_s, the turn over the time of a movement",
    "slow_mps": "decisions choose the speed, up to speed_mps",
}
"""Keys of a vehicle without inertia, and what takes their place."""
OF_PLANTS = ("speed_mps", "movement_s")
"""What a plant's own movements are made for."""
Points = Annotated[tuple[Point, ...], Field(strict=False)]


class MissionSection(Section):
    """`[mission]`: where to go."""

    name: Annotated[str, Field(min_length=1)]
    """What logs, pictures and the output folder are called."""
    waypoints_m: Annotated[Points, Field(min_length=1)]
    """Points to fly to, in this order, world frame; `plan` can bring them."""
    plan: str | None = None
    """A ground station's flight plan (.plan, .waypoints, .kml, .kmz), relative to the mission
    file. It brings name, waypoints, start, speed, fences, and what suits the speed; keys given here
    take precedence."""
    origin_geodetic: OnEarth | None = None
    """Latitude and longitude in degrees, height above sea level in metres, of the world's origin;
    x is then east and y north. Default: the middle of the first map file, if there is one."""
    reach_radius_m: Positive = REACH_RADIUS_M
    """A waypoint is reached within this distance. Default: [what suits the
    vehicle](missions.md#what-suits-the-vehicle), the value here at 1 m/s. With less than half a
    movement, or an eighth of the turning radius, it may be circled for ever. The pre-flight check
    warns of that."""
    landing_m: Points = ()
    """Points of the landing sequence, after the last waypoint. It ends where the vehicle comes
    nearest to the last one, within `reach_radius_m`."""
    pass_within_m: Positive | None = None
    """A waypoint before the last also counts once it is abeam within this distance; default: every
    waypoint has to be reached."""


class VehicleSection(Section):
    """`[vehicle]`: start pose and movement automaton."""

    position_m: Point = (0.0, 0.0, 0.0)
    """Where the flight starts, world frame."""
    attitude_deg: Attitude = (0.0, 0.0, 0.0)
    """Roll, pitch (nose down positive), yaw (left positive)."""
    kind: Literal["plane", "multirotor", "inertialess"] = "plane"
    """A plane keeps its speed and cannot hover. A multirotor accelerates, brakes, turns on the spot
    and holds its position. An inertialess vehicle does the same but changes speed at once: a model
    for old missions and tests, not for a real copter."""
    plant: Annotated[str, OneOf(PLANTS)] | None = None
    """What truly moves in the simulator; default: what does as the movements say, turning at once.
    Where no `kind` is given, the plant's own movements are flown; see [plants.md](plants.md)."""
    automaton: str | None = None
    """A file of measured movements, as `clearway automaton measure` writes it, relative to the
    mission file; it takes the place of kind, speed, turns and durations."""
    speed_mps: Positive = 1.0
    """A plane keeps it throughout; of the other kinds it is the greatest."""
    turn_step_deg: float = Field(default=15.0, gt=0.0, le=90.0)
    """Turn in one movement, in flight."""
    movement_s: Positive = MOVEMENT_S
    """Duration of a movement. Default: [what suits the
    vehicle](missions.md#what-suits-the-vehicle), the value here up to 21 m/s."""
    pitch_limit_deg: float = Field(default=30.0, ge=0.0, lt=90.0)
    """Steepest pitch, up and down; of an inertialess vehicle the steepest way ahead. A vehicle that
    it keeps level goes by level distance: waypoints count as reached from above or below."""
    acceleration_mps2: Positive | None = None
    """Of a multirotor, greatest acceleration in any direction, with which it brakes too; default
    3, over MAVLink 2."""
    climb_mps: NotNegative | None = None
    """Of a multirotor, greatest rate of climb; default 2. Of an inertialess vehicle, straight up
    and down; default: what its steepest way ahead climbs."""
    sink_mps: NotNegative | None = None
    """Of a multirotor, greatest rate of descent; default 1.5."""
    yaw_rate_deg_s: Positive | None = None
    """Of a multirotor, greatest rate of turn of its nose, which points where it flies; default
    90."""
    lag_s: NotNegative | None = None
    """Of a multirotor, how late it answers to what it is asked; default 0.1, over MAVLink 0.3. Its
    tube grows with it."""
    gusts_mps: NotNegative | None = None
    """Of a multirotor, standard deviation of the gusts in which it keeps within its tube; default
    1."""
    spot_turn_deg: float | None = Field(default=None, gt=0.0, le=180.0)
    """Of an inertialess vehicle, turn on the spot in one movement; default 45."""
    slow_mps: Annotated[tuple[Positive, ...], Field(strict=False)] | None = None
    """Of an inertialess vehicle, slower speeds to fly at; default: half the speed."""
    body_radius_m: NotNegative = 0.3
    """Distance from the vehicle's centre within which it is: kept from unobserved space, and
    drawn in the picture of distances."""

    @model_validator(mode="after")
    def _keys_suit_the_kind(self) -> Self:
        measured = [key for key in OF_MOVEMENTS if key in self.model_fields_set]
        if self.automaton is not None and measured:
            raise ValueError(f"{measured[0]}: the automaton's file says what it is flown with")
        if self.flies_as_its_plant:
            lost = [key for key in measured if key not in OF_PLANTS]
            if lost:
                raise ValueError(
                    f"{lost[0]}: {self.plant} flies its own movements; give a kind too"
                )
        self._refuse_keys_of_other_kinds()
        pitch_deg = self.attitude_deg[1]
        if self.pitch_limit_deg == 0.0 and pitch_deg != 0.0 and self.plant is None:
            raise ValueError(
                f"attitude_deg: starts with a pitch of {pitch_deg:g} deg, which no movement ends "
                "with pitch_limit_deg = 0: it would climb or sink for ever"
            )
        for slow in self.slow_mps or ():
            if not slow < self.speed_mps:
                raise ValueError(
                    f"slow_mps: must be below speed_mps, {self.speed_mps:g}, got {slow:g}"
                )
        if self.slow_mps and len(set(self.slow_mps)) < len(self.slow_mps):
            raise ValueError(f"slow_mps: speeds must differ, got {list(self.slow_mps)}")
        return self

    @model_validator(mode="after")
    def _turns_without_too_steep_a_bank(self) -> Self:
        if "movement_s" not in self.model_fields_set:
            vars(self)["movement_s"] = movement_s(self.speed_mps, self.turn_step_deg)
        return self

    def _refuse_keys_of_other_kinds(self) -> None:
        given = self.model_fields_set
        if self.kind == "multirotor":
            for key, instead in NOT_OF_MULTIROTORS.items():
                if key in given:
                    raise ValueError(
                        f'{key}: not of kind = "multirotor": {instead}; kind = "inertialess" keeps '
                        "it, for a vehicle that changes speed at once"
                    )
            return
        of_others = (
            OF_MULTIROTORS
            if self.kind == "inertialess"
            else (*OF_MULTIROTORS, *OF_INERTIALESS, "climb_mps")
        )
        for key in of_others:
            if getattr(self, key) is not None:
                kind = "inertialess" if key in OF_INERTIALESS else "multirotor"
                raise ValueError(f'{key}: only of kind = "{kind}"')

    @property
    def flies_as_its_plant(self) -> bool:
        """Whether the movements are those that the plant has of its own."""
        plant = self.to_plant()
        own = plant is not None and plant.movements is not None
        return own and self.automaton is None and "kind" not in self.model_fields_set

    def effective(self) -> dict[str, Any]:
        """The table with its defaults, but for those in whose place plant or automaton stand."""
        table = self.model_dump(exclude_none=True)
        if self.kind == "multirotor" and self.automaton is None:
            return {key: value for key, value in table.items() if key not in NOT_OF_MULTIROTORS}
        if self.automaton is None and not self.flies_as_its_plant:
            return table
        left_out = set(OF_MOVEMENTS) - self.model_fields_set
        return {key: value for key, value in table.items() if key not in left_out}

    def to_plant(self) -> PlantKind | None:
        """What truly moves; None for what does as the automaton predicts."""
        return None if self.plant is None else PLANTS.find(self.plant)

    def to_automaton(self) -> MovementAutomaton:
        if self.automaton is not None:
            return read_automaton(self.automaton)
        plant = self.to_plant()
        if self.flies_as_its_plant and plant is not None and plant.movements is not None:
            keys = {"speed_mps": "speed_mps", "movement_s": "duration_s"}
            given = [name for name in OF_PLANTS if name in self.model_fields_set]
            return plant.movements(**{keys[name]: getattr(self, name) for name in given})
        if self.kind == "multirotor":
            limits = {
                key: getattr(self, key) for key in ("speed_mps", "climb_mps", *OF_MULTIROTORS)
            }
            stated = {key: value for key, value in limits.items() if value is not None}
            return MovementAutomaton.multirotor(**stated)
        if self.kind == "inertialess":
            return MovementAutomaton.inertialess(
                self.speed_mps,
                self.turn_step_deg,
                duration_s=self.movement_s,
                steepest_deg=self.pitch_limit_deg,
                climb_mps=self.climb_mps,
                spot_turn_deg=45.0 if self.spot_turn_deg is None else self.spot_turn_deg,
                slow_mps=self.slow_mps,
            )
        return MovementAutomaton.plane(
            self.speed_mps,
            self.turn_step_deg,
            duration_s=self.movement_s,
            pitch_limit_deg=self.pitch_limit_deg,
        )


class ReachSetSection(Section):
    """`[reach_set]`: the trajectories to choose from."""

    method: Annotated[str, OneOf(METHODS, without=("full",))] = "flying"
    """How trajectories are selected."""


class SafetySection(Section):
    """`[safety]`: distances to keep, and escapes."""

    margin_m: Positive = MARGIN_M
    """From the vehicle's centre to any obstacle's surface; at least `vehicle.body_radius_m` is
    kept, unless `off` is flown. Default: [what suits the
    vehicle](missions.md#what-suits-the-vehicle), the value here at 1 m/s."""
    conservative_turning_radius_m: Positive | None = None
    """Turning radius of (6.14), for the picture only; default: the automaton's."""
    sigmas: NotNegative = 3.0
    """Standard deviations of the own position by which the margin grows."""
    own_drift_mps: NotNegative = 0.05
    """Growth of the margin with the age of the state estimate."""
    wind_mps: Place = (0.0, 0.0, 0.0)
    """Wind as known before take-off, world frame; from then on it is estimated."""
    point_sigmas: NotNegative = 2.0
    """Standard deviations of the range by which a hit point grows."""
    smallest_object_m: Positive | None = None
    """Thickness (twice the radius) of the thinnest thing to keep clear of. Beams that lie too far
    apart for it are refused before take-off, and returns stay until beams fine enough for it see
    nothing there. Default: not declared, and the log says what the beams can hold."""
    escape: Literal["strict", "mapped", "known", "off"] = "strict"
    """What must be known of the escape that every decision holds. strict: it leads through observed
    free space; mapped: or through a map that is declared complete (`map.complete`); known: as
    strict while that leads on, then unobserved space counts as free, without guarantee; off: no
    escape is required. Where sensors see too little for strict, the pre-flight check reports it,
    and known is flown with all unobserved space free; see [safety.md](safety.md)."""
    unobserved_m: NotNegative = 0.0
    """Metres of an escape that may lead through unobserved space, of vehicles without inertia. 0
    keeps `escape = "strict"`; more is flown under the name `budgeted`: only where no escape is all
    observed, and never through what was seen or mapped to stand there. No guarantee holds then;
    its measured risk is in [sight.md](sight.md)."""
    narrow: Literal["refuse", "allow"] = "refuse"
    """Places in which the vehicle cannot turn. refuse: they are entered only where an escape leads
    on through them; allow: they are flown through without one, as far as they are seen, where every
    trajectory that leaves one costs more by `prices.no_room`. No guarantee holds there; the log and
    the summary state from when to when."""
    start_free_m: NotNegative | None = None
    """Radius of the ball around the start that counts as observed free space, never over a return;
    default: the length of a movement, or for a vehicle that can stop as far as it takes to leave
    any start, three movements or margins at most, which the pre-flight check prints."""
    obstacles_span_m: Annotated[tuple[Coordinate, Coordinate], Field(strict=False)] | None = None
    """Lowest and highest height, in the frame of the waypoints. It declares that whatever stands
    between them reaches through all heights between them, as pillars, walls and trunks do. A sensor
    of one level plane then shows what is free at all these heights. Default: nothing is
    declared."""
    ground_height_m: float | None = None
    """Returns at or below this height are ground, no obstacles; a floor is then up to the map."""
    patience_turns: Positive = 1.5
    """Full circles' worth of time without progress before a detour."""

    @property
    def escape_kept(self) -> str:
        """By the name under which it is flown."""
        return Escape.BUDGETED if self.unobserved_m > 0.0 else self.escape

    @model_validator(mode="after")
    def _budget_is_of_strict(self) -> Self:
        if self.unobserved_m > 0.0 and self.escape != "strict":
            raise ValueError(
                f'unobserved_m: {self.unobserved_m:g} m soften escape = "strict", and '
                f'"{self.escape}" is asked for; leave one of the two out'
            )
        return self

    @model_validator(mode="after")
    def _span_is_one(self) -> Self:
        span_m = self.obstacles_span_m
        problem = None if span_m is None else span_problem("obstacles_span_m", span_m)
        if problem is not None:
            raise ValueError(problem)
        return self


class RatingSection(Section):
    """`[rating]`: how evidence becomes a rating, and what a trajectory must have of it."""

    name: Annotated[str, OneOf(RATINGS)] = "total"
    """How safe a cell is, by its evidence."""
    unknown: Share = 0.0
    """How far hidden space counts as blocked, u."""
    unknown_unseen: Share = 1.0
    """The same for columns that no beam looks into."""
    threshold: Share = 0.3
    """Rating of a trajectory, P_R, from which on it counts as passable."""
    detection: Annotated[str, OneOf(RULES)] = "ratio"
    """How hits become P_OD."""
    sensors: Annotated[str, OneOf(COMBINE_RULES)] = "conjunction"
    """How several sensors become one; see [sensors.md](sensors.md)."""


class VerifySection(Section):
    """`[verify]`: whether candidates are checked against the evidence itself."""

    method: Literal["evidence", "none"] = "evidence"
    """none flies on cell ratings alone, as the paper does."""


class PricesSection(Section):
    """`[prices]`: small cost weights beside the length flown."""

    turn: NotNegative = 0.2
    """Per movement that is not smooth, as a share of its length."""
    change: NotNegative = 0.1
    """Per movement unlike the one before it, as a share of its length."""
    vertical: NotNegative | None = None
    """Per metre of height changed; by default 0.15, and 0.25 where the vehicle stops at once."""
    risk: NotNegative | None = None
    """Per unit of -log P_R, in movement lengths: a safer trajectory of higher cost may win; by
    default 0.5, and 0 where the vehicle has inertia."""
    coated: NotNegative | None = None
    """For passing cells that the margin around evidence reaches into, in movement lengths; by
    default 3, and 0 where the vehicle can stop."""
    miss: NotNegative | None = None
    """For grazing the reach radius of the goal, in movement lengths; by default 2, and 0.2 where
    the vehicle has inertia."""
    other_side: NotNegative | None = None
    """For passing on another side than the one committed to, in movement lengths; by default 4, and
    0.3 where the vehicle has inertia."""
    other_plan: NotNegative | None = None
    """For a first movement other than the last plan's, in movement lengths; by default 0.1, and
    0.36 where the vehicle has inertia."""
    no_room: NotNegative | None = None
    """For a way without room to circle within its first movements, in movement lengths: what is
    entered without room to turn round may be a dead end; by default 6, and 12 where `safety.escape`
    is `known`."""
    off_level: NotNegative | None = None
    """For leaving the field of view above or below at once, in movement lengths; by default 0, 1
    where the vehicle stops at once, and 1.5 where the field is not as high above the horizon as
    below."""
    ahead: NotNegative = 0.0
    """For crossing ahead of an intruder, in movement lengths: above 0 passes behind (6.8)."""
    closing: NotNegative = 0.5
    """Per metre by which a way leads nearer to where an intruder is that turns or changes its
    speed, beyond straight away from it: a pursuer is run away from."""


class SimulationSection(Section):
    """`[simulation]`: how the simulated world behaves."""

    seed: int = Field(default=0, ge=0)
    """Of all noise; the same seed flies the same flight."""
    step_s: float = Field(default=0.05, gt=0.0, le=0.05)
    """Step of the true motion."""
    scan_rate_hz: Positive | None = None
    """Scans a second of every sensor, between decisions too, at most one a step; default: one with
    each decision."""
    scan_latency_s: NotNegative = 0.0
    """Age of a scan when it reaches the vehicle."""
    state_noise_mps: NotNegative = 0.0
    """Bound of the disturbance w (3.20) on each axis of velocity."""
    input_noise: NotNegative = 0.0
    """Bound of the disturbance v (3.20), as a share of speed and of the turn rate."""
    wind_mps: Place = (0.0, 0.0, 0.0)
    """Steady wind that carries the vehicle, world frame; unknown to it."""
    gusts_mps: NotNegative = 0.0
    """Standard deviation of gusts along and across the flight, by MIL-F-8785C (Dryden)."""
    position_sigma_m: NotNegative = 0.0
    """Standard deviation of the own position as measured; stated to the vehicle."""
    attitude_sigma_deg: NotNegative = 0.0
    """Standard deviation of the own pitch and yaw as measured; stated to the vehicle."""
    adversary_m: NotNegative = 0.0
    """Thickness of balls that an adversary puts where the vehicle means to fly and no beam has
    been: every second one is of this thickness, others are up to five times as thick. 0 for no
    adversary."""
    time_limit_s: Positive | None = None
    """End of a flight that does not arrive; default: six straight flights and a minute."""
