"""Made-up worlds of the kinds that other projects measure their planners in, each from a seed."""
