"""What beams pass and what stops them: remembered points, bodies, least widths."""
