"""Before take-off: whether beams are fine enough for the thinnest thing to keep clear of.

A thing that is thinner than beams lie apart may stand between them. What matters is how far apart
they lie where the vehicle must have seen it at the latest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.live.inputs.reaction import smallest_object_m, turning_distance_m
from clearway.sensors import Lidar
from clearway.sensors.observed.view_shape import view_shape

MILLIMETRES = 1e3
SHORT_SIGHT = 0.5
"""Of the distance to stop from the greatest speed: what shows less makes flights slow."""


def thickness_held_m(planner: Planner, lidars: Sequence[Lidar]) -> float:
    """Thickness that no beam pattern misses at the turning distance, of the finest LiDAR.

    Infinite where none looks that far.
    """
    distance = turning_distance_m(planner)
    return min(
        (
            lidar.pattern.spacing_rad * distance
            for lidar in lidars
            if lidar.pattern.max_range_m >= distance
        ),
        default=np.inf,
    )


def too_coarse(planner: Planner, lidars: Sequence[Lidar]) -> str | None:
    """Why the beams cannot hold `smallest_object_m`; None if they can, or nothing is declared."""
    smallest = planner.settings.smallest_object_m
    held = thickness_held_m(planner, lidars)
    if smallest is None or held <= smallest:
        return None
    distance = turning_distance_m(planner)
    enough = f"beams {_down(np.degrees(smallest / distance))} deg apart would do"
    if not np.isfinite(held):
        return (
            f"safety.smallest_object_m = {smallest:g}: no LiDAR looks as far as the turning "
            f"distance of {distance:.2f} m; {enough}"
        )
    return (
        f"safety.smallest_object_m = {smallest:g}: objects {MILLIMETRES * smallest:.3g} mm thick "
        f"can be missed at the turning distance of {distance:.2f} m, where the beams lie "
        f"{MILLIMETRES * held:.3g} mm apart ({np.degrees(held / distance):.3g} deg); {enough}, "
        f"or a smallest object of {np.ceil(MILLIMETRES * held) / MILLIMETRES:g} m"
    )


def _down(value: float) -> str:
    """Three digits that do not claim more than there is."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 2.0)
    return f"{np.floor(value / unit * (1.0 + 1e-12)) * unit:.6g}"


def what_beams_hold(planner: Planner, lidars: Sequence[Lidar]) -> str | None:
    """What the log says where nothing is declared; None without a LiDAR, or if it is declared."""
    held = thickness_held_m(planner, lidars)
    if planner.settings.smallest_object_m is not None or not np.isfinite(held):
        return None
    missed = (
        f"note: objects thinner than {MILLIMETRES * held:.0f} mm can be missed at the turning "
        f"distance of {turning_distance_m(planner):.1f} m. "
    )
    smallest_m, assumed = smallest_object_m(planner), ""
    if smallest_m > 0.0:
        far_m = max(fine_to_m(lidar, smallest_m) for lidar in lidars)
        assumed = f"{smallest_m:g} m is assumed: beams show free space up to {far_m:.3g} m. "
    return f"{missed}{assumed}Set safety.smallest_object_m to have this checked"


def what_limits_speed(planner: Planner, lidars: Sequence[Lidar]) -> str | None:
    """What the log says where beams show far less free space than stopping takes; else None."""
    smallest_m = smallest_object_m(planner)
    if not (planner.automaton.has_inertia and smallest_m > 0.0 and lidars):
        return None
    far_m = max(fine_to_m(lidar, smallest_m) for lidar in lidars)
    if far_m >= SHORT_SIGHT * planner.escape_reach_m:
        return None
    return (
        f"note: beams show no free space beyond {far_m:.3g} m, since an object of {smallest_m:g} m "
        f"can hide between them. Stopping from {planner.speed_mps:g} m/s takes more than twice as "
        "much, so the vehicle will fly far slower, or stay. Use beams closer together, or a larger "
        "safety.smallest_object_m if nothing thinner stands there"
    )


def fine_to_m(lidar: Lidar, smallest_m: float) -> float:
    """How far beams lie so near to each other that an object of a thickness cannot hide."""
    fine_m = 0.5 * smallest_m / float(np.sin(view_shape(lidar.pattern).gap_rad))
    return min(fine_m, lidar.clears_to_m)
