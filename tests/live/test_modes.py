"""Modes: which one a decision puts the mission in, and what is told of the change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.choose.chosen import NOTHING_TRIED, Basis
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode, Progress
from clearway.live.outputs.modes import GUARDS, ModeFacts, mode_after
from worlds_for_tests import mission, planner

AHEAD = mission((30.0, 8.0, 4.0))


@pytest.fixture(scope="module")
def decision():
    live = AvoidanceSystem(planner(escape="off"), AHEAD)
    live.update(State(np.zeros(3)))
    return live.decide(0.0).decision


@pytest.mark.parametrize(
    ("basis", "progress", "banned", "mode"),
    [
        (Basis.RATED, Progress(), (), Mode.NAVIGATION),
        (Basis.RATED, Progress(), ("Left",), Mode.AVOIDANCE),
        (Basis.RATED, Progress(goal=9), (), Mode.LANDING),
        (Basis.WAY_OUT, Progress(), ("Left",), Mode.ESCAPE),
        (Basis.WAY_OUT, Progress(closed=True), ("Left",), Mode.ESCAPE),
        (Basis.WAY_OUT, Progress(closed=True), (), Mode.HOLD),
        (Basis.RATED, Progress(closed=True), (), Mode.HOLD),
        (Basis.RATED, Progress(goal=9, closed=True), (), Mode.HOLD),
        (Basis.WAY_OUT, Progress(goal=9), (), Mode.ESCAPE),
        (Basis.EMERGENCY, Progress(goal=9, closed=True), ("Left",), Mode.EMERGENCY),
    ],
)
def test_the_first_guard_that_holds_gives_the_mode(decision, basis, progress, banned, mode):
    choice = replace(decision.choice, basis=basis, tried=NOTHING_TRIED, below_threshold=0)
    facts = ModeFacts(replace(decision, choice=choice, no_way_out=banned), progress, AHEAD)
    put = mode_after(None, facts)
    assert put.mode is mode
    assert put.why
    again = mode_after(put, facts)
    assert put.changed
    assert not again.changed
    assert put.transition == f"begins {mode}: {put.why}"
    assert again.transition == ""


def test_every_mode_has_one_guard_and_the_last_always_holds(decision):
    assert sorted(guard.mode for guard in GUARDS) == sorted(Mode)
    assert GUARDS[-1].why(ModeFacts(decision, Progress(), AHEAD))


def test_a_change_says_from_what_to_what_and_why(decision):
    begins = mode_after(None, ModeFacts(decision, Progress(), AHEAD))
    choice = replace(decision.choice, basis=Basis.WAY_OUT)
    flees = replace(decision, choice=choice, no_way_out=("Straight",))
    told = mode_after(begins, ModeFacts(flees, Progress(), AHEAD)).transition
    assert told == f"{begins.mode} to escape: no escape after Straight"
