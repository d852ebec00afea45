"""An autopilot on a MAVLink 2 link: what it tells becomes readings, decisions become set-points."""
