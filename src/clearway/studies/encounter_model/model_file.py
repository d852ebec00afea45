"""Encounter models from their ASCII files (MIT Lincoln Laboratory, ATC-345).

A file is sections under `# name` lines. Counts of a node are stored column by column, a column per
configuration of its parents, of which the first one varies fastest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from clearway.base.errors import InputError, naming
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.studies.encounter_model.conventions import (
    ACROSS,
    ALWAYS,
    choose_conventions,
    missing_labels,
)
from clearway.studies.encounter_model.network import EncounterModel, Node, Variable

SECTIONS = (
    "labels_initial",
    "G_initial",
    "r_initial",
    "N_initial",
    "labels_transition",
    "G_transition",
    "r_transition",
    "N_transition",
    "boundaries",
    "resample_rates",
)
MOST_BYTES = 100_000_000
"""Larger files are no encounter models."""
AT_ONCE = "(t)"
A_SECOND_ON = "(t+1)"
"""Endings of labels of the transition network."""
NUMBERS = (*ALWAYS, *ACROSS)
"""Variables that are no categories."""


def read_encounter_model(path: str | Path) -> EncounterModel:
    """Read a model file; raises InputError with all that is wrong, by section and line."""
    source = Path(path)
    try:
        with naming(path, "read"):
            if source.stat().st_size > MOST_BYTES:
                raise InputError(str(path), f"larger than {MOST_BYTES:,} bytes: no encounter model")
            text = source.read_text(encoding="utf-8")
    except UnicodeDecodeError as cause:
        raise InputError(str(path), "is not a text file") from cause
    return parse_encounter_model(text, str(path))


def parse_encounter_model(text: str, source: str = "encounter model") -> EncounterModel:
    """A model from its text; raises InputError with all that is wrong, by section and line."""
    reader = _Reader(text)
    model = reader.model(source)
    if model is None or reader.problems:
        raise InputError(source, reader.problems)
    return model


class _Reader:
    """The sections of one file, and what is wrong with them."""

    def __init__(self, text: str) -> None:
        self.problems: list[str] = []
        self.sections: dict[str, list[tuple[int, str]]] = {}
        current: list[tuple[int, str]] | None = None
        for number, line in enumerate(text.splitlines(), start=1):
            stripped = line.strip()
            if stripped.startswith("#"):
                name = stripped[1:].strip()
                if name in self.sections:
                    self.problems.append(f"line {number}: section {name} for the second time")
                elif name not in SECTIONS:
                    self.problems.append(
                        f"line {number}: unknown section {name!r}; there are {', '.join(SECTIONS)}"
                    )
                current = self.sections.setdefault(name, [])
            elif stripped and current is None:
                self.problems.append(f"line {number}: text before the first section")
            elif stripped and current is not None:
                current.append((number, stripped))
        for name in SECTIONS:
            if not self.sections.get(name):
                self.problems.append(f"section {name}: is missing or empty")

    def model(self, source: str) -> EncounterModel | None:
        """The model, or None with problems noted."""
        if self.problems:
            return None
        labels, later = self._labels("labels_initial"), self._labels("labels_transition")
        static = self._numbers("r_initial", len(labels), whole=True)
        moving = self._numbers("r_transition", len(later), whole=True)
        rates = self._rates(len(labels))
        edges = self._edges(labels, static)
        following = self._following(labels, later)
        if self.problems:
            return None
        sizes, sizes_later = [int(v) for v in static], [int(v) for v in moving]
        self._same_sizes(labels, later, sizes, sizes_later, following)
        graph, graph_later = self._graph("G_initial", labels), self._graph("G_transition", later)
        if self.problems:
            return None
        order = self._order("G_initial", labels, graph)
        order_later = self._order("G_transition", later, graph_later)
        nodes = self._nodes("N_initial", graph, sizes, range(len(labels)))
        steps = self._nodes("N_transition", graph_later, sizes_later, sorted(following))
        if self.problems:
            return None
        convention = choose_conventions(labels)
        variables = tuple(
            Variable(convention.renamed.get(name, name), size, edge, float(rate))
            for name, size, edge, rate in zip(labels, sizes, edges, rates, strict=True)
        )
        transition = {following[i]: steps[i].follow(following) for i in order_later if i in steps}
        initial = tuple(nodes[i] for i in range(len(labels)))
        return EncounterModel(source, variables, initial, order, transition, convention.climb_mps)

    def _labels(self, section: str) -> list[str]:
        number, line = self.sections[section][0]
        labels = [part.strip().strip('"') for part in line.split(",")]
        if not all(labels) or len(set(labels)) < len(labels):
            self.problems.append(f"section {section}, line {number}: names must differ, none empty")
        missing = missing_labels(labels)
        if section == "labels_initial" and missing:
            self.problems.append(f"section {section}, line {number}: lacks {', '.join(missing)}")
        return labels

    def _floats(self, section: str, number: int, line: str) -> list[float]:
        values = []
        for column, part in enumerate(line.split(), start=1):
            try:
                value = float(part)
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                self.problems.append(
                    f"section {section}, line {number}: value {column} is {part[:20]!r}, no number"
                )
                return []
            values.append(value)
        return values

    def _numbers(self, section: str, count: int, *, whole: bool = False) -> list[float]:
        """`count` numbers of a section's first line; with `whole`, counts from 1."""
        number, line = self.sections[section][0]
        values = self._floats(section, number, line)
        where = f"section {section}, line {number}"
        if values and len(values) != count:
            self.problems.append(f"{where}: {count} numbers are needed, got {len(values)}")
        elif whole and any(value < 1 or value != int(value) for value in values):
            self.problems.append(f"{where}: whole numbers from 1 are needed")
        return values

    def _rates(self, count: int) -> list[float]:
        rates = self._numbers("resample_rates", count)
        if any(not 0.0 <= rate <= 1.0 for rate in rates):
            number = self.sections["resample_rates"][0][0]
            self.problems.append(f"section resample_rates, line {number}: not within [0, 1]")
        return rates

    def _edges(self, labels: Sequence[str], sizes: Sequence[float]) -> list[FloatArray | None]:
        """Per variable its edges, None for `*`."""
        lines = self.sections["boundaries"]
        if len(lines) != len(labels):
            self.problems.append(
                f"section boundaries: {len(labels)} lines are needed, got {len(lines)}"
            )
            return []
        edges: list[FloatArray | None] = []
        for (number, line), label, size in zip(lines, labels, sizes, strict=False):
            if line == "*":
                if label in NUMBERS:
                    self.problems.append(
                        f"section boundaries, line {number}: {label} needs numbers, not *"
                    )
                edges.append(None)
                continue
            values = np.array(self._floats("boundaries", number, line))
            if len(values) != size + 1 or np.any(np.diff(values) <= 0.0):
                self.problems.append(
                    f"section boundaries, line {number}: {label} needs {size + 1:g} ascending "
                    f"numbers for {size:g} bins, got {len(values)}"
                )
            edges.append(values)
        return edges

    def _following(self, labels: Sequence[str], later: Sequence[str]) -> dict[int, int]:
        """Index in the transition network -> variable that it is a second on."""
        now = [name.removesuffix(AT_ONCE) for name in later[: len(labels)]]
        number = self.sections["labels_transition"][0][0]
        where = f"section labels_transition, line {number}"
        if now != list(labels):
            self.problems.append(f"{where}: must begin with the initial labels, {AT_ONCE} or not")
        following: dict[int, int] = {}
        for index, name in enumerate(later[len(labels) :], start=len(labels)):
            stem = name.removesuffix(A_SECOND_ON)
            if not name.endswith(A_SECOND_ON) or stem not in labels:
                self.problems.append(f"{where}: {name!r} is no variable followed by {A_SECOND_ON}")
            else:
                following[index] = labels.index(stem)
        return following

    def _same_sizes(
        self,
        labels: Sequence[str],
        later: Sequence[str],
        sizes: Sequence[int],
        sizes_later: Sequence[int],
        following: Mapping[int, int],
    ) -> None:
        wanted = [*sizes, *(sizes[following[i]] for i in range(len(labels), len(later)))]
        for name, size, needed in zip(later, sizes_later, wanted, strict=True):
            if size != needed:
                self.problems.append(f"section r_transition: {name} has {size} bins, not {needed}")

    def _graph(self, section: str, labels: Sequence[str]) -> IntArray:
        """[n, n] 1 where the row is a parent of the column."""
        lines, count = self.sections[section], len(labels)
        if len(lines) != count:
            self.problems.append(f"section {section}: {count} lines are needed, got {len(lines)}")
            return np.zeros((0, 0), dtype=np.int64)
        rows = []
        for number, line in lines:
            row = self._floats(section, number, line)
            if len(row) != count or not set(row) <= {0.0, 1.0}:
                self.problems.append(
                    f"section {section}, line {number}: {count} numbers 0 or 1 are needed"
                )
                row = [0.0] * count
            rows.append(row)
        return np.array(rows, dtype=np.int64)

    def _order(self, section: str, labels: Sequence[str], graph: IntArray) -> tuple[int, ...]:
        """Variables, parents first."""
        order: list[int] = []
        while len(order) < len(labels):
            ready = [
                i
                for i in range(len(labels))
                if i not in order and set(np.flatnonzero(graph[:, i])) <= set(order)
            ]
            if not ready:
                left = ", ".join(name for i, name in enumerate(labels) if i not in order)
                self.problems.append(f"section {section}: {left} depend on each other in a circle")
                break
            order += ready
        return tuple(order)

    def _nodes(
        self, section: str, graph: IntArray, sizes: Sequence[int], members: Sequence[int]
    ) -> dict[int, Node]:
        """Nodes by index, their counts taken from the section's one line in order."""
        number, line = self.sections[section][0]
        counts = np.array(self._floats(section, number, line))
        parents = {i: tuple(int(p) for p in np.flatnonzero(graph[:, i])) for i in members}
        needed = sum(sizes[i] * math.prod(sizes[p] for p in parents[i]) for i in members)
        if len(counts) != needed:
            self.problems.append(
                f"section {section}, line {number}: {needed} counts are needed, got {len(counts)}"
            )
            return {}
        if np.any(counts < 0.0):
            self.problems.append(f"section {section}, line {number}: counts must be >= 0")
        nodes, at = {}, 0
        for i in members:
            widths = tuple(sizes[p] for p in parents[i])
            length = sizes[i] * math.prod(widths)
            table = counts[at : at + length].reshape(-1, sizes[i])
            if section == "N_initial" and not parents[i] and not table.any():
                self.problems.append(f"section {section}: nothing was counted for variable {i + 1}")
            nodes[i] = Node(parents[i], widths, table)
            at += length
        return nodes


def make_up_model() -> EncounterModel:
    """A small model of light aircraft with made-up numbers, for trying things out without data."""
    return read_encounter_model(Path(__file__).parent / "made-up.txt")
