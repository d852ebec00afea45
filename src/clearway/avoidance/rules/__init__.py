"""Rules (fig. 7.1): named functions that forbid or cost trajectories in a decision."""

from clearway.avoidance.rules.airspace import (
    GroundHeights,
    altitude_ceiling,
    altitude_floor,
    keep_out,
    near_route,
    terrain_clearance,
)
from clearway.avoidance.rules.rule import (
    MOST_RULES,
    Rule,
    RuleNote,
    RuleView,
    Ruling,
    Verdict,
    rule_on,
)
from clearway.avoidance.rules.traffic import horizontal_only, right_of_way, vertical_only

__all__ = [
    "MOST_RULES",
    "GroundHeights",
    "Rule",
    "RuleNote",
    "RuleView",
    "Ruling",
    "Verdict",
    "altitude_ceiling",
    "altitude_floor",
    "horizontal_only",
    "keep_out",
    "near_route",
    "right_of_way",
    "rule_on",
    "terrain_clearance",
    "vertical_only",
]
