"""What everybody uses: errors, units, frames, frozen values, the polar grid, intervals."""
