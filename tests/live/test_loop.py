"""The loop of a link: ticks at a rate, and at once for what should not wait."""

from __future__ import annotations

import gc
import time
from typing import Any

import pytest

from clearway.live.link.link_state import LinkState
from clearway.live.link.loop import Loop

GIVE_UP_S = 20.0


class Ticked:
    state = LinkState.FLYING
    time_s = 0.0


class Vehicle:
    """Session and link in one; something presses as often as it is waited for."""

    class terms:
        speedup = 1.0

    def __init__(self, presses: bool) -> None:
        self.presses, self.pressing = presses, False
        self.heard = self.ticks = 0
        self.ended = self.crashed = False
        self.frozen = 0

    def wait(self, seconds: float) -> None:
        time.sleep(min(seconds, 0.001))
        self.pressing = self.presses

    def hear(self, _wall_s: float) -> None:
        self.heard += 1

    def tick(self, _wall_s: float) -> Any:
        self.ticks += 1
        self.pressing = False
        self.frozen = gc.get_freeze_count()
        return Ticked()

    def end(self, *, crashed: bool) -> None:
        self.ended, self.crashed = True, crashed


def ran(vehicle: Any, period_s: float, ticks: int, *, at_once: bool) -> Any:
    loop = Loop(vehicle, vehicle, period_s, at_once)
    return loop.run(
        lambda elapsed_s, _: vehicle.ticks >= ticks or elapsed_s > GIVE_UP_S, lambda _: None
    )


def test_what_should_not_wait_does_not() -> None:
    vehicle = Vehicle(presses=True)
    report = ran(vehicle, 1000.0, 4, at_once=True)
    assert (report.ticks, vehicle.ended) == (4, True)
    assert report.late == report.skipped == 0


@pytest.mark.parametrize("presses", [True, False])
def test_the_rest_comes_at_its_rate(presses: bool) -> None:
    vehicle = Vehicle(presses=presses)
    assert ran(vehicle, 0.01, 5, at_once=False).ticks == 5
    assert vehicle.heard == 5, "once for each tick"


def test_nothing_pressing_it_ticks_at_its_rate_and_hears_meanwhile() -> None:
    vehicle = Vehicle(presses=False)
    assert ran(vehicle, 0.5, 2, at_once=True).ticks == 2
    assert vehicle.heard > 2


def test_what_is_there_is_left_out_of_collections_while_it_runs() -> None:
    vehicle = Vehicle(presses=False)
    ran(vehicle, 0.001, 2, at_once=False)
    assert vehicle.frozen > 1000
    assert gc.get_freeze_count() == 0
