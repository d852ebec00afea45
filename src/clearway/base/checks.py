"""Range checks of what comes in: each says in a line what is wrong, or nothing.

What is not a number, not finite or out of range never gets past the edge: a margin that is not a
number would be kept by every trajectory.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import fields
from functools import cache
from typing import Any, TypeGuard, TypeVar

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import FloatArray
from clearway.base.errors import ClearwayError

Kind = TypeVar("Kind")

LARGEST = 1e9
"""Nothing that is stated in metres, metres a second or radians is larger."""
LATEST_S = 1e11
"""No time is farther from its epoch: seconds since 1970 fit, milliseconds do not."""
HIGHEST_M = 1e5
"""No place on Earth is farther above or below the sea."""
SHOWN = 60
"""Characters of a refused value that a message repeats."""


def fits_float(value: Any) -> bool:
    """Whether a value is one real number that a float can hold; NaN and infinity are."""
    if not isinstance(value, (int, float, np.number, np.ndarray)) or np.ndim(value):
        return False
    try:
        float(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return not np.iscomplexobj(value)


def number_problem(name: str, value: Any, low: float = 0.0, high: float = LARGEST) -> str | None:
    """What keeps a value from being a number within [low, high]; NaN is within nothing."""
    try:
        if low <= value <= high and (isinstance(value, float) or fits_float(value)):
            return None
    except (TypeError, ValueError, OverflowError):
        pass
    return f"{name}: must be a number from {low:g} to {high:g}, got {_show(value)}"


def above_zero_problem(name: str, value: Any, high: float = LARGEST) -> str | None:
    """What keeps a value from being a number above 0."""
    problem = number_problem(name, value, 0.0, high)
    return problem or (f"{name}: must be above 0, got {_show(value)}" if value == 0.0 else None)


def time_problem(name: str, value: Any) -> str | None:
    """What keeps a value from being a time in seconds."""
    return number_problem(name, value, -LATEST_S, LATEST_S)


def geodetic_problem(latitude_deg: float, longitude_deg: float, height_m: float) -> str | None:
    """What keeps numbers from being a place on Earth."""
    if abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0 and abs(height_m) <= HIGHEST_M:
        return None
    return (
        f"{[latitude_deg, longitude_deg, height_m]} is no place; valid: latitude within +-90 "
        f"degrees, longitude within +-180 degrees, height within +-{HIGHEST_M:,.0f} m"
    )


def vector_problem(name: str, values: Any, length: int, largest: float = LARGEST) -> str | None:
    """What keeps values from being `length` finite numbers, none larger than `largest`."""
    try:
        array = np.asarray(values, dtype=np.float64)
        numbers = array.tolist()
        # Lists of three are checked faster without NumPy, and every decision checks many.
        if array.shape == (length,) and all(abs(number) <= largest for number in numbers):
            return None
    except (TypeError, ValueError, OverflowError):
        pass
    finite = f"{length} finite numbers, at most {largest:g}, are needed"
    return f"{name}: {finite}, got {_show(values)}"


def choice_problem(name: str, value: Any, choices: Collection[str]) -> str | None:
    """What keeps a value from being one of the choices."""
    if isinstance(value, str) and value in choices:
        return None
    return f"{name}: {_show(value)} is none of {', '.join(choices)}"


def shape_of(values: Any) -> tuple[int, ...]:
    """The shape of an array or of nested sequences; of ragged ones that of the outermost."""
    try:
        return np.shape(values)
    except ValueError:
        return (len(values),)


def check_floats(name: str, values: Any) -> FloatArray:
    """Numbers of any shape as float64; raises ClearwayError for what are none."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as cause:
        raise ClearwayError(f"{name}: numbers are needed, got {_show(values)}") from cause


def span_problem(name: str, values: Any) -> str | None:
    """What keeps values from being two heights, the lower one first."""
    problem = vector_problem(name, values, 2)
    if problem is None and not values[0] < values[1]:
        problem = f"{name}: the lower height comes first, got {_show(values)}"
    return problem


def array_problem(
    name: str,
    values: npt.NDArray[Any],
    shape: tuple[int | None, ...],
    low: float = -LARGEST,
    high: float = LARGEST,
) -> str | None:
    """What keeps an array from having a shape (None: any length) and numbers within [low, high]."""
    wanted = [length if length is not None else "n" for length in shape]
    found = getattr(values, "shape", None)
    fits = found is not None and len(found) == len(shape)
    if not fits or any(
        asked not in (None, length) for asked, length in zip(shape, found or (), strict=True)
    ):
        return f"{name}: must have shape {wanted}, got {_show(found)}"
    try:
        # The extremes of an array with NaN are NaN, which is within nothing.
        if not values.size or (low <= values.min() and values.max() <= high):
            return None
    except (TypeError, ValueError):
        pass
    return f"{name}: must hold numbers from {low:g} to {high:g} only"


def are_points(values: Any) -> TypeGuard[FloatArray]:
    """Whether an array is places [n, 3] as it stands: of its shape, with nothing to convert."""
    plainly = type(values) is np.ndarray and values.dtype == np.float64
    return plainly and values.ndim == 2 and values.shape[1] == 3


def check_points(name: str, values: Any) -> FloatArray:
    """Places [n, 3] of one [3] or several; masked ones are NaN. Raises ClearwayError for any other
    shape, which laid out anew would be other places, and for what are no numbers."""
    if are_points(values):
        return np.array(values)
    try:
        points = np.array(np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan))
    except (TypeError, ValueError, OverflowError) as cause:
        raise ClearwayError(f"{name}: places [n, 3] are needed, got {_show(values)}") from cause
    if not points.size and points.shape in ((0,), (0, 3)):
        return np.zeros((0, 3))
    if points.shape == (3,):
        return points[None]
    if points.ndim != 2 or points.shape[1] != 3:
        raise ClearwayError(f"{name}: must have shape [n, 3], got {list(points.shape)}")
    return points


def take_floats(made: object, kind: type) -> None:
    """Make floats of what a frozen dataclass says are such, in what is one and has been checked.

    Numbers of 4 bytes would be added with their own roundings, whole ones divided as such.
    """
    for name in _floats_of(kind):
        number = getattr(made, name)
        if type(number) is not float and number is not None:
            object.__setattr__(made, name, float(number))


@cache
def _floats_of(kind: Any) -> tuple[str, ...]:
    return tuple(one.name for one in fields(kind) if one.type in ("float", "float | None"))


def kind_of(name: str, value: Any, kind: type[Kind]) -> Kind:
    """The value; raises ClearwayError where it is of another type."""
    if not isinstance(value, kind):
        raise ClearwayError(f"{name}: takes {_article(kind)}, got {type(value).__name__}")
    return value


def _article(kind: type) -> str:
    return f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"


def collect_problems(problems: Iterable[str | None]) -> list[str]:
    """The problems among the outcomes of checks."""
    return [problem for problem in problems if problem is not None]


def positive(name: str, value: float) -> float:
    """The value; raises ClearwayError for what is no finite number above 0."""
    if not (fits_float(value) and 0.0 < value < np.inf):
        raise ClearwayError(f"{name}: must be a finite number above 0, got {_show(value)}")
    return value


def _show(value: Any) -> str:
    text = repr(value.tolist() if isinstance(value, np.ndarray) and value.size < 10 else value)
    return text if len(text) <= SHOWN else text[:SHOWN] + "..."
