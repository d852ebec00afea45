"""The tables of docs/results/plants.md: how well predictions hold, and what came of the flights."""

from __future__ import annotations

import re
import textwrap
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from clearway.io.toml import read_model
from clearway.missions.automaton_file import AutomatonFile
from tools.plants.missions import Shown
from tools.plants.study import Flown
from tools.plants.worlds import AUTOMATA, FAMILIES, SCALES


def predicted(files: Sequence[Path]) -> list[str]:
    """How far predictions stray, by automaton file."""
    rows = [
        "| plant | speed | gusts | flights | 95 % held out within, after one movement | "
        "after five | by closed form: one | five | tube after one / five |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for file in files:
        read = read_model(file, AutomatonFile)
        about = read.automaton
        speed = max(one.speed_mps for one in read.movement)
        own, closed, tube = about.error_p95_m, about.closed_form_p95_m, about.tube_m
        rows.append(
            f"| `{about.plant}` | {speed:g} m/s | {about.gusts_mps:g} m/s | "
            f"{about.flights} + {about.held_out} | {own[0]:.3g} m | {own[4]:.3g} m | "
            f"{closed[0]:.3g} m | {closed[4]:.3g} m | {tube[0]:.3g} / {tube[4]:.3g} m |"
        )
    return rows


def shown(missions: Sequence[Shown]) -> list[str]:
    """The missions in the examples."""
    rows = [
        "| mission | arrived | nearest, of the margin | time | decisions without an escape | "
        "within the tube | real-time factor |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in missions:
        inside = 100.0 * (1.0 - one.strayed / max(one.looks, 1))
        rows.append(
            f"| [{one.name}](../../examples/missions/plants/{one.name}.toml) | "
            f"{'yes' if one.reached else one.ended} | {one.nearest_m:.2f} of {one.margin_m:g} m | "
            f"{one.time_s:.0f} s | {one.without} of {one.decisions} | "
            f"{inside:.1f} % of {one.looks} | {one.time_s / one.cpu_s:.0f} |"
        )
    return rows


def flown(flights: Sequence[Flown]) -> list[str]:
    """Random worlds, a row for each plant and what goes wrong."""
    rows = [
        "| plant | worlds | n | arrived | body touched | margin lost | "
        "decisions without an escape | own states within the tube | real-time factor |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for scale in SCALES:
        for name, family in FAMILIES.items():
            some = [one for one in flights if (one.plant, one.family) == (scale.plant, name)]
            if not some:
                continue
            looks = sum(one.looks for one in some)
            inside = 100.0 * (1.0 - sum(one.strayed for one in some) / max(looks, 1))
            factor = sum(one.time_s for one in some) / sum(one.cpu_s for one in some)
            rows.append(
                f"| `{scale.plant}` | {family.about} | {len(some)} | "
                f"{sum(one.reached for one in some)} | {sum(one.hit for one in some)} | "
                f"{sum(one.lost for one in some)} | {sum(one.without for one in some)} of "
                f"{sum(one.decisions for one in some)} | {inside:.1f} % of {looks} | {factor:.0f} |"
            )
    return rows


def said(flights: Sequence[Flown]) -> list[str]:
    """What all flights together show, and how little so many can."""
    if not flights:
        return []
    touched, lost = (sum(getattr(one, what) for one in flights) for what in ("hit", "lost"))
    whole = [one for one in flights if FAMILIES[one.family].fault is None]
    arrived = sum(one.reached for one in whole)
    looks, strayed = (sum(getattr(one, what) for one in flights) for what in ("looks", "strayed"))
    inside = 100.0 * (1.0 - strayed / max(looks, 1))
    told = (
        f"{len(flights)} flights through random worlds: {touched} touched something, {lost} came "
        f"nearer than the margin; of {len(whole)} in which nothing went wrong {arrived} arrived. "
        f"{inside:.2f} % of {looks} own states lay within the tube."
    )
    if not touched:
        most = 100.0 * (1.0 - 0.05 ** (1.0 / len(flights)))
        told += f" At 95 % confidence that leaves up to {most:.1f} % of such flights that do."
    return textwrap.wrap(told, 104)


def held(flights: Sequence[Flown]) -> list[str]:
    """Why those that did not arrive did not, and whether they were safe."""
    reasons = Counter[tuple[str, str, str, bool]]()
    for one in flights:
        if not one.reached:
            ended = re.sub(r"\d+(\.\d+)?", "n", one.ended)
            reasons[one.plant, FAMILIES[one.family].about, ended, one.hit] += 1
    lines = []
    for (plant, about, ended, hit), count in sorted(reasons.items()):
        how = "touched something" if hit else "nothing touched"
        lines.append(f"- `{plant}`, {about}, {count}, {how}: {ended}")
    if not lines:
        return []
    return [
        "Those that did not arrive, with what they did at their end (n: some number):",
        "",
        *lines,
    ]


def automata() -> list[Path]:
    """Measured automata of the examples, by plant and gusts."""
    return sorted(AUTOMATA.glob("*.toml"))
