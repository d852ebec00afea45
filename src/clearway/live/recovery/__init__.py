"""What is flown where flying on brings no progress."""
