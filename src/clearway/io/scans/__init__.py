"""Scans and recordings of scans, one format a file."""
