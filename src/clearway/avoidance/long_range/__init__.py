"""Kilometres and minutes: which courses, speeds and climbs keep out of whose volumes."""
