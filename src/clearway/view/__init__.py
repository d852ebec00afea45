"""Finished results to look at: pictures, and the replay in the browser."""
