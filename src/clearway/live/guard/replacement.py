"""What is flown in place of a wish: what is held, or a decision that is nearest to the wish."""

from __future__ import annotations

import math

import numpy as np

from clearway.avoidance.choose.candidates import STANDING_IS_WANTED, Commitment
from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.planner import Planner
from clearway.base.state import State
from clearway.live.guard.admission import Asked
from clearway.live.guard.check import in_calm
from clearway.live.guard.held import Held
from clearway.live.guard.holding import Holding, is_certain
from clearway.live.guard.leg import off_kept_pitch
from clearway.live.guard.nearest import NearnessToWish, overshoot_m
from clearway.live.guard.wish import Wish
from clearway.live.knowledge import Knowledge
from clearway.live.link.guarded import Guarded
from clearway.live.mission import Mode
from clearway.live.outputs.explain import explanation
from clearway.obstacles.obstacle_map import ObstacleMap

LEVEL_RAD = math.radians(2.0)
"""A pitch that is no farther off counts as one that movements keep."""
NOT_GOOD = (Basis.EMERGENCY, Basis.NO_LOITER)
FLOWN_ON = "; the held escape is flown on"


class Replacement:
    """Decides for one vehicle, and holds what was decided.

    planner: its terminal cost is `nearness`. hold_s: for how long a wish counts.
    acceleration_mps2: of the vehicle.
    """

    def __init__(
        self,
        planner: Planner,
        nearness: NearnessToWish,
        holding: Holding,
        known: Knowledge,
        hold_s: float,
        acceleration_mps2: float,
    ) -> None:
        self.planner, self.hold_s = planner, hold_s
        self._nearness, self._holding, self._known = nearness, holding, known
        self._acceleration_mps2 = acceleration_mps2

    def find(
        self, wish: Wish | None, asked: Asked, obstacle_map: ObstacleMap | None
    ) -> tuple[Decision | None, str]:
        """Decide if what is held does not go on, and hold that; None where it does. And what that
        adds to the reason."""
        state, now, held = asked.state, asked.state.time_s, self._holding.held
        threat = self._holding.is_threatened(asked.around, now)
        goes_on = held is not None and held.leg is None and now < held.renew_s - 1e-6
        if goes_on and not threat:
            return None, ""
        if held is not None and held.loop and not threat and self._between_pitches(state):
            return None, f"{FLOWN_ON} to a pitch that movements keep"
        decision = self._decide(wish, asked)
        if held is not None and _brakes(held) and self._is_no_better(decision, asked, goes_on):
            # To brake anew at every tick, from a class of speed, is never to brake.
            return None, FLOWN_ON
        good = decision.choice.basis not in NOT_GOOD and is_certain(decision.way_out)
        at_end = held is not None and held.way_out_at(now) is not None
        if held is not None and held.loop and not good and not at_end:
            # Between two movements a decision falls back on the held escape by itself.
            beside = threat and is_certain(decision.way_out)
            if not beside:
                return None, FLOWN_ON
        self._holding.take_decision(decision)
        return decision, f"; {explanation(decision, Mode.AVOIDANCE, obstacle_map)}"

    def _is_no_better(self, decision: Decision, asked: Asked, goes_on: bool) -> bool:
        """Whether a decision finds nothing better than the rest of an escape: while it brakes no
        emergency is, but for one that an aircraft causes."""
        basis = decision.choice.basis
        if basis is Basis.WAY_OUT:
            return goes_on
        brakes = self._holding.velocity_at(asked.state.time_s).any()
        return basis in NOT_GOOD and bool(brakes) and not asked.around.intruders

    def _between_pitches(self, state: State) -> bool:
        """Whether movements from here would climb or sink for ever."""
        if self.planner.automaton.keeps_attitude:
            return False
        return abs(off_kept_pitch(float(state.attitude_rad[1]), self.planner.automaton)) > LEVEL_RAD

    def _decide(self, wish: Wish | None, asked: Asked) -> Decision:
        state, automaton, holding = asked.state, self.planner.automaton, self._holding
        now = state.time_s
        situation, _ = self._known.with_detections(state, now)
        wished = np.zeros(3) if wish is None else wish.velocity_from(state.position_m, self.hold_s)
        unsure_m = overshoot_m(automaton, state, asked.velocity_mps, self._acceleration_mps2)
        return decide(
            self.planner,
            self._nearness.towards(wished, in_calm(situation), self.planner, unsure_m),
            commitment=Commitment(
                stood=STANDING_IS_WANTED,
                passings=holding.passings,
                way_out=None if holding.held is None else holding.held.way_out_at(now),
                had_certain=holding.had_certain,
            ),
        )

    def answer(self, now: float, now_s: float, why: str, decision: Decision | None) -> Guarded:
        """What a guardian says of what is held; now: by its own clock."""
        held = self._holding.held
        assert held is not None  # A decision always ends in something to fly.
        point, velocity = self._holding.command_at(now)
        soon, _ = held.at(now + 0.1)
        turned = (float(soon.attitude_rad[2]) - point.yaw_rad) / 0.1
        margin = self.planner.settings.safety_margin_m if decision is None else decision.margin_m
        return Guarded(
            now_s, False, point, velocity, turned, why, margin, held.way_out, decision=decision
        )


def _brakes(held: Held) -> bool:
    """Whether an escape is flown in place of a wish."""
    decision = held.decision
    return decision is not None and decision.choice.basis is Basis.WAY_OUT
