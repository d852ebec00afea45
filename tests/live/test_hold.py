"""What is said of a goal to which no way leads."""

from __future__ import annotations

from types import SimpleNamespace

from clearway.live.explain import NOT_REACHABLE
from clearway.live.mission import Mode
from clearway.sim.run import METRICS


def test_a_summary_says_that_a_flight_held_short_of_its_goal() -> None:
    def held(*modes: Mode, reached: bool = False) -> object:
        entries = [SimpleNamespace(flight=SimpleNamespace(mode=mode)) for mode in modes]
        return METRICS["held"].of(SimpleNamespace(decisions=entries, reached=reached))

    assert held(Mode.NAVIGATION, Mode.HOLD) == NOT_REACHABLE
    assert held(Mode.HOLD, Mode.ESCAPE) == NOT_REACHABLE
    assert held(Mode.HOLD, Mode.NAVIGATION) is None
    assert held(Mode.HOLD, reached=True) is None
    assert held() is None
