"""What clearway's speed and flights are held against; `python -m benchmarks` prints one table."""

from __future__ import annotations

import os

# Before anything imports NumPy: every figure is for one thread.
for _library in ("OPENBLAS", "OMP", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
