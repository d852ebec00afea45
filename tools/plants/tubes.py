"""The tubes of plants that follow references, by speed: the table of docs/plants.md."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from clearway.sim.plants import PLANTS
from clearway.sim.plants.measuring import MeasureSettings
from clearway.sim.plants.measuring_classes import MeasuredCopter, measure_copter
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.copter import CopterLimits

GUSTS_MPS = (1.0, 2.0)
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Of the greatest speed, at which the table shows the tube."""


def measured(
    names: Sequence[str], flights: int, held_out: int
) -> Iterator[tuple[str, CopterLimits, MeasuredCopter]]:
    """Each plant at its own acceleration, in gusts."""
    for name in names:
        kind = PLANTS.find(name)
        if kind.copter is None:
            continue
        for gusts in GUSTS_MPS:
            limits = replace(kind.copter, gusts_mps=gusts)
            settings = MeasureSettings(flights, held_out, gusts_mps=gusts)
            automaton = MovementAutomaton.of_copter(limits)
            yield name, limits, measure_copter(kind, automaton, settings)


def tubes(names: Sequence[str], flights: int = 3, held_out: int = 2) -> list[str]:
    """The table: what was measured, and what a copter that was not measured is taken to have."""
    shares = " | ".join(f"{100 * share:.0f} %" for share in SHARES)
    rows = [
        f"| plant | limits | gusts | tube at a share of the speed: {shares} | held out inside |",
        "| --- | --- | --- |" + " --- |" * (len(SHARES) + 1),
    ]
    for name, limits, found in measured(names, flights, held_out):
        speeds = limits.speed_mps * np.array(SHARES)
        at = np.abs(found.speeds_mps[:, None] - speeds).argmin(axis=0)
        radii = (
            f"{own:.2f} ({taken:.2f}) m"
            for own, taken in zip(found.tube_m[at], limits.tube_m(speeds), strict=True)
        )
        rows.append(
            f"| `{name}` | {limits.speed_mps:g} m/s, {limits.acceleration_mps2:g} m/s2 | "
            f"{limits.gusts_mps:g} m/s | {' | '.join(radii)} | {100 * found.inside.mean():.1f} % |"
        )
    rows.append("")
    rows.append("In brackets: what a copter that was not measured is taken to have.")
    return rows
