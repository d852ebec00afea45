"""Numbers for JSON, which knows neither infinite nor undefined ones: null stands for them."""

from __future__ import annotations

import math


def finite(value: float) -> float | None:
    """The number as it is."""
    return value if math.isfinite(value) else None


def round_number(value: float, digits: int = 6) -> float | None:
    """The number to so many digits after the point."""
    return round(float(value), digits) if math.isfinite(value) else None
