"""clearway's own files: missions and scenes, the set-up of a flight, what a run leaves."""
