"""Before take-off: whether what the sensors see leaves a way out in hand at every decision.

It is tried, not calculated: in the emptiest world there is, the vehicle flies straight on, and at
every movement a way out through what was seen is looked for. What cannot hold there holds nowhere.
"""

from __future__ import annotations

import hashlib
import pickle
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.avoidance.costs import price_of
from clearway.avoidance.evidence import in_reach
from clearway.avoidance.planner import Planner
from clearway.avoidance.situation import Situation
from clearway.avoidance.way_out import Escape
from clearway.avoidance.way_out_terms import in_wind_s
from clearway.avoidance.ways_out import WaysOut
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.doubts import are_level, over_drop_outs, over_unsure, over_wide_margin
from clearway.live.range_sensing import free_space_for, voxel_m
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.escapes import EscapeLibrary
from clearway.sensors import AnySensor, Lidar, Scan, range_sensors

WIDER = (1.1, 1.25, 1.5, 2.0, 3.0, 4.0)
"""Ranges that are tried where the sensor's own does not do, in its own."""
MOST_PLANS = 64
"""Kept in a process."""
NEARLY = 0.03
"""Slope and turn (rad) that a measured movement straight on may have."""
SETTLED = 6
"""Movements in a row that must have a way out in hand."""
WIDER_START, START_STEPS = 3.0, 32
"""In movements, how far about the start is declared free at most where less would leave a vehicle
that can stop where it is for ever; and in how many steps that is tried."""
UNSURE = "what nobody has seen counts as free: no guarantee"
COLUMNS = (
    "as declared by obstacles_span_m, whatever stands between {:g} and {:g} m reaches through all "
    "heights between them"
)
LEVEL = (
    "the sensor shows one level plane; where whatever stands reaches through all heights flown at, "
    "set safety.obstacles_span_m = [lowest, highest]"
)
FARTHER = "sensors see the body's whole way only from farther on"


@dataclass(frozen=True)
class EscapePlan:
    """Which ways out a flight asks for, and why."""

    asked: str
    flown: str
    why: str
    within: int | None = None
    """After how many movements one is there where nothing stands in the way; None if not known."""
    start_free_m: float | None = field(default=None, repr=False)
    """Radius of the ball about the start that counts as free, where more is needed than a
    movement's length; None for what was asked for."""
    insists: bool = field(default=False, repr=False)
    """With `known`: whether ways out through seen space are insisted on while these lead on."""

    def flown_by(self, planner: Planner) -> Planner:
        """A planner that flies so.

        Who asks for a smaller margin than the body's radius does not ask to be touched: where a way
        out is asked for, that radius is kept.
        """
        settings, start_free_m = planner.settings, self.start_free_m
        if self.flown != Escape.OFF:
            margin_m = max(settings.safety_margin_m, settings.body_radius_m)
            if margin_m != settings.safety_margin_m:
                settings = replace(settings, safety_margin_m=margin_m)
        if self.flown != settings.escape:
            settings = replace(settings, escape=self.flown)
        if start_free_m is not None:
            settings = replace(settings, start_free_m=start_free_m)
        return planner if settings is planner.settings else replace(planner, settings=settings)

    def unseen_is_free(self) -> EscapePlan:
        """For who never insists: what nobody has seen counts as free from the start."""
        return replace(self, insists=False, why=UNSURE) if self.insists else self

    def to_json(self) -> dict[str, str]:
        """Under the names that summaries have for it."""
        return {
            "escape_mode": self.flown,
            "escape_asked": self.asked,
            "escape_why": self.why,
        }

    def __str__(self) -> str:
        flown = f'"{self.flown}"'
        if self.asked != self.flown:
            flown = f'"{self.asked}" asked for, {flown} flown'
        return f"ways out {flown}: {self.why}"


def escape_plan(
    planner: Planner,
    sensors: Sequence[AnySensor],
    obstacle_map: ObstacleMap | None = None,
    start: State | None = None,
) -> EscapePlan:
    """What the sensors, the vehicle, the margin and the map allow of what was asked for.

    start: tells how far off own states are declared to be, and how high the trial is flown.
    """
    span_m = planner.settings.obstacles_span_m
    tried = planner if span_m is None or start is None else _lowered(planner, span_m, start)
    plan = _escape_plan_of(tried, sensors, obstacle_map)
    if span_m is not None and plan.flown in (Escape.STRICT, Escape.MAPPED):
        plan = replace(plan, why=f"{plan.why}; {COLUMNS.format(*span_m)}")
    doubts = over_wide_margin(planner, plan.flown) + over_drop_outs(sensors, plan.flown)
    if start is not None and plan.flown == Escape.STRICT:
        doubts += over_unsure(planner, start)
    return replace(plan, why=plan.why + doubts) if doubts else plan


def _lowered(planner: Planner, span_m: tuple[float, float], start: State) -> Planner:
    """The planner for a trial at height 0 in place of the start's."""
    start_m = float(start.position_m[2])
    low_m, high_m = (float(height) - start_m for height in span_m)
    settings = replace(planner.settings, obstacles_span_m=(low_m, high_m))
    return replace(planner, settings=settings)


def _escape_plan_of(
    planner: Planner, sensors: Sequence[AnySensor], obstacle_map: ObstacleMap | None
) -> EscapePlan:
    key = _content(planner, sensors)
    complete_m = None if obstacle_map is None else obstacle_map.complete_m
    if planner.settings.escape == Escape.MAPPED and complete_m is not None:
        return _by_map(planner, tuple(sensors), complete_m)
    if key is None:
        return _escape_plan(planner, tuple(sensors))
    if key not in _plans:
        while len(_plans) >= MOST_PLANS:
            del _plans[next(iter(_plans))]
        _plans[key] = _escape_plan(planner, tuple(sensors))
    return _plans[key]


_plans: dict[bytes, EscapePlan] = {}
"""What was tried in this process: campaigns and batches fly one vehicle a thousand times."""


def _content(planner: Planner, sensors: Sequence[AnySensor]) -> bytes | None:
    """Equal where the same is tried; None where a sensor of one's own cannot be told by content."""
    library = planner.escapes
    tried = (planner.settings, planner.grid.range_m, planner.horizon_s, tuple(sensors))
    try:
        told = pickle.dumps(tried)
    except Exception:  # whatever an own sensor holds
        return None
    return hashlib.sha256(told + (b"" if library is None else library.key)).digest()


def _escape_plan(planner: Planner, sensors: tuple[AnySensor, ...]) -> EscapePlan:
    asked = planner.settings.escape
    library = planner.escapes
    if asked == Escape.OFF or not planner.settings.verify:
        return EscapePlan(asked, Escape.OFF, "no way out is asked for")
    if library is None:
        return EscapePlan(
            asked, Escape.OFF, "no movements of the automaton can be flown for ever without room"
        )
    if asked == Escape.KNOWN:
        return _known(planner, sensors)
    unmapped = "no map is declared complete; " if asked == Escape.MAPPED else ""
    if not sensors:
        return EscapePlan(
            asked,
            Escape.KNOWN,
            f"{unmapped}no range sensor sees what is free: no guarantee",
        )
    after = settles(planner, library, sensors)
    if after is not None:
        stays = after > 0 and planner.automaton.can_stop
        start_free_m = _wider_start_m(planner, library, sensors) if stays else None
        more = ""
        if stays and start_free_m is None:
            more = f"; {FARTHER}, and it may stay where it starts"
        elif start_free_m is not None and planner.settings.start_free_m is None:
            more, after = f"; {FARTHER}: {start_free_m:.3g} m about the start count as free", 0
        elif start_free_m is not None:
            more = f"; {FARTHER}: it may stay, start_free_m = {start_free_m:.3g} would do"
            start_free_m = None
        first = f"from movement {after + 1} on where nothing stands in the way"
        return EscapePlan(
            asked,
            Escape.STRICT,
            f"{unmapped}every decision keeps a way out through space seen to be free, "
            f"{first}{_over_drift(planner)}{more}",
            within=after,
            start_free_m=start_free_m,
        )
    past_blind = _past_blind(planner, sensors)
    if past_blind is not None:
        return past_blind
    return EscapePlan(asked, Escape.KNOWN, unmapped + _what_lacks(planner, library, sensors))


def _past_blind(planner: Planner, sensors: tuple[AnySensor, ...]) -> EscapePlan | None:
    """Where sensors are blind nearer than some distance, and no ball about the start tells what is
    there: a wider one, declared free unasked; None where that is not what lacks."""
    settings, lidars = planner.settings, [one for one in sensors if isinstance(one, Lidar)]
    wide_m = voxel_m(settings.safety_margin_m, planner.grid.range_m)
    blind_m = [
        one.pattern.min_range_m + float(np.linalg.norm(one.mounting.position_m)) + wide_m
        for one in lidars
        if one.pattern.min_range_m > 0.0
    ]
    declared_m = settings.start_free_m
    least_m = planner.automaton.step_m if declared_m is None else declared_m
    needed_m = max(blind_m, default=0.0)
    if not least_m < needed_m <= max(WIDER_START * planner.automaton.step_m, least_m):
        return None
    wider = replace(planner, settings=replace(settings, start_free_m=needed_m))
    plan = _escape_plan(wider, sensors)
    if plan.flown != Escape.STRICT:
        return None
    needed_m = plan.start_free_m or needed_m
    if declared_m is not None:
        why = f"sensors are blind near the start; start_free_m = {needed_m:.3g} would do; {UNSURE}"
        return EscapePlan(plan.asked, Escape.KNOWN, why)
    why = f"{plan.why}; sensors are blind near: {needed_m:.3g} m about the start count as free"
    return replace(plan, why=why, start_free_m=needed_m)


def _known(planner: Planner, sensors: tuple[AnySensor, ...]) -> EscapePlan:
    """Where what nobody has seen may count as free; what can stop, and who pays nothing for want of
    room, insists on no more than that."""
    strict = replace(planner, settings=replace(planner.settings, escape=Escape.STRICT))
    seen = _escape_plan(strict, sensors)
    free = price_of(planner.prices.no_room) == 0.0
    if seen.flown != Escape.STRICT or planner.automaton.can_stop or free:
        return EscapePlan(Escape.KNOWN, Escape.KNOWN, UNSURE)
    why = f"through space seen to be free while these lead on; where they do not, {UNSURE}"
    return replace(seen, asked=Escape.KNOWN, flown=Escape.KNOWN, why=why, insists=True)


def _by_map(planner: Planner, sensors: tuple[AnySensor, ...], complete_m: FloatArray) -> EscapePlan:
    """Where a map is declared complete."""
    strict = replace(planner, settings=replace(planner.settings, escape=Escape.STRICT))
    seen = _escape_plan_of(strict, sensors, None)
    if seen.flown == Escape.OFF:
        return replace(seen, asked=Escape.MAPPED)
    if np.all(np.isinf(complete_m)):
        why = "the map is declared complete: what neither it nor a sensor shows to stand is free"
        return EscapePlan(Escape.MAPPED, Escape.MAPPED, why)
    low, high = (", ".join(f"{value:g}" for value in corner) for corner in complete_m.tolist())
    why = f"from ({low}) to ({high}) m the map is declared complete: what it does not show is free"
    outside = "elsewhere only what was seen"
    if seen.flown != Escape.STRICT:
        outside = f"elsewhere only what was seen, and {seen.why.split('; unseen space', 1)[0]}"
    return EscapePlan(
        Escape.MAPPED, Escape.MAPPED, f"{why}; {outside}", start_free_m=seen.start_free_m
    )


def _over_drift(planner: Planner) -> str:
    """For how long ways out are verified in the wind that is known; nothing without any."""
    speed, library = float(np.linalg.norm(planner.settings.wind_mps)), planner.escapes
    if not speed or library is None:
        return ""
    return f", verified for {in_wind_s(library):.3g} s in a wind of {speed:.3g} m/s"


def settles(planner: Planner, library: EscapeLibrary, sensors: Sequence[AnySensor]) -> int | None:
    """Movements straight on, where nothing stands, until there is a way out in hand for good,
    wherever the wind that is known comes from; None where that never is."""
    after = 0
    for wind_mps in _winds(planner):
        settled = _settles(planner, library, sensors, wind_mps)
        if settled is None:
            return None
        after = max(after, settled)
    return after


def _wider_start_m(
    planner: Planner, library: EscapeLibrary, sensors: Sequence[AnySensor]
) -> float | None:
    """How far about the start has to count as free for a vehicle that can stop to leave it; None
    where it need not, or where that is farther than may be declared unasked.

    Between the ball about the vehicle and where sensors see the body's whole way, farther on where
    they are mounted ahead of its middle or above, lies what nobody can look at. A vehicle that
    cannot stop flies through it before it has a way out; one that can has one, and would stay.
    """
    least_m = planner.settings.start_free_m
    least_m = planner.automaton.step_m if least_m is None else least_m
    most_m = max(WIDER_START * planner.automaton.step_m, least_m)
    tried = (least_m + (most_m - least_m) * np.arange(1, START_STEPS + 1) / START_STEPS).tolist()

    def leaves(start_free_m: float) -> bool:
        settings = replace(planner.settings, start_free_m=start_free_m)
        return settles(replace(planner, settings=settings), library, sensors) == 0

    first = bisect_left(tried, True, key=leaves)
    return float(tried[first]) if first < len(tried) else None


def _winds(planner: Planner) -> list[FloatArray]:
    """The wind that is known before take-off, from all sides."""
    x, y, z = planner.settings.wind_mps
    speed = float(np.hypot(x, y))
    if not speed:
        return [np.array([0.0, 0.0, z])]
    return [np.array([a * speed, b * speed, z]) for a, b in ((1, 0), (0, 1), (-1, 0), (0, -1))]


def _settles(
    planner: Planner,
    library: EscapeLibrary,
    sensors: Sequence[AnySensor],
    wind_mps: FloatArray,
) -> int | None:
    straight = _straight(library)
    if straight is None:
        return None
    begun, attitude = 0, np.zeros(3)
    pairs = library.automaton.pairs
    if pairs is not None:
        attitude[0] = pairs.label_of(library.automaton.names[straight])
        begun = library.nearest(float(attitude[0]), 0.0)
    step = library.legs.path[begun, straight, -1, :3]
    duration = float(library.legs.duration_s[straight])
    step = step + duration * wind_mps
    free = free_space_for(planner, np.zeros(3))
    by_name = range_sensors(sensors)
    reach = planner.grid.range_m + planner.escape_reach_m
    most = SETTLED + int(np.ceil(2.0 * reach / max(float(np.linalg.norm(step)), 1e-9)))
    held = 0
    for at in range(min(most, 200)):
        state = State(at * step, attitude, time_s=at * duration)
        for name, sensor in by_name.items():
            free.take(sensor, Scan(np.zeros((0, 3)), state.time_s, sensor=name), state)
        situation = Situation(state, target_m=1e3 * step + 1.0, seen=free.seen, wind_mps=wind_mps)
        ways = WaysOut(planner, library, situation, in_reach(planner, situation))
        held = held + 1 if ways.after(straight) is not None else 0
        if held == SETTLED:
            return at + 1 - SETTLED
    return None


def _straight(library: EscapeLibrary) -> int | None:
    """The movement that leads farthest straight on in level flight."""
    ends = library.legs.path[0, :, -1]
    if library.automaton.pairs is not None:  # No measured way is quite straight, or quite level.
        level = np.abs(ends[:, 2]) <= NEARLY * ends[:, 0]
        ahead = (np.abs(ends[:, 3]) <= NEARLY) & level
    else:
        ahead = (np.abs(ends[:, 3]) < 1e-9) & (library.legs.following[0] == 0)
    if not ahead.any():
        return None
    return int(np.argmax(np.where(ahead, ends[:, 0], -np.inf)))


def _what_lacks(planner: Planner, library: EscapeLibrary, sensors: tuple[AnySensor, ...]) -> str:
    """Why no way out can be kept in hand, and which range would do."""
    lidars = [one for one in sensors if isinstance(one, Lidar)]
    reach = max((one.clears_to_m for one in lidars), default=0.0)
    body = planner.settings.body_radius_m
    speed = float(np.linalg.norm(planner.settings.wind_mps))
    blown = f" in a wind of {speed:.3g} m/s" if speed else ""
    lacks = (
        f"no way out of a body of {body:g} m fits into what sensors of {reach:g} m range see{blown}"
        "; unseen space counts as free, so there is no guarantee"
    )
    span_m = planner.settings.obstacles_span_m
    if span_m is None and are_level(sensors):
        return f"{lacks}; {LEVEL}"
    if span_m is not None and not span_m[0] + body <= 0.0 <= span_m[1] - body:
        return f"{lacks}; the start does not lie within obstacles_span_m by the body's radius"
    first = bisect_left(
        WIDER,
        True,
        key=lambda factor: settles(planner, library, _reaching(lidars, factor)) is not None,
    )
    if lidars and first < len(WIDER):
        return f"{lacks}; a range of {WIDER[first] * reach:.3g} m would do"
    return f"{lacks}; no range up to {WIDER[-1] * reach:.3g} m would do, the field of view may"


def _reaching(lidars: Sequence[Lidar], factor: float) -> tuple[Lidar, ...]:
    """The same LiDARs with more range."""
    return tuple(
        replace(
            one,
            pattern=replace(one.pattern, max_range_m=factor * one.clears_to_m),
            dark_range_m=None,
        )
        for one in lidars
    )
