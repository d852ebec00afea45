"""Several sensors: what they say as one, and who is believed where they contradict each other."""
