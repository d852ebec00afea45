"""The guardian beside other safety filters: `python -m benchmarks.filters`."""
