"""Movers seen by LiDAR alone: bodies followed over scans until beams prove that they move."""

from clearway.live.movers.following import (
    Body,
    Following,
    MoverSettings,
    follow,
    forget_movers,
    unreported,
)
from clearway.live.movers.motion import Motion, fit_motion

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
