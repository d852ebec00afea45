"""What a reproduction consists of: measures in exhibits, exhibits in targets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw = Callable[[], "Figure"]
"""Draws one exhibit; nothing of matplotlib is imported before it is called."""

Source = Literal["paper", "reference"]
"""Who says what a measure should be: the paper, or an independent implementation."""


@dataclass(frozen=True, slots=True)
class Measure:
    """One number of an exhibit, beside what is known of it."""

    name: str
    """With its unit, if it has one."""
    ours: float
    expected: float | None = None
    """None where nobody else says."""
    source: Source = "reference"
    tolerance: float = 0.0
    """Up to which difference the two agree."""

    @property
    def difference(self) -> float | None:
        """Ours less the expected."""
        return None if self.expected is None else self.ours - self.expected

    @property
    def agrees(self) -> bool | None:
        return None if self.difference is None else bool(abs(self.difference) <= self.tolerance)


@dataclass(frozen=True, slots=True)
class Findings:
    """What is claimed and what is found."""

    claim: str
    """What the paper says that its figure or table shows."""
    ours: str
    """What it shows here."""
    difference: str
    """Where ours is not as the paper says, and why; empty where it is."""
    measures: tuple[Measure, ...] = ()


@dataclass(frozen=True, slots=True)
class Exhibit:
    """One figure or table of the paper, made again."""

    label: str
    """As the paper numbers it, such as "Figure 6.2"."""
    title: str
    findings: Findings
    draw: Draw | None = None

    @property
    def picture(self) -> str | None:
        """Name of the picture's file."""
        return None if self.draw is None else f"{self.label.lower().replace(' ', '-')}.png"


@dataclass(frozen=True, slots=True)
class Target:
    """Something to reproduce, by name."""

    name: str
    title: str
    make: Callable[[], tuple[Exhibit, ...]]
    """Computes everything but the pictures."""
