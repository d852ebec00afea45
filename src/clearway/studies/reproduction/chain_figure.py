"""Fig. 6.1: movement buffers of one decision after the other, chained (6.3)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from clearway.studies.reproduction.flights import Flight, flight_of
from clearway.studies.reproduction.target import Exhibit, Findings, Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNTIL_S = 12.0
MISSION = "static-obstacles"


def chain_figure() -> tuple[Exhibit, ...]:
    """The start of the flight of 6.4, up to the first obstacle."""
    flight = flight_of(MISSION)
    decisions = [entry.flight for entry in flight.run.decisions if entry.flight.time_s < UNTIL_S]
    planned = sum(len(each.decision.movements) for each in decisions)
    executed = round(UNTIL_S)
    return (
        Exhibit(
            "Figure 6.1",
            "chained parts of movement buffers",
            Findings(
                claim="Of every decision's buffer the first movements are executed and the rest "
                "is flushed at the next decision; the executed parts make the final buffer (6.3).",
                ours=f"In the first {UNTIL_S:g} s of the flight of 6.4, {len(decisions)} decisions "
                f"plan {planned} movements, of which {executed} are executed.",
                difference="With an obstacle in view a decision is due at every movement, so that "
                "one movement of each buffer is flown; the paper's sketch flies several.",
                measures=(
                    Measure("decisions", len(decisions)),
                    Measure("movements planned", planned),
                    Measure("movements executed", executed),
                    Measure("movements flushed", planned - executed),
                ),
            ),
            partial(_draw, flight),
        ),
    )


def _draw(flight: Flight) -> Figure:
    from clearway.view.plot.chain import draw_chain

    return draw_chain(flight.run, UNTIL_S, "Figure 6.1: chained parts of movement buffers")
