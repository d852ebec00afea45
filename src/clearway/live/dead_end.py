"""Where flying on brings the goal no nearer, a way round is flown instead."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.detour import known_way
from clearway.live.knowledge import Knowledge
from clearway.live.mission import Detour, Progress, detoured, stuck
from clearway.live.seen_route import seen_route
from clearway.sensors.free_space import SeenSpace

RENEWED = 0.25
"""Share of a full circle's time after which a way through seen space is looked for anew."""
PATIENCE = 0.5
"""Share of that time without progress after which one is looked for at all."""
MOST_TRIED = 200
"""Places that are kept."""
STANDING_TURN = 12.0
"""Movements that count as a full circle for a vehicle that can turn on the spot."""


def out_of_dead_end(
    knowledge: Knowledge,
    state: State,
    now_s: float,
    detour: Detour | None,
    *,
    escaped: bool = False,
) -> Progress:
    """Progress with a detour when the goal has not come nearer for long, else as it is.

    detour: who finds the way; None goes by what is known. escaped: whether the way out is being
    flown: then going straight for the goal has come to nothing, whatever the time.
    """
    free = knowledge.sensing.free_space
    if knowledge.progress.done(knowledge.mission):
        return knowledge.progress
    if free is not None and detour is None:
        return _through_seen(knowledge, free.seen, state, now_s, escaped=escaped)
    return _after_patience(knowledge, state, now_s, detour)


def _after_patience(
    knowledge: Knowledge, state: State, now_s: float, detour: Detour | None
) -> Progress:
    """A way round what is known, once patience is over."""
    planner, progress, mission = knowledge.planner, knowledge.progress, knowledge.mission
    radius = planner.automaton.turning_radius_m
    if not np.isfinite(radius):
        return progress
    patience = knowledge.limits.patience_turns * 2.0 * np.pi * radius / planner.speed_mps
    if not stuck(progress, now_s, patience):
        return progress

    def known(position_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, ...]:
        return way_round(knowledge, position_m, target_m)

    return detoured(mission, progress, state, now_s, radius, detour or known)


def _through_seen(
    knowledge: Knowledge, seen: SeenSpace, state: State, now_s: float, *, escaped: bool
) -> Progress:
    """A way through what was seen to be free, renewed until the goal is nearer than ever."""
    progress, planner = knowledge.progress, knowledge.planner
    radius, turn_s = _turn(knowledge)
    goal = knowledge.mission.goals_m[progress.goal]
    distance = float(np.linalg.norm(goal - state.position_m))
    if progress.stuck_m is None:
        if not escaped and now_s - progress.nearest_s <= PATIENCE * turn_s:
            return progress
        progress = replace(progress, stuck_m=min(progress.nearest_m, distance))
    elif distance < progress.stuck_m - max(radius, planner.automaton.step_m):
        return replace(progress, stuck_m=None, detour=(), tried_m=(), closed=False)
    elif now_s - progress.planned_s < RENEWED * turn_s:
        return progress
    route = seen_route(
        seen,
        knowledge.sensing.remembered,
        knowledge.obstacle_map,
        state.position_m,
        goal,
        planner.settings.safety_margin_m,
        radius,
        progress.tried_m,
    )
    ends_at_goal = route.reaches and np.array_equal(route.corners_m[-1], goal)
    corners = route.corners_m[:-1] if ends_at_goal else route.corners_m
    return replace(
        progress,
        detour=tuple(corners),
        detours=progress.detours + 1,
        planned_s=now_s,
        tried_m=(*progress.tried_m[-MOST_TRIED:], state.position_m),
        closed=not route.reaches,
    )


def _turn(knowledge: Knowledge) -> tuple[float, float]:
    """Turning radius, 0 where the vehicle turns on the spot, and the time of a full circle."""
    automaton = knowledge.planner.automaton
    radius = automaton.turning_radius_m
    if np.isfinite(radius):
        return radius, 2.0 * np.pi * radius / knowledge.planner.speed_mps
    return 0.0, STANDING_TURN * max(movement.duration_s for movement in automaton.movements)


def way_round(
    knowledge: Knowledge, position_m: FloatArray, target_m: FloatArray
) -> tuple[FloatArray, ...]:
    """Round what the map and the memory show, with room to turn if there is any."""
    planner = knowledge.planner
    margin = planner.settings.safety_margin_m
    wide = margin + 0.5 * planner.automaton.turning_radius_m
    remembered = knowledge.sensing.remembered
    return known_way(knowledge.obstacle_map, remembered, position_m, target_m, (wide, margin))
