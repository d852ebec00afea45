"""Damaged files of every format through the commands: `python -m tools.fuzz`, `make fuzz`."""
