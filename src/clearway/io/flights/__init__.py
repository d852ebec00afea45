"""Logs of flights as one value: the way flown, what sensors showed, what the log states."""
