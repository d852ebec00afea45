"""Flight plans of ground stations."""
