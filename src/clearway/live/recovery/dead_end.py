"""Where flying on brings the goal no nearer, a way round is flown instead; by who turns in no room,
and at once already where what was seen shows one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.avoidance.plan.held_escape import Escape
from clearway.base.frames import FloatArray, measure_length
from clearway.base.state import State
from clearway.live.knowledge import Knowledge
from clearway.live.mission import Detour, Progress, begin_detour, is_without_progress
from clearway.live.recovery.early_way import early_way
from clearway.live.recovery.run_up import run_up
from clearway.live.routing.seen_planner import SeenPlanner, SeenRoute
from clearway.live.routing.timed_route import turning_room_m
from clearway.sensors.observed.seen_space import SeenSpace

RENEWED = 0.25
"""Share of a full circle's time after which a way through seen space is looked for anew."""
WAITED = 0.5
"""Share of that time without progress after which one is looked for at all."""
MAPPED = 0.5
"""Share of that time after which what was seen is taken in, while no way is looked for."""
EARLY = 0.8
"""Share of that, after which there is time for it between decisions."""
GIVEN_UP = 4.0
"""Full circles' worth of ways that came to nothing along the best way, for it to be none."""
STAYS = 4.0
TRIES = 2.0
"""Full circles' time for which who has no way stays in a place that is known to be safe, and then
tries ways once more; after each such time it stays twice as long, since flying about is never as
safe."""
MISSED = 2.0
CIRCLED = 1.5
RUN_UP = 2.0
"""Turning radii within which a goal that does not come nearer is circled; and full circles' time
after which it is come to from elsewhere, and after which a way there has come to nothing."""
STRAIGHT = 1.25
"""Length of a way, in straight ones to the goal, that needs no corners."""
STANDING_TURN = 12.0
"""Movements that count as a full circle for a vehicle that can turn on the spot."""


def out_of_dead_end(
    knowledge: Knowledge,
    state: State,
    now_s: float,
    detour: Detour | None,
    *,
    escaped: bool = False,
    gives_way: bool = False,
) -> Progress:
    """Progress with a detour when the goal has not come nearer for long, else as it is.

    detour: who finds the way; None goes by what is known. escaped: whether the escape is being
    flown: then going straight for the goal has come to nothing, whatever the time. gives_way:
    whether the way is left for aircraft afar: then it takes longer until that has come to nothing.
    """
    free = knowledge.sensing.free_space
    if knowledge.progress.is_done(knowledge.mission):
        return knowledge.progress
    if free is not None and detour is None:
        turns = knowledge.planner.settings.patience_turns if gives_way else WAITED
        return _through_seen(knowledge, free.seen, state, now_s, turns, escaped=escaped)
    return _after_waiting(knowledge, state, now_s, detour)


def keep_up(knowledge: Knowledge, state: State, now_s: float) -> Progress:
    """Progress after taking in early what ways are looked for in, where that is soon due: between
    decisions, so that none takes longer for it."""
    free, progress = knowledge.sensing.free_space, knowledge.progress
    if free is None or progress.stuck_m is not None:
        return progress
    if now_s - progress.planned_s <= EARLY * MAPPED * full_circle(knowledge)[1]:
        return progress
    _take_in(knowledge, free.seen, state)
    return replace(progress, planned_s=now_s)


def _after_waiting(
    knowledge: Knowledge, state: State, now_s: float, detour: Detour | None
) -> Progress:
    """A way round what is known, once it has waited long enough."""
    planner, progress, mission = knowledge.planner, knowledge.progress, knowledge.mission
    radius = planner.automaton.turning_radius_m
    if not np.isfinite(radius):
        return progress
    waits_s = planner.settings.patience_turns * 2.0 * np.pi * radius / planner.speed_mps
    if not is_without_progress(progress, now_s, waits_s):
        return progress

    def list_known(position_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, ...]:
        return way_round(knowledge, position_m, target_m)

    return begin_detour(mission, progress, state, now_s, radius, detour or list_known)


def _through_seen(
    knowledge: Knowledge,
    seen: SeenSpace,
    state: State,
    now_s: float,
    patience_turns: float,
    *,
    escaped: bool,
) -> Progress:
    """A way through what was seen to be free, renewed until the goal is nearer than ever; looked
    for after so many full circles' time without progress, and before that by who turns in no room,
    at every decision (`early_way`)."""
    progress, planner, routes = knowledge.progress, knowledge.planner, knowledge.seen_routes
    assert routes is not None  # There is one where there is seen space.
    radius, turn_s = full_circle(knowledge)
    since_s = now_s - progress.planned_s
    goal = knowledge.mission.goals_m[progress.goal]
    distance = measure_length(goal - state.position_m)
    waited = now_s - progress.nearest_s > patience_turns * turn_s
    if progress.stuck_m is None and not (escaped or waited):
        # Who was measured takes its time to turn: each corner would cost it a stop.
        if radius == 0.0 and planner.automaton.classes is None:
            _take_in(knowledge, seen, state)
            before = (*progress.detour, goal) if progress.detour else ()
            past = early_way(routes, state.position_m, goal, before, planner.grid.range_m)
            return replace(progress, detour=past, planned_s=now_s)
        if since_s > MAPPED * turn_s:
            _take_in(knowledge, seen, state)
            progress = replace(progress, planned_s=now_s)
        return progress
    if progress.runs_up:
        if not progress.detour:
            return straight_again(progress, now_s)
        if since_s < RUN_UP * turn_s:
            return progress
        in_vain_s = progress.in_vain_s + since_s
        progress = replace(progress, runs_up=False, detour=(), in_vain_s=in_vain_s)
    if progress.stuck_m is not None and since_s < RENEWED * turn_s:
        return progress
    _take_in(knowledge, seen, state)
    flown: tuple[FloatArray, ...] = ()
    if progress.stuck_m is not None and not progress.closed:
        if not routes.came_nearer(state.position_m, planner.speed_mps * since_s):
            progress = replace(progress, in_vain_s=progress.in_vain_s + since_s)
        flown = (*progress.detour, goal)
    missed = progress.stuck_m is not None and distance < MISSED * radius
    if missed and not progress.closed and now_s - progress.nearest_s > CIRCLED * turn_s:
        away = _run_up(progress, routes, state, goal, radius)
        if away is not None:
            return replace(away, planned_s=now_s)
    route = routes.find_seen_route(state.position_m, goal, flown)
    routes.aim(route.begins_m)
    stuck_m = min(progress.nearest_m, distance) if progress.stuck_m is None else progress.stuck_m
    nearer = distance < stuck_m - max(radius, planner.automaton.step_m)
    if nearer and route.length_m <= STRAIGHT * distance:
        return replace(
            progress,
            stuck_m=None,
            detour=(),
            planned_s=now_s,
            closed=False,
            tried=0,
        )
    progress = replace(
        progress,
        stuck_m=stuck_m,
        detour=route.via_m(goal),
        detours=progress.detours + 1,
        planned_s=now_s,
    )
    if planner.settings.escape == Escape.KNOWN:
        return progress  # Nowhere is known to be safe to stay in.
    return _note_whether_closed(progress, route, now_s, turn_s, turn_s * planner.speed_mps)


def _run_up(
    progress: Progress, routes: SeenPlanner, state: State, goal_m: FloatArray, radius: float
) -> Progress | None:
    """Progress by way of where a goal that is circled can be come to from; None where that was not
    seen, or no way leads there."""
    begins = run_up(routes.cells, state.position_m, goal_m, radius, routes.room_m)
    if begins is None:
        return None
    routes.spend(begins)
    way = routes.find_seen_route(state.position_m, begins)
    if not way.reaches:
        return None
    corners = (*way.corners_m[:-1], begins)
    return replace(progress, detour=corners, detours=progress.detours + 1, runs_up=True)


def straight_again(progress: Progress, now_s: float) -> Progress:
    """Progress straight for the goal, as if it had not been tried."""
    return replace(
        progress,
        stuck_m=None,
        detour=(),
        runs_up=False,
        planned_s=now_s,
        nearest_m=np.inf,
        nearest_s=now_s,
        in_vain_s=0.0,
    )


def _note_whether_closed(
    progress: Progress, route: SeenRoute, now_s: float, turn_s: float, turn_m: float
) -> Progress:
    """Progress with whether a way is one: not where too much of it has come to nothing, though that
    is tried once more after a while; turn_s, turn_m: time and length of a full circle."""
    since_s = now_s - progress.closed_s
    if progress.closed:
        if route.reaches and route.in_vain_m == 0.0:
            return replace(progress, closed=False, closed_s=now_s)
        if route.reaches and since_s > STAYS * 2.0**progress.tried * turn_s:
            return replace(progress, closed=False, closed_s=now_s, tried=progress.tried + 1)
        return progress
    tried_enough = since_s > TRIES * turn_s
    in_vain = tried_enough if progress.tried else route.in_vain_m > GIVEN_UP * turn_m
    if route.reaches and not in_vain:
        return progress
    return replace(progress, closed=True, closed_s=now_s)


def _take_in(knowledge: Knowledge, seen: SeenSpace, state: State) -> None:
    sensing, routes = knowledge.sensing, knowledge.seen_routes
    assert routes is not None  # There are some where there is seen space.
    assert sensing.free_space is not None
    reach_m = sensing.memory_reach_m
    routes.look(seen, sensing.remembered, state.position_m, reach_m, sensing.free_space.reach_m)


def full_circle(knowledge: Knowledge) -> tuple[float, float]:
    """Turning radius, 0 where the vehicle turns on the spot, and the time of a full circle."""
    automaton = knowledge.planner.automaton
    radius = turning_room_m(automaton)
    if radius > 0.0:
        return radius, 2.0 * np.pi * radius / knowledge.planner.speed_mps
    return 0.0, STANDING_TURN * max(movement.duration_s for movement in automaton.movements)


def way_round(
    knowledge: Knowledge, position_m: FloatArray, target_m: FloatArray
) -> tuple[FloatArray, ...]:
    """Round what the map and the memory show, with room to turn if there is any."""
    routes, remembered = knowledge.known_routes, knowledge.sensing.remembered
    reach_m = knowledge.sensing.memory_reach_m
    routes.take(position_m, remembered.position_m, reach_m)
    return routes.way_m(position_m, target_m)
