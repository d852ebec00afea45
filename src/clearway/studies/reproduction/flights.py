"""The flights of 6.4 and 6.5, each flown once for all its figures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import FlightSetup, prepare
from clearway.sim import LoggedDecision, Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Flight:
    """A mission and how it went."""

    setup: FlightSetup
    run: Run

    @property
    def conservative_m(self) -> float:
        """Margin of conservative methods (6.14): two turning radii and two of the vehicle."""
        craft = self.setup.craft
        return 2.0 * craft.conservative_turning_radius_m + 2.0 * craft.body_radius_m

    @property
    def adaptive_m(self) -> float:
        """Margin of adaptive methods (6.15)."""
        return 6.0 * self.setup.craft.body_radius_m


@cache
def flight_of(mission: str) -> Flight:
    """A mission that ships with the package, flown with its own seed."""
    setup = prepare(read_mission_file(mission))
    return Flight(setup, setup.fly())


def draw_moment(entry: LoggedDecision, quantity: str, title: str) -> Figure:
    """Trajectories and cells of one decision: "reachability", "obstacle" or "visibility"."""
    from clearway.view.plot.assessment import assessment_figures

    decision = entry.flight.decision
    figure = assessment_figures(
        decision.cells,
        decision.reach,
        decision.prepared.reach_set,
        decision.frame.grid_points(decision.seen_m),
        title,
    )[quantity]
    figure.suptitle(title, fontsize=15)
    return figure
