"""Intersection models of chapter 5.1: what an intruder means for every cell."""
