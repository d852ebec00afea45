"""What a flight reports loudly: a pre-flight promise that is not kept, and a goal that is left.

The watch sees every decision. An alarm lasts from the decision where it holds first to the one
where it holds no more; a flight goes on as it would without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.hazards import Hazards
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.planner import Planner
from clearway.base.frames import measure_length
from clearway.base.state import State
from clearway.live.mission import Mission, Mode, Progress
from clearway.live.outputs.modes import ModeState
from clearway.sensors import AnySensor, Lidar

STAYS = 24.0
"""Movements within one place that are no pause: two full circles' time of a turn on the spot."""

LEVEL_DEG = 1.0
"""By which the middle of a field of view may be off the horizon, and count as on it, twice."""

MOST_FALSE = 0.01
"""Share of beams with false returns, above which an alarm is raised."""

MOST_SCATTER = 0.25
TIMES_STATED = 2.0
"""By which the own position scatters, in margins and in what is stated, without an alarm."""


class AlarmKind(StrEnum):
    """What is wrong."""

    NO_ESCAPE = "no escape"
    """None was found yet, later than the pre-flight check says for empty air."""
    STAYS = "stays"
    """The vehicle does not leave a place."""
    OFF_HEIGHT = "off height"
    """It climbs or sinks away from its goal, and nothing makes it."""
    FALSE_RETURNS = "false returns"
    """Many beams of a LiDAR return alone, and nothing bears them out: rain, dust, the sun."""
    OWN_POSITION = "own position"
    """The own position scatters more than its estimates state."""


class Alarm(NamedTuple):
    """One thing that is wrong at a decision."""

    kind: AlarmKind
    why: str
    breaks_promise: bool
    """Whether the pre-flight check promised otherwise: nothing stood in the way up to now."""


class AlarmFacts(NamedTuple):
    """What the watch looks at."""

    decision: Decision
    mode: ModeState
    progress: Progress
    mission: Mission
    had_escape: bool
    """Whether a certain escape was held at any time of the flight."""
    false_share: float = 0.0
    """Estimated share of the beams of a LiDAR with false returns."""
    scatter_m: float = 0.0
    """Estimated standard deviation of the own position, per axis."""


@dataclass(frozen=True)
class AlarmWatch:
    """What was seen of a flight up to its last decision; `after` makes the next one."""

    planner: Planner
    sensors: Sequence[AnySensor] = ()
    within: int | None = None
    """Movements after which an escape was promised where nothing stands in the way; None for no
    promise."""
    begun: State | None = None
    """Where the first decision was taken."""
    stays: State | None = None
    """Where the vehicle came to a place that it has not left since."""
    left_start: bool = False
    off_m: float = 0.0
    """How far it was above or below its leg."""
    in_empty_air: bool = True
    """Whether nothing has been in reach."""
    alarms: tuple[Alarm, ...] = ()
    """At the last decision."""

    def after(self, facts: AlarmFacts) -> AlarmWatch:
        """Return the watch after another decision."""
        state, hazards = facts.decision.state, facts.decision.hazards
        step_m, stays = self.planner.automaton.step_m, self.stays
        moved = stays is not None and measure_length(state.position_m - stays.position_m) > step_m
        if stays is None or moved:
            stays = state
        seen = replace(
            self,
            begun=self.begun or state,
            stays=stays,
            left_start=self.left_start or moved,
            off_m=_off_leg_m(facts),
            in_empty_air=self.in_empty_air and _is_empty(hazards),
        )
        found = (
            seen._no_escape(facts),
            seen._stays(facts),
            seen._off_height(facts, self),
            _false_returns(facts.false_share),
            seen._own_place(facts),
        )
        return replace(seen, alarms=tuple(alarm for alarm in found if alarm is not None))

    def afresh(self) -> AlarmWatch:
        """Return the watch of a flight that has not begun: nobody flies what is decided."""
        return AlarmWatch(self.planner, self.sensors, self.within)

    @property
    def _movement_s(self) -> float:
        return max(movement.duration_s for movement in self.planner.automaton.movements)

    def _no_escape(self, facts: AlarmFacts) -> Alarm | None:
        """The promise is for flight straight on; a goal behind takes half a circle more."""
        if self.within is None or self.begun is None or facts.had_escape:
            return None
        automaton = self.planner.automaton
        turning = np.ceil(np.pi * automaton.room_to_turn_m / max(automaton.step_m, 1e-9))
        flown = (facts.decision.state.time_s - self.begun.time_s) / self._movement_s
        if flown < self.within + turning + 0.5:
            return None
        why = (
            f"no escape through seen space is held after {flown:.0f} movements; the pre-flight "
            f"check found one after {self.within} in empty air: no guarantee up to now"
        )
        return Alarm(AlarmKind.NO_ESCAPE, why, self.in_empty_air)

    def _stays(self, facts: AlarmFacts) -> Alarm | None:
        begun, stays, state = self.begun, self.stays, facts.decision.state
        if begun is None or stays is None or facts.progress.is_done(facts.mission):
            return None
        stayed_s = state.time_s - stays.time_s
        if stayed_s < STAYS * self._movement_s:
            return None
        goal = facts.progress.goal
        left_m = measure_length(facts.mission.goals_m[goal] - state.position_m)
        place = "one place" if self.left_start else "its start"
        why = (
            f"the vehicle has not left {place} for {stayed_s:.0f} s, {left_m:.3g} m from goal "
            f"{goal + 1} ({facts.mode.mode}: {facts.mode.why})"
        )
        return Alarm(AlarmKind.STAYS, why, not self.left_start and self.in_empty_air)

    def _off_height(self, facts: AlarmFacts, before: AlarmWatch) -> Alarm | None:
        """Farther than one climb past the farthest thing that it sees, and farther still though
        nothing that stands there bars a cheaper way."""
        automaton, off_m = self.planner.automaton, abs(self.off_m)
        steepest = automaton.steepest_rad
        slope = 1.0 if steepest is None else min(1.0, float(np.sin(steepest)))
        allowed_m = self.planner.grid.range_m * slope + self.planner.settings.safety_margin_m
        if automaton.stays_level or off_m <= allowed_m:
            return None
        was = any(alarm.kind is AlarmKind.OFF_HEIGHT for alarm in before.alarms)
        direct = facts.mode.mode is Mode.NAVIGATION and not facts.progress.detour
        nothing_bars = direct or _is_empty(facts.decision.hazards)
        goes = off_m > abs(before.off_m) and nothing_bars
        if not (was or goes):
            return None
        where, doing = ("above", "climbing") if self.off_m > 0.0 else ("below", "sinking")
        why = f"{off_m:.0f} m {where} its leg" + (f" and {doing}" if goes else "")
        low, high = _field_deg(self.sensors)
        if abs(high + low) > LEVEL_DEG:
            why += (
                f"; its field of view from {low:.3g} to {high:.3g} deg lies unevenly about the "
                "horizon, which may be why"
            )
        return Alarm(AlarmKind.OFF_HEIGHT, why, breaks_promise=False)

    def _own_place(self, facts: AlarmFacts) -> Alarm | None:
        """The own position scatters more than the margin can bear without being reported."""
        stated_m, found_m = facts.decision.state.position_std_m, facts.scatter_m
        of_margin_m = MOST_SCATTER * self.planner.settings.safety_margin_m
        if found_m <= max(TIMES_STATED * stated_m, of_margin_m):
            return None
        why = (
            f"the own position scatters by {found_m:.2g} m (one standard deviation), where state "
            f"estimates say {stated_m:.2g} m: escapes pay for what is stated alone"
        )
        return Alarm(AlarmKind.OWN_POSITION, why, breaks_promise=False)


def _false_returns(share: float) -> Alarm | None:
    """More of them than flights were measured with."""
    if share <= MOST_FALSE:
        return None
    why = f"{say_false(share)} Above {100.0 * MOST_FALSE:g} % the way on is often not found"
    return Alarm(AlarmKind.FALSE_RETURNS, why, breaks_promise=False)


def say_false(share: float) -> str:
    """An estimated share of false returns in words."""
    return f"{100.0 * share:.2g} % of the beams return alone: rain or dust?"


def _is_empty(hazards: Hazards) -> bool:
    """Whether nothing is in reach."""
    return not any(len(each.radius_m) for each in (hazards.points, hazards.shapes, hazards.moving))


def _off_leg_m(facts: AlarmFacts) -> float:
    """Height above (or, negative, below) the heights between which the leg flown leads."""
    mission, progress = facts.mission, facts.progress
    z = float(facts.decision.state.position_m[2])
    goal = mission.goals_m[min(progress.goal, len(mission.goals_m) - 1)]
    heights = float(progress.find_left(mission)[2]), float(goal[2])
    return max(0.0, z - max(heights)) + min(0.0, z - min(heights))


def _field_deg(sensors: Sequence[AnySensor]) -> tuple[float, float]:
    """Lowest and highest direction (deg) in which LiDARs look in level flight; 0 and 0 without."""
    sines = [
        (one.mounting.body_from_sensor @ one.pattern.directions.T)[2]
        for one in sensors
        if isinstance(one, Lidar)
    ]
    if not sines:
        return 0.0, 0.0
    low, high = min(each.min() for each in sines), max(each.max() for each in sines)
    return float(np.degrees(np.arcsin(low))), float(np.degrees(np.arcsin(high)))
