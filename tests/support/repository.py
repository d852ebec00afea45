"""Where the checkout lies, and which of its pages are made."""

from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]

GENERATED_PAGES = frozenset(
    (
        "api.md",
        "changelog.md",
        "equations.md",
        "licences.md",
        "missions.md",
        "reproduction.md",
    )
)
"""Pages of docs that a command or the code itself makes; each has a test of its own."""
