"""What every decision of a flight is reported with: its mode, words, alarms, alerts."""
