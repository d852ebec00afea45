"""How far ratings can be believed: what they said at decisions, and what was truly there."""
