"""Own state estimates as they come: where the vehicle was when a scan was taken, and where it is
now."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.situation import CALM
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import State
from clearway.live.inputs.readings import TIME_TOLERANCE_S
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.class_table import ClassTable

COURSE_MPS = 0.5
"""Slower, noise turns the course, and the nose says where the vehicle will fly."""
Leg = tuple[Movement, float]
"""A movement, and for how long it was flown, s."""


class FlownPart(NamedTuple):
    """A part of a movement that was flown."""

    at: int
    """Class in which the movement began."""
    movement: int
    first: float
    """Share of the movement at which the part begins."""
    last: float


def split_velocity(velocity_mps: FloatArray) -> tuple[float, float]:
    """Speed over ground and rate of climb of a velocity [3]."""
    return float(np.hypot(velocity_mps[0], velocity_mps[1])), float(velocity_mps[2])


def carry_state_on(state: State, velocity_mps: FloatArray, time_s: float) -> State:
    """A state carried straight on to a time by its velocity [3], and turned into its course; one
    that is slow keeps its heading."""
    level_mps, _ = split_velocity(velocity_mps)
    attitude = state.attitude_rad
    if level_mps >= COURSE_MPS:
        attitude = np.array([*attitude[:2], np.arctan2(velocity_mps[1], velocity_mps[0])])
    place = state.position_m + velocity_mps * (time_s - state.time_s)
    return replace(state, position_m=place, attitude_rad=attitude, time_s=time_s)


class Flown:
    """All movements flown in the last seconds, and those being flown now.

    Between two plans, and after the last, what is flown is not known.
    """

    def __init__(self, automaton: MovementAutomaton, history_s: float) -> None:
        self._automaton, self._history_s = automaton, history_s
        self._buffers: deque[MovementBuffer] = deque()
        self._began: deque[int | None] = deque()  # The class of motion at the start of each.
        self._asked: tuple[float, float, list[Leg]] | None = None  # The latest `_legs`.
        self.wind_mps = CALM
        """[3] that carries the vehicle, world frame."""

    def then(self, buffer: MovementBuffer, at: int | None = None) -> None:
        """From the start of a buffer on it is flown, and no longer what was before (6.3).

        at: the class of motion there; None for the one that what was flown led to.
        """
        if not buffer.entries:
            return
        self.until(buffer.start_s)
        self._began.append(self.class_at(buffer.start_s) if at is None else at)
        self._buffers.append(buffer)
        oldest = buffer.start_s - self._history_s
        while self._buffers[0].end_s < oldest or not self._buffers[0].entries:
            self._buffers.popleft()
            self._began.popleft()

    def until(self, time_s: float) -> None:
        """From a time on it is not known what is flown."""
        self._asked = None
        if self._buffers:
            self._buffers[-1] = self._buffers[-1].until(time_s)

    def carry(self, state: State, time_s: float) -> State:
        """A state carried to a later time along all that was flown since (4.16), and by wind."""
        carried = self.carry_in_calm(state, time_s)
        if carried is state or not any(self.wind_mps.tolist()):
            return carried
        by_wind_m = self.wind_mps * (time_s - state.time_s)
        return replace(carried, position_m=carried.position_m + by_wind_m)

    def carry_in_calm(self, state: State, time_s: float) -> State:
        """The same without any wind."""
        if time_s - state.time_s <= 1e-9:
            return state
        vector = self._vector_in_calm(state, time_s)
        return replace(state, position_m=vector[:3], attitude_rad=vector[3:], time_s=time_s)

    def place_in_calm_m(self, state: State, time_s: float) -> FloatArray:
        """[3] where `carry_in_calm` leads."""
        if time_s - state.time_s <= 1e-9:
            return state.position_m
        return self._vector_in_calm(state, time_s)[:3]

    def _vector_in_calm(self, state: State, time_s: float) -> FloatArray:
        if self._automaton.classes is not None:
            return self._vector_by_classes(state, time_s, self._automaton.classes)
        vector = state.vector
        for movement, duration_s in self._legs(state.time_s, time_s):
            vector = self._automaton.predict(vector, movement, duration_s)
        return vector

    def _vector_by_classes(self, state: State, time_s: float, classes: ClassTable) -> FloatArray:
        """Along parts of movements, each begun in its class; roll and pitch stay its own."""
        vector = state.vector
        for part in self._parts(state.time_s, time_s, classes):
            begins = classes.along(part.at, part.movement, part.first)
            x, y, z, turned = (classes.along(part.at, part.movement, part.last) - begins).tolist()
            heading = vector[5] - begins[3]
            cosine, sine = np.cos(heading), np.sin(heading)
            vector[0] = vector[0] + cosine * x - sine * y
            vector[1] = vector[1] + sine * x + cosine * y
            vector[2] = vector[2] + z
            vector[5] = vector[5] + turned
        return vector

    def _parts(self, start_s: float, end_s: float, classes: ClassTable) -> Iterator[FlownPart]:
        """What was flown between two times, movement by movement."""
        for buffer, began in zip(self._buffers, self._began, strict=True):
            at = classes.first if began is None else began
            for entry in buffer.entries:
                movement, lasts_s = classes.names.index(entry.movement.name), entry.duration_s
                # What is left of one that was under way is flown as if it began there.
                whole_s = entry.movement.duration_s
                first_s = max(start_s - entry.start_s, 0.0)
                last_s = min(end_s - entry.start_s, lasts_s)
                if last_s - first_s > TIME_TOLERANCE_S:
                    yield FlownPart(at, movement, first_s / whole_s, last_s / whole_s)
                at = classes.after(at, movement)

    def motion_at(self, time_s: float) -> tuple[float, float] | None:
        """Speed and rate of climb of what was flown at a time; None where that is not known."""
        classes = self._automaton.classes
        if classes is None or not classes.has_speeds:
            return None
        before_s = time_s - 2.0 * TIME_TOLERANCE_S
        found = list(self._parts(before_s, time_s, classes))
        if not found:
            return None
        return classes.motion_along(found[-1].at, found[-1].movement, found[-1].last)

    def class_at(self, time_s: float) -> int | None:
        """The class of motion at the end of the movement flown before a time, or being flown; None
        where nothing was flown, and where there are no classes."""
        classes = self._automaton.classes
        if classes is None:
            return None
        for buffer, began in zip(reversed(self._buffers), reversed(self._began), strict=True):
            begun = [e for e in buffer.entries if e.start_s < time_s - TIME_TOLERANCE_S]
            if begun:
                at = classes.first if began is None else began
                for entry in begun:
                    at = classes.after(at, classes.names.index(entry.movement.name))
                return at
        return None

    def unknown_s(self, start_s: float, end_s: float) -> float:
        """For how long of a time it is not known what was flown."""
        known = sum(duration_s for _, duration_s in self._legs(start_s, end_s))
        unknown = end_s - start_s - known
        return unknown if unknown > TIME_TOLERANCE_S else 0.0

    def _legs(self, start_s: float, end_s: float) -> list[Leg]:
        """Movements flown between two times, and for how long each; several ask for the same."""
        if self._asked is not None and self._asked[:2] == (start_s, end_s):
            return self._asked[2]
        after_s, before_s = start_s + TIME_TOLERANCE_S, end_s - TIME_TOLERANCE_S
        legs: list[Leg] = []
        for buffer in self._buffers:
            entries = buffer.entries
            # Most were long ago.
            if entries and entries[-1].end_s > after_s and entries[0].start_s < before_s:
                legs += buffer.legs(start_s, end_s)
        self._asked = (start_s, end_s, legs)
        return legs


class OwnStates:
    """The own state estimates of the last seconds, in the order of their times."""

    def __init__(self, history_s: float, flown: Flown) -> None:
        self._history_s, self._flown = history_s, flown
        self._states: deque[State] = deque()

    def take(self, state: State) -> str | None:
        """Keep a state; returns why it cannot be used, or None."""
        if self._states and state.time_s <= self._states[-1].time_s:
            return "state: late or repeated"
        self._states.append(state)
        while self._states[0].time_s < state.time_s - self._history_s:
            self._states.popleft()
        return None

    @property
    def latest(self) -> State:
        """Raises ClearwayError if no own state estimate has come yet."""
        if not self._states:
            raise ClearwayError("no state estimate yet: update the system with one before deciding")
        return self._states[-1]

    def reach_back_to(self, time_s: float) -> bool:
        """Whether `at` can tell the state of a time."""
        return bool(self._states) and not time_s < self._states[0].time_s - TIME_TOLERANCE_S

    def at(self, time_s: float) -> State:
        """Own state estimate at a time: along what was flown, through the states that came.

        Between two states the way flown from the first is bent to end in the second, evenly over
        the time; where nothing is known to be flown that is a straight line.
        """
        if time_s >= self._states[-1].time_s:
            return self._flown.carry(self._states[-1], time_s)
        later = next(s for s in self._states if s.time_s >= time_s)
        earlier = next((s for s in reversed(self._states) if s.time_s <= time_s), later)
        span = later.time_s - earlier.time_s
        if span <= 0.0:
            return earlier
        share = (time_s - earlier.time_s) / span
        there, end = self._flown.carry(earlier, time_s), self._flown.carry(earlier, later.time_s)
        return replace(
            earlier,
            position_m=there.position_m + share * (later.position_m - end.position_m),
            attitude_rad=there.attitude_rad
            + share * wrap_angle(later.attitude_rad - end.attitude_rad),
            position_std_m=max(earlier.position_std_m, later.position_std_m),
            attitude_std_rad=max(earlier.attitude_std_rad, later.attitude_std_rad),
            time_s=time_s,
        )
