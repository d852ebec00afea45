"""What is said of a goal to which no way leads."""

from __future__ import annotations

from types import SimpleNamespace

from clearway.avoidance.chosen import Basis
from clearway.live.explain import NOT_REACHABLE
from clearway.live.flight_decision import mode_of
from clearway.live.mission import Mode
from clearway.sim.run import METRICS


def decision(basis: Basis = Basis.NO_LOITER, *, escapes: bool = False) -> SimpleNamespace:
    choice = SimpleNamespace(basis=basis, ruled_out=(), below_threshold=0)
    return SimpleNamespace(choice=choice, escapes=escapes)


def test_it_holds_where_no_way_leads_on_but_what_is_worse_is_said_first() -> None:
    assert mode_of(decision(), landing=False, closed=True) is Mode.HOLD
    assert mode_of(decision(), landing=True, closed=True) is Mode.HOLD
    assert mode_of(decision(), landing=False) is not Mode.HOLD
    assert mode_of(decision(escapes=True), landing=False, closed=True) is Mode.ESCAPE
    assert mode_of(decision(Basis.EMERGENCY), landing=False, closed=True) is Mode.EMERGENCY


def test_a_summary_says_that_a_flight_held_short_of_its_goal() -> None:
    def held(*modes: Mode, reached: bool = False) -> object:
        entries = [SimpleNamespace(flight=SimpleNamespace(mode=mode)) for mode in modes]
        return METRICS["held"].of(SimpleNamespace(decisions=entries, reached=reached))

    assert held(Mode.NAVIGATION, Mode.HOLD) == NOT_REACHABLE
    assert held(Mode.HOLD, Mode.ESCAPE) == NOT_REACHABLE
    assert held(Mode.HOLD, Mode.NAVIGATION) is None
    assert held(Mode.HOLD, reached=True) is None
    assert held() is None
