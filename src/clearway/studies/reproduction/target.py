"""What a reproduction consists of: measures in exhibits, exhibits in targets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw = Callable[[], "Figure"]
"""Draws one exhibit; nothing of matplotlib is imported before it is called."""

ROUNDING = 1e-12
"""Share of a number up to which a difference is rounding."""

NO_DIFFERENCE = "None."
"""Said only where every number is equal to what is expected of it."""

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
    """Up to which difference the two agree; stated beside it, so that it can be judged."""

    @property
    def difference(self) -> float | None:
        """Ours less the expected."""
        return None if self.expected is None else self.ours - self.expected

    @property
    def equal(self) -> bool | None:
        """Whether there is no difference but that of rounding."""
        if self.expected is None or self.difference is None:
            return None
        return bool(abs(self.difference) <= ROUNDING * max(1.0, abs(self.expected)))

    @property
    def agrees(self) -> bool | None:
        if self.difference is None:
            return None
        return bool(self.equal) or bool(abs(self.difference) <= self.tolerance)


@dataclass(frozen=True, slots=True)
class Findings:
    """What is claimed and what is found."""

    claim: str
    """What the paper says that its figure or table shows."""
    ours: str
    """What it shows here."""
    difference: str
    """Where ours is not as the paper says, and why; empty where the numbers say it all."""
    measures: tuple[Measure, ...] = ()

    @property
    def compared(self) -> tuple[Measure, ...]:
        """Measures for which somebody else has a number."""
        return tuple(measure for measure in self.measures if measure.expected is not None)

    @property
    def difference_told(self) -> str:
        """The difference in words, with what the numbers show: "none" only where there is none."""
        within = [measure for measure in self.compared if measure.agrees and not measure.equal]
        beyond = [measure for measure in self.compared if not measure.agrees]
        told = [self.difference] if self.difference else []
        if beyond and not self.difference:
            told.append(f"Beyond tolerance: {_numbers(beyond)}.")
        if within and not self.difference:
            told.append(f"Within tolerance: {_numbers(within)}.")
        if not self.compared and not self.difference:
            told.append("Not measured: nobody gives a number for it.")
        return " ".join(told) or NO_DIFFERENCE


def _numbers(measures: list[Measure]) -> str:
    return ", ".join(
        f"{measure.name} {difference_words(measure)} (tolerance {measure.tolerance:g})"
        for measure in measures
    )


def difference_words(measure: Measure) -> str:
    """The difference of a measure: "none", below what the tolerance resolves, or its size.

    What lies a hundred times within the tolerance is not told by its digits, which vary between
    machines. Empty where nobody else has a number.
    """
    if measure.difference is None:
        return ""
    if measure.equal:
        return "none"
    if abs(measure.difference) <= 0.01 * measure.tolerance:
        return f"below {0.01 * measure.tolerance:.0e}"
    return f"{measure.difference:+.{2 if measure.agrees else 4}g}"


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
