"""Random encounters: the share that keeps its distance, of those that can be avoided."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.flights import PROCESSES
from benchmarks.table import Benchmark, Row, Target
from clearway.cli.encounters import fly_encounters_with_bar
from clearway.studies.encounters.encounter import STANDARD_KINDS, EncounterSettings

FULL, QUICK, LARGE = 1_000, 100, 300
"""`clearway encounters` flies any number; docs/results/encounters.md has ten thousand of each."""


def kept(settings: EncounterSettings) -> Callable[[bool], Row]:
    """Fewer at a larger scale, where every encounter is the small one times the scale."""

    def measure(quick: bool) -> Row:
        number = QUICK if quick else FULL if settings.scale == 1.0 else LARGE
        tally = fly_encounters_with_bar(settings, range(number), PROCESSES, "clearway")
        low, high = tally.interval
        return Row(
            f"{number} encounters {settings.in_words}: distance kept, of those avoidable",
            f"{tally.kept} of {tally.avoidable}",
            f"95 % Wilson {100.0 * low:.2f} to {100.0 * high:.2f} %, "
            f"nearest {tally.min_distance_m:.2f} of {tally.distance_to_keep_m:g} m",
            Target(f">= {100.0 * tally.required:g} %", tally.verdict),
        )

    return measure


def name_of(settings: EncounterSettings) -> str:
    parts = [f"encounters, {settings.detected_at_m:g} m"]
    parts += [f"{settings.late_s:g} s late"] if settings.late_s else []
    parts += ["deviating"] if settings.deviates else []
    parts += ["tracked"] if settings.noisy else []
    parts += [f"x {settings.scale:g}"] if settings.scale != 1.0 else []
    return ", ".join(parts)


BENCHMARKS = tuple(
    Benchmark(name_of(kind), kept(kind), headline=kind.scale == 1.0) for kind in STANDARD_KINDS
)
