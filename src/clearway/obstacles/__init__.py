"""What stands there: obstacles and their geometry, the map, shares in cells, true worlds."""
