"""Rules of users by `module:name`: a `Rule`, or its function of a `RuleView`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from clearway.avoidance.rules.rule import Rule, RuleFunction, RuleView, Verdict
from clearway.base.errors import OwnCodeError
from clearway.base.own_code import callable_own, guard_call
from clearway.base.variants import Variants


def _own(label: str, found: Any) -> Rule:
    """The rule; a function is called by its own name. Its verdicts are checked in flight."""
    if isinstance(found, Rule):
        return replace(found, verdict=_check_function(label, found.verdict))
    function = callable_own(label, found, ("view",))
    name = str(getattr(found, "__name__", label)).replace("_", " ")
    return Rule(name, _check_function(label, function))


def _check_function(label: str, function: RuleFunction) -> RuleFunction:
    asked = guard_call(label, function)

    def verdict(view: RuleView) -> Verdict | None:
        said = asked(view)
        if said is None:
            return None
        if not isinstance(said, Verdict):
            raise OwnCodeError(label, f"gave {type(said).__name__}; a Verdict or None is needed")
        nodes = (view.reach_set.nodes,)
        forbidden = None if said.forbidden is None else np.asarray(said.forbidden)
        if forbidden is not None and (forbidden.shape != nodes or forbidden.dtype != np.bool_):
            raise OwnCodeError(
                label,
                f"forbidden is {forbidden.dtype} {forbidden.shape}; bool {nodes} is needed, one "
                "for each node of the reach set",
            )
        price = np.asarray(said.price_m, dtype=np.float64)
        if price.shape not in ((), nodes) or not bool(np.all((price >= 0.0) & (price < np.inf))):
            raise OwnCodeError(label, f"price_m: a number of metres >= 0 is needed, or {nodes}")
        return replace(said, forbidden=forbidden)

    return verdict


OWN_RULES: Variants[Rule] = Variants("rule", {}, _own)
"""Rules that keys of a mission make are listed in its `[rules]`; all others are users' own."""
