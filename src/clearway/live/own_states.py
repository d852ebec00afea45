"""Own states as they come: where the vehicle was when a scan was taken, and where it is now."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import wrap_angle
from clearway.base.state import State
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer

TIME_TOLERANCE_S = 1e-6
"""Times no farther apart are one: seconds since 1970 are told to a quarter of it."""


class OwnStates:
    """The own states of the last seconds, in the order of their times.

    A state far ahead of the clock waits: believed at once, one with a wrong time would shut out all
    that follow. The next state, or the clock itself, shows whether its time has come.
    """

    def __init__(self, history_s: float, ahead_s: float) -> None:
        self._history_s, self._ahead_s = history_s, ahead_s
        self._states: deque[State] = deque()
        self._early: State | None = None

    def take(self, state: State, clock_s: float) -> list[str]:
        """Keep a state; returns why it, or one that waited for it, cannot be used.

        clock_s: the latest time told by anything else, -inf before any.
        """
        early, self._early = self._early, None
        flaws = []
        if early is not None and early.time_s <= state.time_s <= early.time_s + self._ahead_s:
            self._keep(early)
            clock_s = early.time_s
        elif early is not None:
            flaws.append("state: from the future")
        if np.isfinite(clock_s) and state.time_s > clock_s + self._ahead_s:
            self._early = state
        elif self._states and state.time_s <= self._states[-1].time_s:
            flaws.append("state: late or repeated")
        else:
            self._keep(state)
        return flaws

    def believe(self, clock_s: float) -> None:
        """Keep a state that waited, if the clock has come near to its time."""
        if self._early is not None and self._early.time_s <= clock_s + self._ahead_s:
            self._keep(self._early)
            self._early = None

    def _keep(self, state: State) -> None:
        self._states.append(state)
        while self._states[0].time_s < state.time_s - self._history_s:
            self._states.popleft()

    @property
    def newest(self) -> State | None:
        """None if no own state has come yet."""
        return self._states[-1] if self._states else None

    @property
    def latest(self) -> State:
        """Raises ClearwayError if no own state has come yet."""
        if not self._states:
            raise ClearwayError("no own state yet: update the system with one before deciding")
        return self._states[-1]

    def reach_back_to(self, time_s: float) -> bool:
        """Whether `at` can tell the state of a time."""
        return bool(self._states) and not time_s < self._states[0].time_s - TIME_TOLERANCE_S

    def at(self, time_s: float) -> State:
        """Own state at a past time, interpolated between the kept ones."""
        later = next((s for s in self._states if s.time_s >= time_s), self._states[-1])
        earlier = next((s for s in reversed(self._states) if s.time_s <= time_s), later)
        span = later.time_s - earlier.time_s
        if span <= 0.0:
            return earlier
        share = (time_s - earlier.time_s) / span
        turned = wrap_angle(later.attitude_rad - earlier.attitude_rad)
        return replace(
            earlier,
            position_m=earlier.position_m + share * (later.position_m - earlier.position_m),
            attitude_rad=earlier.attitude_rad + share * turned,
            time_s=time_s,
        )


def carried_on(
    state: State, now_s: float, buffer: MovementBuffer, automaton: MovementAutomaton
) -> State:
    """A state carried to a later time along the movements being flown (4.16)."""
    if now_s - state.time_s <= 1e-9:
        return state
    _, ahead = buffer.split(state.time_s)
    flown, _ = ahead.split(now_s)
    vector = flown.rollout(automaton, state.vector, np.inf).states[-1]
    return replace(state, position_m=vector[:3], attitude_rad=vector[3:], time_s=now_s)
