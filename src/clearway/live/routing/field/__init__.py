"""Cells about the vehicle, the clearance in them, and the march of time over them."""
