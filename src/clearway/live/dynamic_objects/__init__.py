"""Dynamic objects seen by LiDAR alone: bodies followed until beams prove that they move."""

from clearway.live.dynamic_objects.following import (
    Body,
    DynamicObjectSettings,
    Following,
    find_unreported,
    follow,
    forget_dynamic_objects,
)
from clearway.live.dynamic_objects.motion import FittedMotion, fit_motion

__all__ = [
    "Body",
    "DynamicObjectSettings",
    "FittedMotion",
    "Following",
    "find_unreported",
    "fit_motion",
    "follow",
    "forget_dynamic_objects",
]
