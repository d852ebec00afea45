"""Loops that stay about their place in a steady wind.

What closes in the air drifts over ground: 0.2 m/s carries a circle of 24 s by 4.8 m. Flown straight
against the wind for a while, somewhere on the circle, it comes back: as nearly as whole movements
and headings allow. Which circle that is depends on where the wind comes from, so such loops are
found for a wind, not with the library.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.reach.escapes.legs import Legs
from clearway.reach.escapes.library import EscapeLibrary
from clearway.reach.escapes.loops import CLOSES
from clearway.reach.escapes.ways import Ways

ROUNDED = 0.02
"""Winds no farther apart, as shares of the own speed, are one to the loops found for them."""
MOST_OTHERS = 200
"""Escapes that do not fly against the wind, of which the nearest are kept."""


def ways_in_wind(
    library: EscapeLibrary, start: int, wind_mps: FloatArray, speed_mps: float
) -> Ways:
    """Escapes from an attitude: with loops against the wind first, then those of the library.

    wind_mps: [3] in the level frame that beginnings start in.
    """
    step = ROUNDED * speed_mps
    east, north = (np.round(wind_mps[:2] / step) * step).tolist()
    return _find(library, start, float(east), float(north))


@lru_cache(maxsize=256)
def _find(library: EscapeLibrary, start: int, x_mps: float, y_mps: float) -> Ways:
    ways, legs = library.ways[start], library.legs
    straight = _straight(legs)
    circles = [] if straight is None else _circles(library)
    starts = np.flatnonzero(ways.attitude == 0)
    # Thousands of beginnings end in a few headings.
    headings, appears, heading = np.unique(
        _yaws(library, start)[starts], return_index=True, return_inverse=True
    )
    numbers: dict[tuple[int, ...], int] = {}
    loop_of = np.zeros((len(headings), len(circles)), dtype=np.int64)
    for at in np.argsort(appears).tolist():
        cosine, sine = np.cos(headings[at]), np.sin(headings[at])
        wind = np.array([cosine * x_mps + sine * y_mps, cosine * y_mps - sine * x_mps])
        for side, (turn, count) in enumerate(circles):
            loop = _against(legs, turn, count, straight or 0, wind)
            loop_of[at, side] = numbers.setdefault(loop, len(numbers))
    begins = np.repeat(starts, len(circles))
    loops = loop_of[heading].ravel()
    allowed = _find_allowed(library, list(numbers))[ways.movement[begins], loops]
    begins, loops = begins[allowed], loops[allowed]
    others = slice(0, MOST_OTHERS)
    lengths = [len(loop) for loop in numbers]
    first = int(sum(lengths))
    return Ways(
        ways.parent,
        ways.movement,
        ways.attitude,
        np.concatenate([begins, ways.begins[others]]),
        np.concatenate([loops, ways.loop[others] + len(lengths)]),
        np.concatenate([np.zeros(len(lengths), dtype=np.int64), ways.loop_attitude]),
        np.concatenate([np.cumsum([0, *lengths])[:-1].astype(np.int64), ways.loop_at + first]),
        np.concatenate(
            [np.array([m for loop in numbers for m in loop], dtype=np.int64), ways.loop_movement]
        ),
    )


@lru_cache(maxsize=32)
def _yaws(library: EscapeLibrary, start: int) -> FloatArray:
    """[beginnings] yaw at the end of each."""
    ways, legs = library.ways[start], library.legs
    yaw = np.zeros(len(ways.parent))
    for at in range(1, len(yaw)):
        parent = int(ways.parent[at])
        turn = legs.path[ways.attitude[parent], ways.movement[at], -1, 3]
        yaw[at] = yaw[parent] + turn
    return yaw


def _straight(legs: Legs) -> int | None:
    """The level movement that leads farthest straight on."""
    ends = legs.path[0, :, -1]
    ahead = (np.abs(ends[:, 3]) < CLOSES) & (legs.following[0] == 0) & (ends[:, 0] > 0.0)
    return int(np.argmax(np.where(ahead, ends[:, 0], -np.inf))) if ahead.any() else None


def _circles(library: EscapeLibrary) -> list[tuple[int, int]]:
    """The tightest level turn to either side that closes, and how many make a circle."""
    legs = library.legs
    turns = legs.path[0, :, -1, 3]
    moves = np.abs(legs.path[0, :, -1, :2]).max(axis=1) > CLOSES * max(
        library.automaton.step_m, 1e-9
    )
    found = []
    for side in (1.0, -1.0):
        fits = moves & (legs.following[0] == 0) & (side * turns > CLOSES)
        if not fits.any():
            continue
        turn = int(np.argmax(np.where(fits, np.abs(turns), -np.inf)))
        count = round(2.0 * np.pi / abs(float(turns[turn])))
        if abs(count * abs(float(turns[turn])) - 2.0 * np.pi) <= CLOSES:
            found.append((turn, count))
    return found


def _against(
    legs: Legs, turn: int, count: int, straight: int, wind_mps: FloatArray
) -> tuple[int, ...]:
    """A circle, flown straight on for so long and at such a place of it that it drifts least."""
    angle = float(legs.path[0, turn, -1, 3])
    step, step_s = float(legs.path[0, straight, -1, 0]), float(legs.duration_s[straight])
    heading = angle * np.arange(count)
    ahead = step * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    number = np.arange(count + 1)
    drift = wind_mps * (count * float(legs.duration_s[turn]))
    carried = drift + number[:, None, None] * (ahead + wind_mps * step_s)
    left = np.sqrt(np.square(carried).sum(axis=2))
    straights, turned = (int(at) for at in np.unravel_index(np.argmin(left), left.shape))
    return (turn,) * turned + (straight,) * straights + (turn,) * (count - turned)


def _find_allowed(library: EscapeLibrary, loops: list[tuple[int, ...]]) -> npt.NDArray[np.bool_]:
    """[movements + 1, loops] whether an automaton allows a loop, again and again, after a movement;
    the last row, which is also that of -1, for none."""
    forbidden, names = library.automaton.forbidden, library.automaton.names
    allowed = np.ones((len(names) + 1, len(loops)), dtype=np.bool_)
    if forbidden:
        for at, loop in enumerate(loops):
            again = pairwise((*loop, loop[0]))
            allowed[:, at] = all((names[a], names[b]) not in forbidden for a, b in again)
            for before, name in enumerate(names):
                allowed[before, at] &= (name, names[loop[0]]) not in forbidden
    return allowed
