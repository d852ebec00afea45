"""The error of a build that cannot go on."""

from __future__ import annotations


class BuildError(Exception):
    """What is wrong and what to type, as text for whoever builds; shown without a traceback."""
