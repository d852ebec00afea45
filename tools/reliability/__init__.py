"""How far ratings can be believed: the table of the calibrated one, and docs/calibration.md."""
