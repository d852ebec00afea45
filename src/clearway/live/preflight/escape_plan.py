"""Before take-off: whether what the sensors see leaves a held escape at every decision.

It is tried, not calculated: in the emptiest world there is, the vehicle flies straight on from its
true start (`straight_trial`). What cannot hold there holds nowhere.
"""

from __future__ import annotations

import hashlib
import pickle
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from clearway.avoidance.escape.terms import in_wind_s
from clearway.avoidance.plan.costs import price_of
from clearway.avoidance.plan.held_escape import BY_SIGHT, SEES, Escape
from clearway.avoidance.plan.planner import Planner
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.inputs.range_sensing import start_room_m
from clearway.live.preflight.doubts import (
    are_level,
    over_drop_outs,
    over_false_returns,
    over_unsure,
    over_wide_margin,
)
from clearway.live.preflight.straight_trial import ORIGIN, settles, start_ball_m, with_start_ball
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.escapes.library import EscapeLibrary
from clearway.sensors import AnySensor, Lidar
from clearway.vehicle.scale import voxel_m

WIDER = (1.1, 1.25, 1.5, 2.0, 3.0, 4.0)
"""Ranges that are tried where the sensor's own does not do, in its own."""
MOST_PLANS = 64
"""Kept in a process."""
WIDER_START = 3.0
"""In movements, or margins where these are longer, how far about the start is declared free at most
where less would leave a vehicle that can stop where it is for ever."""
UNSURE = "unobserved space counts as free: no guarantee"
T = TypeVar("T")
COLUMNS = (
    "as declared by obstacles_span_m, whatever stands between {:g} and {:g} m reaches through all "
    "heights between them"
)
LEVEL = (
    "the sensor shows one level plane; where whatever stands reaches through all heights flown at, "
    "set safety.obstacles_span_m = [lowest, highest]"
)
BUDGETED = (
    "every decision keeps an escape through observed free space, or where there is none, one of "
    "which at most {:g} m lead through unobserved space: no guarantee, the measured risk stands in "
    "docs/sight.md; "
)
FARTHER = "near the start sensors do not show all space that the body needs"


@dataclass(frozen=True)
class EscapePlan:
    """Which escapes a flight asks for, and why."""

    asked: str
    flown: str
    why: str
    within: int | None = None
    """After how many movements one is there where nothing stands in the way; None if not known."""
    start_free_m: float | None = field(default=None, repr=False)
    """Radius of the ball about the start that counts as free, where more is needed than a
    movement's length; None for what was asked for."""
    insists: bool = field(default=False, repr=False)
    """With `known`: whether escapes through seen space are insisted on while these lead on."""

    def adapt_planner(self, planner: Planner) -> Planner:
        """A planner that flies so.

        Who asks for a smaller margin than the body's radius does not ask to be touched: where an
        escape is asked for, that radius is kept.
        """
        settings, start_free_m = planner.settings, self.start_free_m
        if self.flown != Escape.OFF:
            margin_m = max(settings.safety_margin_m, settings.body_radius_m)
            if margin_m != settings.safety_margin_m:
                settings = replace(settings, safety_margin_m=margin_m)
        if self.flown != settings.escape:
            settings = replace(settings, escape=self.flown, unobserved_m=0.0)
        if start_free_m is not None:
            settings = replace(settings, start_free_m=start_free_m)
        return planner if settings is planner.settings else replace(planner, settings=settings)

    def count_unobserved_as_free(self) -> EscapePlan:
        """Return the plan by which unobserved space counts as free from the start."""
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
        return f"escape {flown}: {self.why}"


def escape_plan(
    planner: Planner,
    sensors: Sequence[AnySensor],
    obstacle_map: ObstacleMap | None = None,
    start: State | None = None,
) -> EscapePlan:
    """What the sensors, the vehicle, the margin and the map allow of what was asked for.

    start: where the flight begins and heads, which is where it is tried, and how far off own state
    estimates are declared to be; None for the origin, ahead.
    """
    span_m = planner.settings.obstacles_span_m
    plan = _escape_plan_of(planner, sensors, obstacle_map, start or ORIGIN)
    if span_m is not None and plan.flown in SEES:
        plan = replace(plan, why=f"{plan.why}; {COLUMNS.format(*span_m)}")
    doubts = over_wide_margin(planner, plan.flown) + over_drop_outs(sensors, plan.flown)
    doubts += over_false_returns(sensors)
    if start is not None and plan.flown in BY_SIGHT:
        doubts += over_unsure(planner, start)
    return replace(plan, why=plan.why + doubts) if doubts else plan


def _escape_plan_of(
    planner: Planner,
    sensors: Sequence[AnySensor],
    obstacle_map: ObstacleMap | None,
    start: State,
) -> EscapePlan:
    complete_m = None if obstacle_map is None else obstacle_map.complete_m
    if planner.settings.escape == Escape.MAPPED and complete_m is not None:
        return _by_map(planner, tuple(sensors), complete_m, start)
    place = start.position_m.tobytes() + start.attitude_rad[2:].tobytes()
    key = _content(planner, sensors)
    return _keep(_plans, key and key + place, lambda: _escape_plan(planner, tuple(sensors), start))


_plans: dict[bytes, EscapePlan] = {}
"""What was tried in this process: campaigns and batches fly one vehicle a thousand times."""
_start_balls_m: dict[bytes, float] = {}
"""How wide the start ball of a vehicle that can stop has to be, from wherever it starts."""


def _keep(kept: dict[bytes, T], key: bytes | None, find: Callable[[], T]) -> T:
    """What is kept under a key, or found now; without a key always the latter."""
    if key is None:
        return find()
    if key not in kept:
        while len(kept) >= MOST_PLANS:
            del kept[next(iter(kept))]
        kept[key] = find()
    return kept[key]


def _content(planner: Planner, sensors: Sequence[AnySensor]) -> bytes | None:
    """Equal where the same is tried; None where a sensor of one's own cannot be reported by
    content."""
    library = planner.escapes
    tried = (planner.settings, planner.grid.range_m, planner.horizon_s, tuple(sensors))
    try:
        told = pickle.dumps(tried)
    except Exception:  # whatever an own sensor holds
        return None
    return hashlib.sha256(told + (b"" if library is None else library.key)).digest()


def _start_ball_of(
    planner: Planner, library: EscapeLibrary, sensors: tuple[AnySensor, ...], start: State
) -> float:
    """By `start_ball_m`, once for all starts of a height; it is tried about the origin."""
    span_m = planner.settings.obstacles_span_m
    if span_m is not None:
        start_m = float(start.position_m[2])
        lowered_m = (span_m[0] - start_m, span_m[1] - start_m)
        settings = replace(planner.settings, obstacles_span_m=lowered_m)
        planner = replace(planner, settings=settings)
    key = _content(planner, sensors)
    return _keep(_start_balls_m, key, lambda: start_ball_m(planner, library, sensors))


def _escape_plan(planner: Planner, sensors: tuple[AnySensor, ...], start: State) -> EscapePlan:
    asked = planner.settings.escape
    library = planner.escapes
    if asked == Escape.OFF or not planner.settings.verify:
        return EscapePlan(asked, Escape.OFF, "no escape is asked for")
    if library is None:
        return EscapePlan(
            asked, Escape.OFF, "no movements of the automaton close a loop or stop: no escapes"
        )
    if asked == Escape.KNOWN:
        return _settle_unobserved(planner, sensors, start)
    unmapped = "no map is declared complete; " if asked == Escape.MAPPED else ""
    if not sensors:
        return EscapePlan(
            asked,
            Escape.KNOWN,
            f"{unmapped}no range sensor sees what is free: no guarantee",
        )
    if planner.automaton.has_inertia and planner.settings.start_free_m is None:
        return _from_rest(planner, library, sensors, start, unmapped)
    after = settles(planner, library, sensors, start)
    if after is None:
        past_blind = _past_blind(planner, sensors, start)
        if past_blind is not None:
            return past_blind
        why = unmapped + _what_lacks(planner, library, sensors, start)
        return EscapePlan(asked, Escape.KNOWN, why)
    more, start_free_m = "", None
    if planner.automaton.can_stop:
        declared_m, step_m = planner.settings.start_free_m, start_room_m(planner)
        needed_m = _start_ball_of(planner, library, sensors, start)
        would = "no ball around the start would do, a wider field of view may"
        if needed_m < np.inf:
            would = f"start_free_m = {needed_m:.3g} would do"
        may_stay = f"{FARTHER}: it may stay where it starts, {would}"
        if declared_m is None and needed_m > step_m:
            most_m = WIDER_START * max(step_m, planner.settings.safety_margin_m)
            start_free_m = min(needed_m, most_m)
            widened = settles(with_start_ball(planner, start_free_m), library, sensors, start)
            if widened == 0:
                after, more = 0, f"; {FARTHER}: {start_free_m:.3g} m around the start count as free"
            elif any(planner.settings.wind_mps):  # Blown off, it cannot hold there for ever.
                start_free_m = None
            else:
                return EscapePlan(asked, Escape.KNOWN, f"{unmapped}{may_stay}; {UNSURE}")
        if needed_m > (start_free_m or declared_m or step_m):
            more = f"{more}; {may_stay}"
    kept = "every decision keeps an escape through observed free space, "
    if asked == Escape.BUDGETED:
        kept = BUDGETED.format(planner.settings.unobserved_m)
    first = f"from movement {after + 1} on if it flies straight ahead in empty air"
    return EscapePlan(
        asked,
        Escape.BUDGETED if asked == Escape.BUDGETED else Escape.STRICT,
        f"{unmapped}{kept}{first}{_over_drift(planner)}{more}",
        within=after,
        start_free_m=start_free_m,
    )


def _from_rest(
    planner: Planner,
    library: EscapeLibrary,
    sensors: tuple[AnySensor, ...],
    start: State,
    unmapped: str,
) -> EscapePlan:
    """Of a vehicle with inertia: it begins at rest, and leaves once it sees where it can stop."""
    asked, room_m = planner.settings.escape, start_room_m(planner)
    needed_m = _start_ball_of(planner, library, sensors, start)
    # In the ball it has escapes whatever the sensors see; out of it one level plane shows it none.
    level = planner.settings.obstacles_span_m is None and are_level(sensors)
    if level or needed_m > WIDER_START * room_m:
        why = unmapped + _what_lacks(planner, library, sensors, start)
        return EscapePlan(asked, Escape.KNOWN, why)
    more = ""
    if needed_m > room_m:
        more = f"; {FARTHER}: {needed_m:.3g} m around the start count as free"
    return EscapePlan(
        asked,
        Escape.STRICT,
        f"{unmapped}every decision keeps an escape that brakes to rest within observed "
        f"free space{_over_drift(planner)}{more}",
        within=0,
        start_free_m=needed_m,
    )


def _past_blind(
    planner: Planner, sensors: tuple[AnySensor, ...], start: State
) -> EscapePlan | None:
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
    least_m = start_room_m(planner) if declared_m is None else declared_m
    needed_m = max(blind_m, default=0.0)
    most_m = max(WIDER_START * start_room_m(planner), least_m)
    if not least_m < needed_m <= most_m:
        return None
    wider, library = with_start_ball(planner, needed_m), planner.escapes
    if planner.automaton.can_stop and library is not None:
        needed_m = _start_ball_of(wider, library, sensors, start)
        wider = with_start_ball(planner, needed_m)
    plan = _escape_plan(wider, sensors, start)
    if plan.flown not in BY_SIGHT or needed_m > most_m:
        return None
    if declared_m is not None:
        why = f"sensors are blind near the start; start_free_m = {needed_m:.3g} would do; {UNSURE}"
        return EscapePlan(plan.asked, Escape.KNOWN, why)
    why = f"{plan.why}; sensors are blind near: {needed_m:.3g} m around the start count as free"
    return replace(plan, why=why, start_free_m=needed_m)


def _settle_unobserved(
    planner: Planner, sensors: tuple[AnySensor, ...], start: State
) -> EscapePlan:
    """Where unobserved space may count as free; what can stop, and who pays nothing for want of
    room, waits on no more than that."""
    unsure = EscapePlan(Escape.KNOWN, Escape.KNOWN, UNSURE)
    if planner.automaton.can_stop or price_of(planner.prices.no_room) == 0.0:
        return unsure
    strict = planner.with_values(escape=Escape.STRICT)
    seen = _escape_plan(strict, sensors, start)
    if seen.flown != Escape.STRICT:
        return unsure
    why = f"escapes lead through observed free space while some lead on; then {UNSURE}"
    return replace(seen, asked=Escape.KNOWN, flown=Escape.KNOWN, why=why, insists=True)


def _by_map(
    planner: Planner, sensors: tuple[AnySensor, ...], complete_m: FloatArray, start: State
) -> EscapePlan:
    """Where a map is declared complete."""
    strict = planner.with_values(escape=Escape.STRICT)
    seen = _escape_plan_of(strict, sensors, None, start)
    if seen.flown == Escape.OFF:
        return replace(seen, asked=Escape.MAPPED)
    if np.all(np.isinf(complete_m)):
        why = "the map is declared complete: what neither it nor a sensor shows to stand is free"
        return EscapePlan(Escape.MAPPED, Escape.MAPPED, why)
    low, high = (", ".join(f"{value:g}" for value in corner) for corner in complete_m.tolist())
    why = f"from ({low}) to ({high}) m the map is declared complete: what it does not show is free"
    outside = "elsewhere only what was seen"
    if seen.flown != Escape.STRICT:
        outside = f"elsewhere only what was seen, and {seen.why.split('; unobserved space', 1)[0]}"
    return EscapePlan(
        Escape.MAPPED, Escape.MAPPED, f"{why}; {outside}", start_free_m=seen.start_free_m
    )


def _over_drift(planner: Planner) -> str:
    """For how long escapes are verified in the wind that is known; nothing without any."""
    speed, library = float(np.linalg.norm(planner.settings.wind_mps)), planner.escapes
    if not speed or library is None:
        return ""
    return f", verified for {in_wind_s(library):.3g} s in a wind of {speed:.3g} m/s"


def _what_lacks(
    planner: Planner, library: EscapeLibrary, sensors: tuple[AnySensor, ...], start: State
) -> str:
    """Why no escape can be held, and which range would do."""
    lidars = [one for one in sensors if isinstance(one, Lidar)]
    reach = max((one.clears_to_m for one in lidars), default=0.0)
    body = planner.settings.body_radius_m
    speed = float(np.linalg.norm(planner.settings.wind_mps))
    blown = f" in a wind of {speed:.3g} m/s" if speed else ""
    lacks = (
        f"no escape of a body of {body:g} m fits into what sensors of {reach:g} m range see{blown}"
        "; unobserved space counts as free, so there is no guarantee"
    )
    span_m = planner.settings.obstacles_span_m
    if span_m is None and are_level(sensors):
        return f"{lacks}; {LEVEL}"
    if span_m is not None and not span_m[0] + body <= 0.0 <= span_m[1] - body:
        return f"{lacks}; the start does not lie within obstacles_span_m by the body's radius"
    first = bisect_left(
        WIDER,
        True,
        key=lambda factor: settles(planner, library, _reaching(lidars, factor), start) is not None,
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
