"""Before take-off: the flight straight on, in empty air, that pre-flight promises rest on.

It is tried, not calculated: at every movement an escape through what was seen is looked for. What
cannot hold there holds nowhere. A vehicle flies it from its true start, since its place within the
voxels of seen space and its heading decide which voxels beams mark.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import count, product, takewhile

import numpy as np

from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray, compute_rotation, measure_length
from clearway.base.state import State
from clearway.live.inputs.range_sensing import free_space_for, start_room_m
from clearway.reach.escapes.library import EscapeLibrary
from clearway.sensors import AnySensor, Scan, range_sensors
from clearway.sensors.observed.free_space import FreeSpace
from clearway.vehicle.scale import voxel_m

NEARLY = 0.03
"""Slope and turn (rad) that a measured movement straight on may have."""
SETTLED = 6
"""Movements in a row that must have an escape."""
MOST_TRIED = 200
"""Movements of one trial."""
STARTS = 24
FIRSTS = 2
"""Places within a voxel, each with a heading, from which a vehicle that can stop has to leave; and
first movements from each, in turn, that must lead on."""
SPARES = (0.0, 0.25, 0.5)
"""Of a voxel, by which the start ball is less in a trial, in turn. It has to do with all of them: a
wider one may let a vehicle rise to where it sees no way on, which a smaller one did not."""
FINER = 0.5
"""Of a voxel: steps in which the start ball is widened."""
SPREAD = 1.0 / 1.1673039782614187 ** np.arange(1, 5)
"""Multiples of these, without their whole parts, fill a box of four sides evenly (Roberts' R4)."""
ORIGIN = State(np.zeros(3))


def settles(
    planner: Planner,
    library: EscapeLibrary,
    sensors: Sequence[AnySensor],
    start: State = ORIGIN,
) -> int | None:
    """Return the movements, straight on from a start, until there is an escape for good.

    Parameters
    ----------
    start
        Position (m, world frame) and heading; the flight is level.

    Returns
    -------
    int or None
        The most that any side needs which the wind may come from; None where one never has any.
    """
    after = 0
    for wind_mps in _winds(planner):
        settled = _find_settling(_Trial(planner, library, sensors, wind_mps), start)
        if settled is None:
            return None
        after = max(after, settled)
    return after


def start_ball_m(planner: Planner, library: EscapeLibrary, sensors: Sequence[AnySensor]) -> float:
    """Return how far about the start has to count as free for a vehicle that can stop to leave it.

    Between the ball about the vehicle and what sensors see of the body's whole way lies what nobody
    can look at; how much of it depends on where the start lies within its voxel, and on the
    heading. A vehicle that cannot stop flies through it before it has an escape. One that can holds
    its place, and would stay. So the ball has to do for every place and heading, and for wherever a
    first movement leads.

    Returns
    -------
    float
        Radius (m): at least what the settings declare, or the length of a movement; infinite where
        no ball within the range of the grid will do.
    """
    declared_m, range_m = planner.settings.start_free_m, planner.grid.range_m
    least_m = start_room_m(planner) if declared_m is None else declared_m
    wide_m = voxel_m(planner.settings.safety_margin_m, range_m)
    starts, winds, failed = _some_starts(wide_m), _winds(planner), 0
    for ball_m in takewhile(lambda r: r <= max(range_m, least_m), count(least_m, FINER * wide_m)):
        spared = [with_start_ball(planner, max(ball_m - s * wide_m, 0.0)) for s in SPARES]
        order = [(failed + n) % STARTS for n in range(STARTS)]  # What failed last comes first.
        stays = next(
            (
                n
                for n, wind in product(order, winds)
                if not _leaves(
                    _Trial(spared[n % len(SPARES)], library, sensors, wind), starts[n], FIRSTS * n
                )
            ),
            None,
        )
        if stays is None:
            return ball_m
        failed = stays
    return float(np.inf)


def with_start_ball(planner: Planner, radius_m: float) -> Planner:
    """Return the planner of a flight whose start declares a ball of so many metres free."""
    return planner.with_values(start_free_m=radius_m)


@dataclass(frozen=True)
class _Trial:
    """A flight in empty air."""

    planner: Planner
    library: EscapeLibrary
    sensors: Sequence[AnySensor]
    wind_mps: FloatArray
    """[3] world frame."""

    def begins(self, start: State) -> State:
        """Level, as the first decision takes it."""
        level = State(start.position_m, np.array([0.0, 0.0, start.attitude_rad[2]]))
        return self.library.automaton.in_class(level, None)

    def fly(self, state: State, movement: int) -> State:
        """Where a movement leads."""
        roll, pitch, yaw = state.attitude_rad.tolist()
        legs, automaton = self.library.legs, self.library.automaton
        at = self.library.nearest(roll, pitch)
        end = legs.path[at, movement, -1]
        lasts_s = float(legs.duration_s[movement])
        moved_m = compute_rotation(0.0, 0.0, yaw) @ end[:3] + lasts_s * self.wind_mps
        there = State(
            state.position_m + moved_m,
            np.array([0.0, 0.0, yaw + end[3]]),
            time_s=state.time_s + lasts_s,
        )
        classes = automaton.classes
        if classes is None:
            return automaton.in_class(there, None)
        label = self.library.attitudes[legs.following[at, movement], 0]
        return automaton.in_class(there, classes.class_at(float(label)))

    def look(self, free: FreeSpace, state: State) -> WaysOut:
        """Mark what a sweep of each sensor shows, and look for escapes."""
        for name, sensor in range_sensors(self.sensors).items():
            free.take(sensor, Scan(np.zeros((0, 3)), state.time_s, sensor=name), state)
        ahead = compute_rotation(*state.attitude_rad.tolist()) @ np.array([1.0, 0.0, 0.0])
        target_m = state.position_m + 1e3 * self.planner.grid.range_m * ahead
        wind_mps = self.wind_mps
        situation = Situation(state, target_m=target_m, seen=free.seen, wind_mps=wind_mps)
        near = gather_in_reach(self.planner, situation)
        return WaysOut(self.planner, self.library, situation, near)

    @cached_property
    def straight(self) -> int | None:
        """The movement that leads farthest straight on in level flight."""
        automaton, legs = self.library.automaton, self.library.legs
        ends = legs.path[0, :, -1]
        if automaton.classes is not None:  # No measured way is quite straight, or quite level.
            level = np.abs(ends[:, 2]) <= NEARLY * ends[:, 0]
            ahead = (np.abs(ends[:, 3]) <= NEARLY) & level
        else:
            ahead = (np.abs(ends[:, 3]) < 1e-9) & (legs.following[0] == 0)
        if not ahead.any():
            return None
        return int(np.argmax(np.where(ahead, ends[:, 0], -np.inf)))

    def straight_from(self, state: State) -> list[int]:
        """Movements straight on from a state, the farthest first: of a vehicle with inertia all,
        since it flies as fast as it sees; of others the one that is flown on and on."""
        if not self.library.automaton.has_inertia:
            return [] if self.straight is None else [self.straight]
        legs, at = self.library.legs, self._attitude(state)
        ends = legs.path[at, :, -1]
        ahead = (legs.following[at] >= 0) & (np.abs(ends[:, 1:]) < 1e-9).all(axis=1)
        found = np.flatnonzero(ahead & (ends[:, 0] > 0.0))
        farthest: list[int] = found[np.argsort(-ends[found, 0], kind="stable")].tolist()
        return farthest

    def onward_from(self, state: State) -> list[int]:
        """The movements that lead ahead."""
        at = self._attitude(state) if self.library.automaton.has_inertia else 0
        return np.flatnonzero(self.library.legs.path[at, :, -1, 0] > 0.0).tolist()

    def _attitude(self, state: State) -> int:
        roll, pitch, _ = state.attitude_rad.tolist()
        return self.library.nearest(roll, pitch)


def _find_settling(trial: _Trial, start: State, most: int = MOST_TRIED) -> int | None:
    """As `settles`, in one wind, within so many movements."""
    planner, state = trial.planner, trial.begins(start)
    straight = trial.straight_from(state)
    if not straight:
        return None
    free = free_space_for(planner, start.position_m)
    moved_m = measure_length(trial.fly(state, straight[0]).position_m - state.position_m)
    reach_m = planner.grid.range_m + planner.escape_reach_m
    all_seen = SETTLED + int(np.ceil(2.0 * reach_m / max(moved_m, 1e-9)))
    most, held = min(most, all_seen), 0
    for at in range(most):
        ways, straight = trial.look(free, state), trial.straight_from(state)
        flown = next((m for m in straight if ways.after(m) is not None), None)
        held = 0 if flown is None else held + 1
        if held == SETTLED:
            return at + 1 - SETTLED
        if at - held + SETTLED >= most or (flown is None and planner.automaton.has_inertia):
            return None
        state = trial.fly(state, straight[0] if flown is None else flown)
    return None


def _leaves(trial: _Trial, start: State, first: int) -> bool:
    """Whether a vehicle that can stop leaves a start, straight on and wherever some of its other
    first movements lead; first: the number of the first one of those."""
    if _find_settling(trial, start, SETTLED) != 0:
        return False
    here = trial.begins(start)
    onward = trial.onward_from(here)
    free = free_space_for(trial.planner, start.position_m)
    ways = trial.look(free, here)
    for number in range(first, first + FIRSTS):
        movement = onward[number % len(onward)]
        if ways.after(movement) is None:
            continue
        free = free_space_for(trial.planner, start.position_m)
        trial.look(free, here)
        state = trial.fly(here, movement)
        there = trial.look(free, state)
        if all(there.after(next_one) is None for next_one in trial.onward_from(state)):
            return False
    return True


def _some_starts(wide_m: float) -> list[State]:
    """Starts that differ by where in a voxel they lie, and by their heading."""
    shares = np.arange(STARTS)[:, None] * SPREAD % 1.0
    return [
        State(wide_m * share[:3], np.array([0.0, 0.0, 2.0 * np.pi * share[3]])) for share in shares
    ]


def _winds(planner: Planner) -> list[FloatArray]:
    """The wind that is known before take-off, from all sides."""
    x, y, z = planner.settings.wind_mps
    speed = float(np.hypot(x, y))
    if not speed:
        return [np.array([0.0, 0.0, z])]
    return [np.array([a * speed, b * speed, z]) for a, b in ((1, 0), (0, 1), (-1, 0), (0, -1))]
