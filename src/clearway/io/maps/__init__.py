"""Obstacle maps, buildings, zones and terrain, one format a file."""
