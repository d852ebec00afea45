"""What can be flown on and on: standing, level circles, ovals, and circles that climb on one half
and sink on the other, which close as exactly in less room.

Loops are found, not written down: of all turning movements of an automaton.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from clearway.base.frames import FloatArray
from clearway.reach.escapes.legs import Legs, pose_on
from clearway.vehicle.automaton import MovementAutomaton

CLOSES = 1e-6
"""Of its length, by which a loop may miss its start."""
MOST_TURNS = 400
"""Movements of a loop."""
STRAIGHTS = (1, 2, 3)
"""Movements straight on between the half turns of an oval."""


def loops_from(automaton: MovementAutomaton, legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """Movements that can be flown for ever from an attitude, the least room first."""
    seen = set()
    for loop in (*_standing(legs, start), *_circles(legs, start), *_climbing(legs, start)):
        if loop not in seen and _goes_round(automaton, legs, start, loop):
            seen.add(loop)
            yield loop


def _standing(legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """Movements that lead nowhere: holding, and turning on the spot."""
    step = np.abs(legs.path[..., :3]).max()
    order = np.argsort(np.abs(legs.path[start, :, -1, 3]), kind="stable")
    for movement in order.tolist():
        stays = np.abs(legs.path[start, movement, :, :3]).max() <= 1e-9 * step
        if stays and legs.following[start, movement] == start:
            yield (movement,)


def _circles(legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """One turning movement over and over, and ovals of it and one that leads straight on."""
    turns = legs.path[start, :, -1, 3]
    straight = [
        m
        for m in range(len(turns))
        if abs(turns[m]) < 1e-9 and legs.following[start, m] == start and legs.path[start, m, -1, 0]
    ]
    turning = [m for m in range(len(turns)) if abs(turns[m]) > 1e-6]
    level = [m for m in turning if legs.following[start, m] == start]
    for movement in sorted(level, key=lambda m: -abs(turns[m])):
        count = int(np.ceil(2.0 * np.pi / abs(turns[movement]) - 1e-6))
        if count > MOST_TURNS:
            continue
        yield (movement,) * count
        if count % 2 == 0:
            for ahead in straight[:1]:
                for number in STRAIGHTS:
                    half = (ahead,) * number + (movement,) * (count // 2)
                    yield half + half


def _climbing(legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """Circles that climb on one half and sink on the other, begun anywhere on them.

    With turning movements that keep the attitude, raise it and lower it by one step each.
    """
    for keep, up, down in _steps(legs):
        turn = abs(legs.path[0, keep, -1, 3])
        count = round(2.0 * np.pi / turn)
        if count % 2 or count > MOST_TURNS or abs(count * turn - 2.0 * np.pi) > CLOSES:
            continue
        half = count // 2
        for steps in range(1, half // 2 + 1):
            one = (up,) * steps + (keep,) * (half - 2 * steps) + (down,) * steps
            other = (down,) * steps + (keep,) * (half - 2 * steps) + (up,) * steps
            turns = one + other
            reached = _attitudes_along(legs, 0, turns)
            if reached is None:
                break
            begins = [at for at in range(count) if reached[at] == start]
            for at in _spread(begins):
                yield turns[at:] + turns[:at]


def _spread(begins: list[int]) -> list[int]:
    """Of places on a loop that lie next to each other, the first, the middle and the last."""
    runs: list[list[int]] = []
    for at in begins:
        if runs and at == runs[-1][-1] + 1:
            runs[-1].append(at)
        else:
            runs.append([at])
    return [at for run in runs for at in sorted({run[0], run[len(run) // 2], run[-1]})]


def _steps(legs: Legs) -> Iterator[tuple[int, int, int]]:
    """Turning movements that belong together: one keeps level flight, two change it."""
    turns, following = legs.path[0, :, -1, 3], legs.following
    for keep in range(len(turns)):
        if abs(turns[keep]) < 1e-6 or following[0, keep] != 0:
            continue
        alike = np.flatnonzero(np.abs(turns - turns[keep]) < 1e-9)
        for up in alike.tolist():
            for down in alike.tolist():
                raised = following[0, up]
                if raised > 0 and following[0, down] > 0 and following[raised, down] == 0:
                    yield keep, up, down


def _attitudes_along(legs: Legs, start: int, loop: tuple[int, ...]) -> list[int] | None:
    """Attitude before each movement of a loop; None where one may not be flown, or it ends
    in another than it began with."""
    at, reached = start, []
    for movement in loop:
        reached.append(at)
        at = int(legs.following[at, movement])
        if at < 0:
            return None
    return reached if at == start else None


def _goes_round(
    automaton: MovementAutomaton, legs: Legs, start: int, loop: tuple[int, ...]
) -> bool:
    """Whether a loop may be flown for ever, and does not lead away.

    It ends where it began; or it is one level turn over and over, whose arcs lie on one circle
    wherever they begin on it.
    """
    reached = _attitudes_along(legs, start, loop)
    if reached is None:
        return False
    names = [automaton.names[movement] for movement in loop]
    if any(pair in automaton.forbidden for pair in zip(names, names[1:] + names[:1], strict=True)):
        return False
    place, yaw, length = np.zeros(3), 0.0, 0.0
    for attitude, movement in zip(reached, loop, strict=True):
        step = legs.path[attitude, movement, -1]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        place += [cosine * step[0] - sine * step[1], sine * step[0] + cosine * step[1], step[2]]
        yaw += step[3]
        length += float(np.linalg.norm(step[:3]))
    turned = abs((yaw + np.pi) % (2.0 * np.pi) - np.pi)
    if np.linalg.norm(place) <= CLOSES * length and turned <= CLOSES:
        return True
    return len(set(loop)) == 1 and _is_arc(legs.path[start, loop[0]])


def extent_m(legs: Legs, start: int, loop: tuple[int, ...]) -> float:
    """How far a loop leads from where it begins."""
    pose, at, farthest = np.zeros(4), start, 0.0
    for movement in loop:
        pose = pose_on(pose, legs.path[at, movement, -1])
        at = int(legs.following[at, movement])
        farthest = max(farthest, float(np.linalg.norm(pose[:3])))
    return farthest


def _is_arc(path: FloatArray) -> bool:
    """Whether a movement [SAMPLES, 4] is a level arc of the circle that repeating it goes round."""
    step, turn = path[-1, :3], path[-1, 3]
    size = float(np.abs(path[:, :3]).max())
    if abs(turn) < 1e-6 or np.abs(path[:, 2]).max() > 1e-9 * size:
        return False
    # Turned by its own angle about the centre, the start becomes the end.
    away = 0.5 / np.tan(0.5 * turn)
    center = np.array([0.5 * step[0] - away * step[1], 0.5 * step[1] + away * step[0]])
    radii = np.hypot(path[:, 0] - center[0], path[:, 1] - center[1])
    return bool(np.abs(radii - np.hypot(*center)).max() <= CLOSES * size)
