"""Planners of encounters at real scale by name: those that come along, and networks of a folder."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import numpy as np

from clearway.studies.risk.horizontal_cas import (
    PREFIX,
    TURN_DEG_PER_S,
    choose_advisory,
    read_networks,
    vertical_tau_s,
)
from clearway.studies.risk.long_planners import LONG_PLANNERS, LongPlanner, LongView, Steer, go_back


def long_planner(name: str) -> LongPlanner:
    """Return the planner of a name; raises ClearwayError with the valid ones, or what is wrong."""
    if name.startswith(PREFIX):
        read_networks(name.removeprefix(PREFIX))
        return partial(follow_advisories, folder=name.removeprefix(PREFIX))
    return LONG_PLANNERS.find(name)


def locate_long(name: str) -> str:
    """Return the name by which a planner is found from any folder; errors as of `long_planner`."""
    long_planner(name)
    if name.startswith(PREFIX):
        return PREFIX + str(Path(name.removeprefix(PREFIX)).resolve())
    return name


def follow_advisories(view: LongView, folder: str) -> Steer:
    """Turn as HorizontalCAS's networks advise against the nearest intruder; else fly as wished."""
    motion, able = view.motion, view.performance
    nearest = min(
        view.others, key=lambda one: float(np.hypot(*(one.position_m - motion.position_m)[:2]))
    )
    half_m = view.volumes.outermost.kept.half_height_m
    height_m = float(motion.position_m[2])
    course = float(math.atan2(nearest.velocity_mps[1], nearest.velocity_mps[0]))
    advisory = choose_advisory(
        read_networks(folder),
        view.before.advisory if view.before else 0,
        motion.course_rad,
        (nearest.position_m - motion.position_m)[:2],
        course,
        vertical_tau_s(nearest, height_m, motion.climb_mps, half_m),
    )
    if not advisory:
        return Steer(view.wanted.course_rad, view.wanted.speed_mps, go_back(view), 0, 0)
    turn = math.radians(TURN_DEG_PER_S[advisory])
    # A course so far ahead that the turn keeps its rate until the next advisory is at the controls.
    lead_s = able.reaction_s + able.turn_onset_s + 0.75
    side = 1 if turn > 0.0 else -1
    return Steer(
        motion.course_rad + turn * lead_s, view.wanted.speed_mps, 0.0, side, 0, advisory=advisory
    )
