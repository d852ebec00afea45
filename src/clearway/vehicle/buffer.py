"""Movement buffers (3.15): movements with start and duration, chained, split and flown."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from typing import NamedTuple

import numpy.typing as npt

from clearway.base.brief import brief
from clearway.base.errors import ClearwayError
from clearway.base.state import Trajectory
from clearway.vehicle.automaton import Movement, MovementAutomaton

TIME_TOLERANCE_S = 1e-9


class BufferedMovement(NamedTuple):
    """One entry of a buffer: a movement, when it starts, and for how long it is held."""

    movement: Movement
    start_s: float
    duration_s: float

    @property
    def end_s(self) -> float:
        return self.start_s + self.duration_s


_entry = partial(tuple.__new__, BufferedMovement)
"""Of a movement, its start and its duration in one: decisions make dozens."""


@dataclass(frozen=True)
class MovementBuffer:
    """A finite sequence of (movement, start, duration), each starting where the last one ends.

    Raises ClearwayError for a gap, an overlap or an entry without duration.
    """

    entries: tuple[BufferedMovement, ...] = ()

    __repr__ = brief

    def __post_init__(self) -> None:
        first: BufferedMovement | None = None
        for entry in self.entries:
            if not entry.duration_s > 0.0:
                raise ClearwayError(f"movement buffer: {entry.movement.name} has no duration")
            if first is None:
                first = entry
                continue
            if abs(entry.start_s - (first.start_s + first.duration_s)) > TIME_TOLERANCE_S:
                raise ClearwayError(
                    f"movement buffer: {entry.movement.name} starts at {entry.start_s} s, "
                    f"but {first.movement.name} ends at {first.end_s} s"
                )
            first = entry

    @classmethod
    def of(cls, movements: Iterable[Movement], start_s: float = 0.0) -> MovementBuffer:
        """Whole movements, one after the other."""
        chain = tuple(movements)
        lasts_s = [movement.duration_s for movement in chain]
        starts_s = accumulate(lasts_s, initial=float(start_s))
        return cls._of_checked(tuple(map(_entry, zip(chain, starts_s, lasts_s, strict=False))))

    @classmethod
    def _of_checked(cls, entries: tuple[BufferedMovement, ...]) -> MovementBuffer:
        """Of entries that are known to follow one another: made of movements, or parts of others.

        Every decision makes several, of dozens of entries each.
        """
        buffer = object.__new__(cls)
        object.__setattr__(buffer, "entries", entries)
        return buffer

    @property
    def start_s(self) -> float:
        return self.entries[0].start_s if self.entries else 0.0

    @property
    def end_s(self) -> float:
        return self.entries[-1].end_s if self.entries else self.start_s

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(entry.movement.name for entry in self.entries)

    def at(self, time_s: float) -> Movement | None:
        """The movement held in (start, end] at a time, (3.17); None outside."""
        for entry in self.entries:
            if entry.start_s < time_s <= entry.end_s:
                return entry.movement
        return None

    def find_held(self, time_s: float, tolerance_s: float = TIME_TOLERANCE_S) -> Movement | None:
        """The movement to hold from a time on: where two meet, the one that begins.

        At the buffer's end that is still the last one; None outside the buffer.
        """
        for entry in self.entries:
            if entry.start_s - tolerance_s <= time_s < entry.end_s - tolerance_s:
                return entry.movement
        at_end = bool(self.entries) and abs(time_s - self.end_s) <= tolerance_s
        return self.entries[-1].movement if at_end else None

    def split(self, time_s: float) -> tuple[MovementBuffer, MovementBuffer]:
        """What is done by that time, and what is left; a movement under way is cut in two."""
        before: list[BufferedMovement] = []
        after: list[BufferedMovement] = []
        for entry in self.entries:
            if entry.end_s <= time_s + TIME_TOLERANCE_S:
                before.append(entry)
            elif entry.start_s >= time_s - TIME_TOLERANCE_S:
                after.append(entry)
            else:
                cut = time_s - entry.start_s
                before.append(BufferedMovement(entry.movement, entry.start_s, cut))
                after.append(BufferedMovement(entry.movement, time_s, entry.duration_s - cut))
        return self._of_checked(tuple(before)), self._of_checked(tuple(after))

    def until(self, time_s: float) -> MovementBuffer:
        """What is done by a time: the first part of `split`."""
        if not self.entries or self.entries[-1].end_s <= time_s + TIME_TOLERANCE_S:
            return self
        done: list[BufferedMovement] = []
        for entry in self.entries:
            if entry.end_s <= time_s + TIME_TOLERANCE_S:
                done.append(entry)
                continue
            if entry.start_s < time_s - TIME_TOLERANCE_S:
                done.append(entry._replace(duration_s=time_s - entry.start_s))
            break
        return self._of_checked(tuple(done))

    def legs(self, start_s: float, end_s: float) -> list[tuple[Movement, float]]:
        """Movements between two times, and for how long each: what two splits leave."""
        found = []
        for entry in self.entries:
            begins_s, lasts_s = entry.start_s, entry.duration_s
            ends_s = begins_s + lasts_s
            if ends_s <= start_s + TIME_TOLERANCE_S:
                continue
            if begins_s < start_s - TIME_TOLERANCE_S:
                lasts_s -= start_s - begins_s
                begins_s = start_s
                ends_s = begins_s + lasts_s
            if ends_s > end_s + TIME_TOLERANCE_S:
                if begins_s >= end_s - TIME_TOLERANCE_S:
                    break
                lasts_s = end_s - begins_s
            found.append((entry.movement, lasts_s))
        return found

    def chain(self, following: MovementBuffer) -> MovementBuffer:
        """This buffer until the other one starts, then the other one ((4.12), (6.3)).

        What is left of this buffer is flushed. Raises ClearwayError if it ends too early.
        """
        if not following.entries:
            return self
        kept, _ = self.split(following.start_s)
        return MovementBuffer(kept.entries + following.entries)

    def shift(self, moved: Callable[[float], float]) -> MovementBuffer:
        """The same movements by another clock."""
        entries, at = [], moved(self.start_s)
        for entry in self.entries:
            entries.append(entry._replace(start_s=at))
            at += entry.duration_s
        return MovementBuffer(tuple(entries))

    def rollout(
        self, automaton: MovementAutomaton, state: npt.ArrayLike, step_s: float = 0.05
    ) -> Trajectory:
        """Predicted path: states at most `step_s` apart, and at each movement's end."""
        legs = [(entry.movement, entry.duration_s) for entry in self.entries]
        return automaton.fly(state, legs, step_s, self.start_s)
