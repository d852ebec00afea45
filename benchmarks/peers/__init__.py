"""Other people's conflict resolution on the same encounters, each in an environment of its own."""
