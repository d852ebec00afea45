"""PX4 as an autopilot that clearway flies as one of its modes."""
