"""Encounters that can be avoided, over bearing and speed, one panel per bound of acceleration."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from clearway.base.frames import FloatArray
from clearway.studies.encounters.pursuit import WinMap

# Okabe-Ito: distinguished by colour-blind eyes too.
NONE = "#EEEEEE"
OPEN = "#D55E00"
WON = "#009E73"
LABELS = {NONE: "no collision course", OPEN: "no plan found that wins", WON: "won for good"}


def draw_win_map(win_map: WinMap) -> Figure:
    """Bearing across, speed upwards."""
    panels = len(win_map.accelerations_mps2)
    figure = Figure(figsize=(1.2 + 3.1 * panels, 4.3), dpi=120)
    bearings = _edges(np.degrees(win_map.bearings_rad))
    speeds = _edges(win_map.speeds)
    for panel, axes in enumerate(np.atleast_1d(figure.subplots(1, panels, sharey=True))):
        bound, share = win_map.accelerations_mps2[panel], win_map.share[panel]
        kind = np.where(win_map.exists, 1 + win_map.won[panel], 0)
        axes.pcolormesh(
            bearings,
            speeds,
            kind.T,
            cmap=ListedColormap([NONE, OPEN, WON]),
            vmin=0,
            vmax=2,
            edgecolors="white",
            linewidth=0.6,
        )
        name = "flies straight on" if bound == 0.0 else f"turns with up to {bound:g} m/s²"
        axes.set_title(f"{name}\n{100.0 * share:.0f} % won", fontsize=10)
        axes.set_xlabel("bearing of the intruder (deg)")
        if panel == 0:
            axes.set_ylabel("its speed, share of the ownship's")
    figure.suptitle(
        f"Collision courses detected at {win_map.detected_at_m:g} m: "
        f"which keep {win_map.keep_m:g} m whatever the intruder does",
    )
    figure.legend(
        handles=[Patch(color=colour, label=label) for colour, label in LABELS.items()],
        loc="lower center",
        ncols=len(LABELS),
        frameon=False,
    )
    figure.tight_layout(rect=(0.0, 0.07, 1.0, 1.0))
    return figure


def _edges(middles: FloatArray) -> FloatArray:
    """[n + 1] borders half way between values [n], as wide outside as inside."""
    if len(middles) < 2:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = 0.5 * (middles[1:] + middles[:-1])
    first, last = 2.0 * middles[0] - between[0], 2.0 * middles[-1] - between[-1]
    return np.concatenate([[first], between, [last]])
