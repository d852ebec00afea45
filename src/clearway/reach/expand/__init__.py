"""From movements to a tree: the lattice of attitudes, cells passed, and wave-front expansion."""
