"""Tables of a study over many models, for a Markdown page: by model, by layer, by planner."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from clearway.base.own_code import shorten_own_name
from clearway.io.marked_page import put_between_marks
from clearway.studies.risk.horizontal_cas import PREFIX
from clearway.studies.risk.many import ModelStudy
from clearway.studies.risk.ratios import LARGEST_RATIOS

NEAR, LOST = LARGEST_RATIOS


def model_rows(studies: Sequence[ModelStudy]) -> list[tuple[str, ...]]:
    """Return ratios, needless manoeuvres and detours by model, of the first planner."""
    rows: list[tuple[str, ...]] = [
        (
            "model", "encounters", "near mid-air collision", "loss of well clear",
            "induced", "needless manoeuvres", "manoeuvres that are needless", "extra path",
            "effective sample size",
        )
    ]  # fmt: skip
    for one in studies:
        told = one.summary["planners"][one.result.planners[0]]
        induced = ", ".join(str(len(told[name]["induced_cases"])) for name in LARGEST_RATIOS)
        worth = ", ".join(f"{one.summary['effective'][name]:.0f}" for name in LARGEST_RATIOS)
        nuisance = told["nuisance"]
        rows.append(
            (
                one.name,
                str(one.summary["encounters"]),
                ratio_in_words(told[NEAR]),
                ratio_in_words(told[LOST]),
                induced,
                _percent(nuisance["of_clear"], nuisance["of_clear_95"]),
                _percent(nuisance["of_manoeuvres"], nuisance["of_manoeuvres_95"]),
                _metres(nuisance["extra_path_m"]),
                worth,
            )
        )
    return rows


def layer_rows(studies: Sequence[ModelStudy]) -> list[tuple[str, ...]]:
    """Return the first planner's ratios by model and altitude layer."""
    head = ("model, layer", "altitude", "weight", "encounters",
            "near mid-air collision", "loss of well clear")  # fmt: skip
    rows: list[tuple[str, ...]] = [head]
    for one in studies:
        planner = one.result.planners[0]
        for layer in one.summary["layers"]:
            low, high = layer["altitude_ft"]
            rows.append(
                (
                    f"{one.name}, {layer['layer']}",
                    f"{low:.0f}-{high:.0f} ft",
                    f"{100.0 * layer['weight']:.1f} %",
                    str(layer["encounters"]),
                    ratio_in_words(layer[planner][NEAR]),
                    ratio_in_words(layer[planner][LOST]),
                )
            )
    return rows


def planner_rows(studies: Sequence[ModelStudy]) -> list[tuple[str, ...]]:
    """Return the loss of well clear, near collisions and needless manoeuvres by planner."""
    head = ("model, planner", "encounters", "near mid-air collision", "loss of well clear",
            "needless manoeuvres", "extra path")  # fmt: skip
    rows: list[tuple[str, ...]] = [head]
    for one in studies:
        for planner, told in one.summary["planners"].items():
            nuisance = told["nuisance"]
            rows.append(
                (
                    f"{one.name}, {shorten_name(planner)}",
                    str(one.summary["encounters"]),
                    ratio_in_words(told[NEAR]),
                    ratio_in_words(told[LOST]),
                    _percent(nuisance["of_clear"], nuisance["of_clear_95"]),
                    _metres(nuisance["extra_path_m"]),
                )
            )
    return rows


FORMS: Mapping[str, Callable[[Sequence[ModelStudy]], list[tuple[str, ...]]]] = {
    "encounter-models": model_rows,
    "encounter-layers": layer_rows,
    "encounter-planners": planner_rows,
}
"""What can be put into a page, by the name of its marks."""


def write_model_tables(page: Path, studies: Sequence[ModelStudy]) -> list[str]:
    """Put every table whose marks a page has between them; return their names.

    Raises InputError where the page cannot be read or written, or has no marks.
    """
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    names = [name for name in FORMS if f"<!-- {name}:begin -->" in text] or list(FORMS)[:1]
    for name in names:
        put_between_marks(page, name, as_markdown(FORMS[name](studies)))
    return names


def shorten_name(planner: str) -> str:
    """Return a planner's name for tables, without the folder of its networks or file."""
    kind = PREFIX.rstrip(":")
    return kind if planner.startswith(PREFIX) else shorten_own_name(planner)


def as_markdown(rows: Sequence[Sequence[str]]) -> str:
    """Return rows, the head first, as a Markdown table."""
    head, *rest = rows
    lines = [head, ["---"] * len(head), *rest]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def ratio_in_words(measure: Mapping[str, Any]) -> str:
    """Return a ratio with its interval, or that there is no case."""
    if measure["ratio"] is None:
        return "no case"
    low, high = measure["ratio_95"]
    upper = "no bound" if high is None else f"{high:.4f}"
    return f"{measure['ratio']:.4f} ({low:.4f} to {upper})"


def _percent(share: float | None, ends: Sequence[float | None]) -> str:
    if share is None or ends[0] is None or ends[1] is None:
        return "-"
    return f"{100.0 * share:.1f} % ({100.0 * ends[0]:.1f} to {100.0 * ends[1]:.1f})"


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f} m"
