"""The decision cycle: situation, hazards, evidence, fusion, costs, rules, verification, choice."""
