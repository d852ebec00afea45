"""What is reported of another aircraft: how far, how well, how late, and how often."""

from clearway.traffic.surveillance.heard import HeardOf, Watch
from clearway.traffic.surveillance.quality import SURVEILLANCES, Surveillance

__all__ = ["SURVEILLANCES", "HeardOf", "Surveillance", "Watch"]
