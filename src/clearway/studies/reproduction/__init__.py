"""What the paper shows, made again: each figure and table with its claim, ours and the difference.

`registry.TARGETS` lists what can be reproduced. A new target is a function that returns exhibits,
in a file of its own, and a line in the registry.
"""

from clearway.studies.reproduction.target import Exhibit, Measure, Target

__all__ = ["Exhibit", "Measure", "Target"]
