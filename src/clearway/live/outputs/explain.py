"""A decision in words: what is flown, how sure it is, and why nothing cheaper was taken."""

from __future__ import annotations

from clearway.avoidance.choose.candidates import Side
from clearway.avoidance.choose.chosen import Basis, Choice
from clearway.avoidance.clear.hazards import Cause
from clearway.avoidance.decision import Decision
from clearway.avoidance.rules import RuleNote
from clearway.base.brief import runs
from clearway.live.mission import Mode
from clearway.live.outputs.kept_clearance import KeptClearance
from clearway.obstacles.obstacle_map import ObstacleMap

WHERE = {Side.LEFT: "left of", Side.STRAIGHT: "on", Side.RIGHT: "right of"}
NOT_REACHABLE = "not reachable as far as seen"
"""Of a goal to which no way leads that has not come to nothing."""


def explanation(
    decision: Decision,
    mode: Mode,
    obstacle_map: ObstacleMap | None,
    held: str | None = None,
    kept: KeptClearance | None = None,
) -> str:
    """One line per decision for the log and for people; held: why the vehicle only holds."""
    choice = decision.choice
    parts = [
        f"{mode}: {runs(decision.movements)}, {WHERE[choice.side]} the way to the goal",
        f"P_R {choice.rating:.3f}, P_D {choice.feasibility:.3f}, {_clearance(decision)}"
        + ("" if kept is None else f", {kept.in_words}"),
        str(choice.basis),
    ]
    if decision.speed is not None:
        parts.insert(1, decision.speed.in_words)
    if choice.basis is Basis.EMERGENCY:
        parts.insert(
            0,
            f"EMERGENCY: no trajectory keeps {decision.margin_m:.2f} m; "
            f"margin stepped down to {choice.margin_m:.2f} m",
        )
    if held is not None:
        what = f"goal {held}" if held.startswith(NOT_REACHABLE) else held
        parts.insert(0, f"holds safely: {what}")
    if decision.goes_narrow:
        parts.insert(0, "no escape is held here, as the mission allows: no guarantee")
    if decision.no_way_out:
        parts.append(f"no escape after {', '.join(decision.no_way_out)}")
    if decision.way_out is not None and not decision.way_out.certain:
        parts.append("its escape leads through unobserved space")
    elif decision.way_out is not None and decision.way_out.unobserved_m > 0.0:
        crossed_m = decision.way_out.unobserved_m
        parts.append(f"its escape crosses {crossed_m:.1f} m of unobserved space, as allowed")
    ruled_out = _explain_ruled_out(choice, decision, obstacle_map)
    if ruled_out:
        parts.append(ruled_out)
    parts += [_rule_in_words(note) for note in choice.rules]
    if decision.long_range is not None and decision.long_range.wanted_tier:
        parts.append(f"in the next minute: {decision.long_range.reason}")
    return "; ".join(parts)


def _clearance(decision: Decision) -> str:
    choice = decision.choice
    if choice.limited_by is Cause.NOTHING:
        return "nothing in reach"
    if choice.clearance_m < -decision.margin_m:
        # How far inside of what may be reached says nothing: a distance is not below zero.
        return f"no clearance, {decision.margin_m:.2f} m asked"
    return f"clearance {choice.clearance_m:.2f} m of {decision.margin_m:.2f} m asked"


def _explain_ruled_out(choice: Choice, decision: Decision, obstacle_map: ObstacleMap | None) -> str:
    """Why the cheaper candidates were not taken: counts by cause, and the cheapest one."""
    reasons = [f"{number} by {name}" for name, number in choice.ruled_out_by.items()]
    if choice.below_threshold:
        reasons.append(f"{choice.below_threshold} of {choice.candidates} rated too low")
    if not reasons:
        return ""
    text = "ruled out: " + ", ".join(reasons)
    if choice.ruled_out:
        first = choice.ruled_out[0]
        what = _what(first.cause, first.index, decision, obstacle_map)
        near = f"comes within {first.clearance_m:.2f} m"
        if first.clearance_m < -decision.margin_m:
            near = "leads through the reach"
        text += f"; the cheapest ({first.cost_m:.1f} m) {near} {what}"
    return text


def _rule_in_words(note: RuleNote) -> str:
    did = [f"forbids {note.forbidden}"] if note.forbidden else []
    did += ["decided"] if note.decided else []
    did += ["broken for safety"] if note.broken else []
    return f"rule {note.name} ({note.reason})" + (f": {', '.join(did)}" if did else "")


def _what(cause: Cause, index: int, decision: Decision, obstacle_map: ObstacleMap | None) -> str:
    if cause is Cause.MAP and obstacle_map is not None:
        source = int(decision.hazards.shapes.source[index])
        name = obstacle_map.obstacles[source].name or f"number {source}"
        return f"of {name_with_kind('map obstacle', name)}"
    if cause is Cause.INTRUDER:
        return f"of {name_with_kind('intruder', decision.intruders[index] or f'number {index}')}"
    return "of a return"


def name_with_kind(kind: str, name: str) -> str:
    """A name with what it is the name of, unless it says so itself: no "intruder intruder"."""
    words = kind.split()
    if name.lower().split()[:1] == words[-1:]:
        del words[-1]
    return " ".join([*words, name])
