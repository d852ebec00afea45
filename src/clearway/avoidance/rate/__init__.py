"""Evidence to ratings of cells, nodes and trajectories, (4.17)-(4.23)."""
