"""Risk: encounters drawn from an encounter model, flown with and without avoidance, weighed."""
