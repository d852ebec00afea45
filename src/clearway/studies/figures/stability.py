"""Stability: how far flights stray from a prediction, and Lyapunov's function over a flight."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray
from clearway.obstacles.world import World
from clearway.view.plot.ground_plan import draw_ground_plan

SIDE_M = 6.0
"""Shown to either side of a track."""
FLOWN = "#1f5fbf"
BOUND = "#d62728"
RISING = "#d95f02"
GOAL = "#2e9e4f"


def draw_deviations(
    time_s: FloatArray, deviation_m: FloatArray, bound_m: FloatArray, title: str
) -> Figure:
    """Deviations [flights, n] at times [n], their middle and 95 %, and the bound [n]."""
    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    axes = figure.add_subplot()
    figure.suptitle(title)
    axes.plot(time_s, deviation_m.T, color=FLOWN, lw=0.3, alpha=0.25)
    axes.plot([], [], color=FLOWN, lw=0.8, label="flights")
    for share, style, name in ((0.5, "-", "median"), (0.95, "--", "95 %")):
        axes.plot(time_s, np.quantile(deviation_m, share, axis=0), "k", ls=style, label=name)
    axes.plot(time_s, bound_m, color=BOUND, lw=2.0, label="bound (3.28)")
    axes.set(xlabel="time (s)", ylabel="deviation from the prediction (m)", ylim=(0.0, None))
    axes.set_xlim(0.0, float(time_s[-1]))
    figure.legend(loc="outside lower center", ncols=4, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def draw_approach(
    time_s: FloatArray,
    track_m: FloatArray,
    lyapunov_m2: FloatArray,
    world: World,
    goal_m: FloatArray,
    title: str,
) -> Figure:
    """The track [n, 3] from above, and V [n] over time with what rises marked."""
    figure = Figure(figsize=(12.0, 5.4), layout="constrained")
    figure.suptitle(title)
    above, value = figure.subplots(1, 2, width_ratios=[1.2, 1.0])
    draw_ground_plan(above, np.concatenate([track_m, goal_m[None]]), world, 0.6)
    above.plot(track_m[:, 0], track_m[:, 1], color=FLOWN)
    above.plot(goal_m[0], goal_m[1], "s", color=GOAL, label="waypoint")
    low, high = float(track_m[:, 1].min()), float(track_m[:, 1].max())
    above.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", ylim=(low - SIDE_M, high + SIDE_M))
    value.plot(time_s, lyapunov_m2, color=FLOWN, label="V")
    rising = np.append(np.diff(lyapunov_m2) > 1e-9, False)
    value.plot(
        time_s, np.where(rising, lyapunov_m2, np.nan), color=RISING, lw=3.0, label="V rising"
    )
    value.set(xlabel="time (s)", ylabel="V = |y|²/2 (m²)", ylim=(0.0, None))
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    for axes in (above, value):
        axes.spines[["top", "right"]].set_visible(False)
    return figure
