"""The search for an escape: a beginning, then a loop or a stop that keeps clear of all known."""
