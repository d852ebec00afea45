"""Movers seen by LiDAR alone: bodies followed over scans until beams prove that they move."""

from clearway.movers.following import (
    Body,
    Following,
    MoverSettings,
    follow,
    forget_movers,
    unreported,
)
from clearway.movers.motion import Motion, fit_motion

__all__ = [
    "Body",
    "Following",
    "Motion",
    "MoverSettings",
    "fit_motion",
    "follow",
    "forget_movers",
    "unreported",
]
