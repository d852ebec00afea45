"""Compiled code between runs: what it follows from, where it is kept, who is told."""
