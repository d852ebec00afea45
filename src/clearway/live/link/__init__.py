"""One session, several links: what any link to a vehicle needs to know, and none does by itself."""
