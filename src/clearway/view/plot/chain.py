"""How buffers of movements are chained (fig. 6.1): flown, flushed, decided where."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from clearway.sim import Run
from clearway.view.plot.space import limits_around, stack_views

EXECUTED = "#1f5fbf"
FLUSHED = "#d62728"
DECIDED = "#8e44ad"


def draw_chain(run: Run, until_s: float, title: str) -> Figure:
    """The track and every decision's plan up to a time, from above and from the side."""
    track = run.states[run.time_s <= until_s + 1e-9, :3]
    decisions = [entry.flight for entry in run.decisions if entry.flight.time_s < until_s]
    limits = limits_around(np.concatenate([track, *(each.decision.path_m for each in decisions)]))
    figure = Figure(figsize=(11.0, 6.6), layout="constrained")
    figure.suptitle(title)
    panels = stack_views(figure, figure.add_gridspec(1, 1)[0], limits)
    for axes, across, label in zip(panels, (1, 2), ("y left (m)", "z up (m)"), strict=True):
        for number, each in enumerate(decisions):
            path, name = each.decision.path_m, "" if number else "planned, then flushed"
            axes.plot(path[:, 0], path[:, across], color=FLUSHED, lw=0.9, alpha=0.7, label=name)
        axes.plot(track[:, 0], track[:, across], color=EXECUTED, lw=2.5, label="executed")
        at = [each.decision.state.position_m for each in decisions]
        axes.plot(
            [place[0] for place in at],
            [place[across] for place in at],
            "o",
            color=DECIDED,
            mfc="white",
            label="decision takes effect",
        )
        axes.set(xlabel="x ahead (m)", ylabel=label)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure
