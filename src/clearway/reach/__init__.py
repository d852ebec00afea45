"""Reach sets: what the vehicle can fly from here, as trees of movements (section 4.5)."""

from clearway.reach.sets import METHODS, build_reach_set
from clearway.reach.store import ReachLibrary
from clearway.reach.tree import ReachSet

__all__ = ["METHODS", "ReachLibrary", "ReachSet", "build_reach_set"]
