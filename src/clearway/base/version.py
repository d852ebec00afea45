"""The versions of the package and of what it writes, in one place."""

__version__ = "0.3.0.dev0"

SCHEMA_VERSION = 3
"""Of JSON results and run files, told in each as `schema_version`: grows where a key changes its
meaning or goes away."""
