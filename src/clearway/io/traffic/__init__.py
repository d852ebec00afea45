"""Reports of traffic, one format a file."""
