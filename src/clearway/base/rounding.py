"""What rounding may be off by, where something is passed over without being looked at."""

from __future__ import annotations

SURELY = 1.0 + 1e-9
"""Factor by which something must be farther, for all the rounding."""
