"""Encounters with one intruder: drawn, searched for what can be avoided, flown."""
