"""Unit factors for the edges: multiply a value in the named unit to get SI; inside is SI only."""

from __future__ import annotations

FOOT_M = 0.3048
"""International foot."""
US_SURVEY_FOOT_M = 1200.0 / 3937.0
NAUTICAL_MILE_M = 1852.0
KNOT_MPS = NAUTICAL_MILE_M / 3600.0
FOOT_PER_MINUTE_MPS = FOOT_M / 60.0
FASTEST_MPS = 1e3
"""Nothing that flies by a grid is faster."""
