"""The no-progress rule: where flying on brings the goal no nearer, a way round is flown instead."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.detour import known_way
from clearway.live.knowledge import Knowledge
from clearway.live.mission import Detour, Progress, detoured, stuck


def out_of_dead_end(
    knowledge: Knowledge, state: State, now_s: float, detour: Detour | None
) -> Progress:
    """Progress with a detour when the goal has not come nearer for long, else as it is.

    detour: who finds the way; None goes by what is known.
    """
    planner, progress, mission = knowledge.planner, knowledge.progress, knowledge.mission
    radius = planner.automaton.turning_radius_m
    if not np.isfinite(radius) or progress.done(mission):
        return progress
    patience = knowledge.limits.patience_turns * 2.0 * np.pi * radius / planner.speed_mps
    if not stuck(progress, now_s, patience):
        return progress

    def known(position_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, ...]:
        return way_round(knowledge, position_m, target_m)

    return detoured(mission, progress, state, now_s, radius, detour or known)


def way_round(
    knowledge: Knowledge, position_m: FloatArray, target_m: FloatArray
) -> tuple[FloatArray, ...]:
    """Round what the map and the memory show, with room to turn if there is any."""
    planner = knowledge.planner
    margin = planner.settings.safety_margin_m
    wide = margin + 0.5 * planner.automaton.turning_radius_m
    remembered = knowledge.sensing.remembered
    return known_way(knowledge.obstacle_map, remembered, position_m, target_m, (wide, margin))
