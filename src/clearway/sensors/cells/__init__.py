"""What scans say of every cell: hits, hindrance, visibility, inflation, spaces."""
