"""Many flights: campaigns, encounters, risk, faults, the paper made again."""
