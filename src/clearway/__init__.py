"""clearway: detect and avoid for unmanned aircraft."""

__version__ = "0.1.0"
