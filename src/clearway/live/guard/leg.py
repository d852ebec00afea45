"""Where a wish leads a vehicle for the time that it counts, and then to where an escape may begin.

A vehicle that can stop gets from one velocity to another at a bounded acceleration; one that cannot
turns towards the wished direction, no faster than its movements do, at its own speed, and then to
the nearest pitch that its movements keep: circles flown at another one would climb or sink.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance.clear.verify import Paths
from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.grid_frame import GridFrame
from clearway.base.state import State
from clearway.live.guard.braking import Braking
from clearway.live.guard.wish import PathWish, VelocityWish, Wish
from clearway.vehicle.automaton import MovementAutomaton

PART_SAMPLES = 8
"""Places along each part that are looked at."""
LEVEL_M = 1e-9
"""Heights that differ by no more are the same."""
SHORTEST_S = 1e-3
"""A vehicle that brakes for less stands at once."""
SLOWEST_MPS = 1e-9
"""A vehicle that brakes from less stands at once."""


@dataclass(frozen=True, slots=True, eq=False)
class LegPart:
    """One part of a leg: places at equal times."""

    end_s: float
    """From the beginning of the leg."""
    places_m: FloatArray
    """[SAMPLES, 3] world frame, the last at the end."""
    velocity_mps: FloatArray
    """[SAMPLES, 3]"""
    attitude_rad: FloatArray
    """[SAMPLES, 3]"""
    sagitta_m: float
    """How far the way may lie from chords between the places."""


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """Where a wish leads from an own state."""

    start: State
    velocity_mps: FloatArray
    """[3] at the start."""
    parts: tuple[LegPart, ...]

    @property
    def end_s(self) -> float:
        """From its beginning."""
        return self.parts[-1].end_s

    @property
    def end(self) -> State:
        """Where what comes after it begins."""
        last = self.parts[-1]
        return replace(
            self.start,
            position_m=last.places_m[-1],
            attitude_rad=last.attitude_rad[-1],
            time_s=self.start.time_s + self.end_s,
        )

    @property
    def lowest_m(self) -> float:
        """Height that it does not go below on its way, world frame; a level part does not sag."""
        lowest, begins_m = np.inf, float(self.start.position_m[2])
        for part in self.parts:
            heights = part.places_m[:, 2]
            level = float(np.abs(heights - begins_m).max()) <= LEVEL_M
            lowest = min(lowest, float(heights.min()) - (0.0 if level else part.sagitta_m))
            begins_m = float(heights[-1])
        return float(lowest)

    @property
    def length_m(self) -> float:
        """No place on it lies farther from its start."""
        gaps = [np.linalg.norm(p.places_m - self.start.position_m, axis=1) for p in self.parts]
        return float(np.max(gaps)) + max(part.sagitta_m for part in self.parts)

    def paths(self, frame: GridFrame) -> Paths:
        """As verification takes it, in the grid's frame."""
        return Paths(
            np.arange(-1, len(self.parts) - 1, dtype=np.int32),
            np.ascontiguousarray([frame.grid_points(part.places_m) for part in self.parts]),
            np.array([part.sagitta_m for part in self.parts]),
            np.array([part.end_s for part in self.parts]),
        )

    def at(self, elapsed_s: float) -> tuple[State, FloatArray]:
        """State and velocity [3] at a time from the beginning, held at the end."""
        times, rows = [0.0], [
            np.concatenate([self.start.position_m, self.start.attitude_rad, self.velocity_mps])
        ]  # fmt: skip
        begins_s = 0.0
        for part in self.parts:
            shares = np.arange(1, PART_SAMPLES + 1) / PART_SAMPLES
            times += (begins_s + shares * (part.end_s - begins_s)).tolist()
            rows += list(np.hstack([part.places_m, part.attitude_rad, part.velocity_mps]))
            begins_s = part.end_s
        table = np.array(rows)
        now = np.array([np.interp(elapsed_s, times, column) for column in table.T])
        state = replace(
            self.start,
            position_m=now[:3],
            attitude_rad=now[3:6],
            time_s=self.start.time_s + elapsed_s,
        )
        return state, now[6:]


def leg_of(
    wish: Wish,
    state: State,
    velocity_mps: FloatArray,
    automaton: MovementAutomaton,
    hold_s: float,
    braking: Braking,
    gains: Braking | None = None,
) -> Leg:
    """The leg of a wish: flown for `hold_s`, and then to a stop where the vehicle can.

    velocity_mps: [3] the own one. gains: how the vehicle comes to the wish; default: as it brakes.
    """
    if not automaton.can_stop:
        return _turning(_direction(wish, state, automaton, hold_s), state, automaton, hold_s)
    if automaton.has_inertia:
        # Roll and pitch are the autopilot's: at its end the vehicle is at rest.
        state = automaton.in_class(state, None)
    if isinstance(wish, PathWish) and not automaton.has_inertia:
        way = wish.ahead_of(state.position_m, wish.speed_mps * hold_s)
        first = _along(way, state, wish.speed_mps, hold_s)
        begins = velocity_mps
    else:
        wished, rate = wish.velocity_from(state.position_m, hold_s), 0.0
        if isinstance(wish, VelocityWish):
            rate = wish.yaw_rate_rps
        first = _changing(state, 0.0, velocity_mps, wished, hold_s, gains or braking, rate)
        begins = velocity_mps if math.isfinite(braking.acceleration_mps2) else wished
    fast = float(np.linalg.norm(first.velocity_mps[-1]))
    brake_s = braking.late_s + fast / braking.acceleration_mps2
    if brake_s < SHORTEST_S or fast < SLOWEST_MPS:
        return Leg(state, begins, (first,))
    there = replace(
        state, position_m=first.places_m[-1], attitude_rad=first.attitude_rad[-1]
    )  # fmt: skip
    brakes = _changing(there, hold_s, first.velocity_mps[-1], np.zeros(3), brake_s, braking, 0.0)
    return Leg(state, begins, (first, brakes))


def _changing(
    state: State,
    begins_s: float,
    own_mps: FloatArray,
    wished_mps: FloatArray,
    lasts_s: float,
    braking: Braking,
    yaw_rate_rps: float,
) -> LegPart:
    """From one velocity to another, and then straight on."""
    times = lasts_s * np.arange(1, PART_SAMPLES + 1) / PART_SAMPLES
    change = wished_mps - own_mps
    changes_s = float(np.linalg.norm(change)) / braking.acceleration_mps2
    changing = np.clip(times - braking.late_s, 0.0, changes_s)
    velocity = np.tile(wished_mps, (PART_SAMPLES, 1))
    ways = times[:, None] * wished_mps
    sagitta = 0.0
    if changes_s > 0.0:
        share = changing / changes_s
        velocity = own_mps + share[:, None] * change
        lag = np.minimum(times, braking.late_s) + changing - 0.5 * changing * share
        ways = ways - lag[:, None] * change
        sagitta = braking.acceleration_mps2 * (lasts_s / PART_SAMPLES) ** 2 / 8.0
    attitude = np.tile(state.attitude_rad, (PART_SAMPLES, 1))
    attitude[:, 2] += yaw_rate_rps * times
    return LegPart(begins_s + lasts_s, state.position_m + ways, velocity, attitude, sagitta)


def _along(way_m: FloatArray, state: State, speed_mps: float, lasts_s: float) -> LegPart:
    """Along corners [k, 3] at a speed; stopped at the last."""
    lengths = np.linalg.norm(np.diff(way_m, axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(lengths)])
    times = lasts_s * np.arange(1, PART_SAMPLES + 1) / PART_SAMPLES
    reached = np.minimum(speed_mps * times, gone[-1])
    places = np.stack([np.interp(reached, gone, way_m[:, axis]) for axis in range(3)], axis=1)
    steps = np.diff(np.concatenate([state.position_m[None], places]), axis=0)
    velocity = steps * (PART_SAMPLES / lasts_s)
    # A corner, or the end, between two places is cut by no more than half the way between them.
    sagitta = 0.5 * speed_mps * lasts_s / PART_SAMPLES if len(way_m) > 2 else 0.0
    attitude = np.tile(state.attitude_rad, (PART_SAMPLES, 1))
    return LegPart(lasts_s, places, velocity, attitude, sagitta)


def _direction(wish: Wish, state: State, automaton: MovementAutomaton, hold_s: float) -> FloatArray:
    """[3] where a wish leads; straight on where it says nothing."""
    if isinstance(wish, PathWish):
        ahead_m = automaton.fastest_mps * hold_s + automaton.step_m
        direction: FloatArray = wish.ahead_of(state.position_m, ahead_m)[-1] - state.position_m
        return direction
    return wish.velocity_mps


def _turning(
    direction: FloatArray, state: State, automaton: MovementAutomaton, hold_s: float
) -> Leg:
    """Towards a direction as fast as the movements turn, at their speed."""
    movements = automaton.movements
    speed = automaton.fastest_mps
    most = np.array(
        [
            max(abs(movement.pitch_rate_rps) for movement in movements),
            max(abs(movement.yaw_rate_rps) for movement in movements),
        ]
    )
    size = float(np.linalg.norm(direction))
    _, pitch, yaw = state.attitude_rad.tolist()
    off = np.zeros(2)
    if size > 0.0:
        wished = math.asin(max(-1.0, min(1.0, -float(direction[2]) / size)))
        if automaton.pitch_limit_rad is not None:
            limit = automaton.pitch_limit_rad
            wished = max(-limit, min(limit, wished))
        level = math.hypot(direction[0], direction[1])
        aside = math.atan2(direction[1], direction[0]) - yaw if level > 1e-9 * size else 0.0
        off = np.array([wished - pitch, float(wrap_angle(np.asarray(aside)))])
    rates = np.clip(off / hold_s, -most, most)
    first = _hold_rates(state, 0.0, speed, rates, hold_s, automaton)
    begins = speed * state.world_from_body[:, 0]
    left, took_s = _to_kept_pitch(float(first.attitude_rad[-1, 1]), automaton, float(most[0]))
    if took_s == 0.0:
        return Leg(state, begins, (first,))
    there = replace(state, position_m=first.places_m[-1], attitude_rad=first.attitude_rad[-1])
    levels = _hold_rates(there, hold_s, speed, np.array([left / took_s, 0.0]), took_s, automaton)
    return Leg(state, begins, (first, levels))


def off_kept_pitch(pitch_rad: float, automaton: MovementAutomaton) -> float:
    """By how much to pitch down to the nearest pitch that movements keep; none where all do."""
    kept = np.array(automaton.start_pitches_rad)
    return float(kept[np.argmin(np.abs(kept - pitch_rad))] - pitch_rad)


def _to_kept_pitch(
    pitch_rad: float, automaton: MovementAutomaton, most_rps: float
) -> tuple[float, float]:
    """What is to be pitched, and for how long."""
    off = off_kept_pitch(pitch_rad, automaton)
    return (off, abs(off) / most_rps) if abs(off) > 1e-9 and most_rps > 0.0 else (0.0, 0.0)


def _hold_rates(
    state: State,
    begins_s: float,
    speed: float,
    rates: FloatArray,
    lasts_s: float,
    automaton: MovementAutomaton,
) -> LegPart:
    """Constant rates of pitch and yaw [2]."""
    inputs = np.array([speed, 0.0, rates[0], rates[1]])
    times = lasts_s * np.arange(1, PART_SAMPLES + 1) / PART_SAMPLES
    states = np.array([automaton.vehicle.advance(state.vector, inputs, t) for t in times])
    ahead = _nose(states[:, 4], states[:, 5])
    turned = float(np.hypot(*rates)) * lasts_s
    sagitta = speed * lasts_s * turned / (8.0 * PART_SAMPLES**2)
    return LegPart(begins_s + lasts_s, states[:, :3], speed * ahead, states[:, 3:], sagitta)


def _nose(pitch_rad: FloatArray, yaw_rad: FloatArray) -> FloatArray:
    """[n, 3] where the nose points, world frame (4.3)."""
    level = np.cos(pitch_rad)
    return np.stack([level * np.cos(yaw_rad), level * np.sin(yaw_rad), -np.sin(pitch_rad)], axis=1)
