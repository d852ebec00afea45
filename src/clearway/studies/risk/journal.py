"""Outcomes of a study kept as they come, so that one that ended early goes on where it ended."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError, naming
from clearway.base.provenance import sha256_of
from clearway.base.version import __version__
from clearway.io.staging import growing_file
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.risk.flight import Separation
from clearway.studies.risk.outcome import RiskOutcome
from clearway.studies.risk.settings import RiskSettings


class RiskJournal:
    """A file of one JSON object a line: what the study is, then its outcomes in any order.

    A last line that was cut off is left out, and flown again. Raises InputError where the file is
    of another study, or damaged, or cannot be written.
    """

    def __init__(
        self,
        path: Path,
        model: EncounterModel,
        planners: Sequence[str],
        settings: RiskSettings,
        seed: int,
    ) -> None:
        self._path = path
        study = {
            "clearway": __version__,
            "model": sha256_of(Path(model.source)) or model.source,
            "planners": list(planners),
            "settings": asdict(settings),
            "seed": seed,
            "kept": [field.name for field in fields(Separation)],
        }
        # As JSON has it: tuples are lists there.
        self._study = json.loads(json.dumps(study))
        with growing_file(path), naming(path, "written"):
            self.outcomes: tuple[RiskOutcome, ...] = self._read()
        """What was flown before."""

    def add(self, outcomes: Sequence[RiskOutcome]) -> None:
        """Keep more outcomes."""
        with naming(self._path, "written"), self._path.open("a", encoding="utf-8") as file:
            for outcome in outcomes:
                file.write(json.dumps(asdict(outcome)) + "\n")

    def _read(self) -> tuple[RiskOutcome, ...]:
        if not self._path.exists() or not self._path.stat().st_size:
            self._path.write_text(json.dumps(self._study) + "\n", encoding="utf-8")
            return ()
        text = self._path.read_text(encoding="utf-8", errors="replace")
        whole, _, cut = text.rpartition("\n")
        if cut:
            self._path.write_text(whole + "\n" if whole else "", encoding="utf-8")
        lines = whole.splitlines()
        try:
            found = json.loads(lines[0]) if lines else None
        except ValueError:
            found = None
        if found != self._study:
            raise InputError(
                str(self._path),
                "is of another study, or none: its first line must hold the same version, model, "
                "planners, settings, seed and measures",
            )
        outcomes = []
        for number, line in enumerate(lines[1:], start=2):
            try:
                outcomes.append(_outcome(json.loads(line)))
            except (ValueError, TypeError, KeyError) as cause:
                raise InputError(str(self._path), f"line {number} is damaged") from cause
        return tuple({each.number: each for each in outcomes}.values())


def _outcome(values: dict[str, Any]) -> RiskOutcome:
    return RiskOutcome(
        number=int(values["number"]),
        weight=float(values["weight"]),
        layer=int(values["layer"]),
        straight=Separation(**values["straight"]),
        flown={name: Separation(**came) for name, came in values["flown"].items()},
        emergencies={name: int(count) for name, count in values["emergencies"].items()},
        decision_ms={name: float(took) for name, took in values.get("decision_ms", {}).items()},
    )
