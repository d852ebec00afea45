"""What the missions of plants flew, seen from above: one panel each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.view.plot.ground_plan import draw_ground_plan
from clearway.view.plot.style import OTHERS, OWN, house_style
from tools.pictures import keep
from tools.plants.missions import MISSIONS, Shown
from tools.plants.worlds import REPOSITORY

PICTURE = REPOSITORY / "docs" / "images" / "plants.png"
WIDTH_IN, MOST_IN, DPI = 8.0, 3.2, 90


def draw(missions: Sequence[Shown], target: Path = PICTURE) -> None:
    """Obstacles grey, with the margin around them light; the way flown, and those of others."""
    heights = [_height_in(one) for one in missions]
    with house_style():
        figure = Figure(figsize=(WIDTH_IN, sum(heights) + 0.5 * len(heights)))
        rows = figure.subplots(len(missions), 1, height_ratios=heights, squeeze=False)
        for axes, one in zip(rows[:, 0], missions, strict=True):
            track = np.array(one.track_m)
            setup = prepare(read_mission(str(MISSIONS / f"{one.name}.toml")))
            draw_ground_plan(axes, track, setup.world, one.margin_m)
            for number, other in enumerate(one.others_m):
                there = np.array(other)
                colour = OTHERS[number % len(OTHERS)]
                axes.plot(there[:, 0], there[:, 1], color=colour, linewidth=0.8)
            axes.plot(track[:, 0], track[:, 1], color=OWN)
            goals = setup.mission.goals_m
            axes.plot(goals[:, 0], goals[:, 1], "o", color=OWN, fillstyle="none")
            _look_at(axes, track)
            axes.set_aspect("equal")
            axes.set_title(f"{one.name}: {one.time_s:.0f} s", loc="left")
        rows[-1, 0].set_xlabel("x (m)")
        figure.tight_layout()
        target.parent.mkdir(parents=True, exist_ok=True)
        drawn = target.with_suffix(".drawn.png")
        figure.savefig(drawn, dpi=DPI)
    keep(drawn, target)
    drawn.unlink()


def _span(track: np.ndarray) -> tuple[float, float, float]:
    """Middle and half the width across the way, and its length."""
    low, high = track.min(axis=0), track.max(axis=0)
    length = float(high[0] - low[0])
    half = max(0.5 * float(high[1] - low[1]) + 0.08 * length, 0.12 * length)
    return 0.5 * float(low[1] + high[1]), half, length


def _height_in(one: Shown) -> float:
    _, half, length = _span(np.array(one.track_m))
    return min(MOST_IN, WIDTH_IN * 2.0 * half / (1.16 * max(length, 1e-9)))


def _look_at(axes: object, track: np.ndarray) -> None:
    middle, half, length = _span(track)
    left = float(track[:, 0].min()) - 0.08 * length
    axes.set_xlim(left, left + 1.16 * length)  # type: ignore[attr-defined]
    axes.set_ylim(middle - half, middle + half)  # type: ignore[attr-defined]
