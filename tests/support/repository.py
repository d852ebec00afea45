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

CHANGE_ELSEWHERE = (
    "avoidance/decide.py",
    "avoidance/plan/costs.py",
    "avoidance/plan/prepared.py",
    "live/guard/",
    "live/link/",
    "mavlink/",
    "studies/reliability/",
)
"""Sources whose names and words wait until the changes that are under way in them have come in."""
