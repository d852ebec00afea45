"""Where the vehicle was: pose tracks, one format a file."""
