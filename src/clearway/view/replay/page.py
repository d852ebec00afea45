"""The page that shows a run: one HTML text with style, script and data inside, and nothing else.

A content security policy lets the browser run this script alone and load nothing from anywhere.
"""

from __future__ import annotations

import base64
import hashlib
import html
import re
from importlib.resources import files

from clearway.view.replay.packing import pack
from clearway.view.replay.reading import Recording

SCRIPTS = (
    "matrices.js",
    "colours.js",
    "run.js",
    "meshes.js",
    "craft.js",
    "renderer.js",
    "camera.js",
    "speed.js",
    "scenery.js",
    "evidence.js",
    "ghost.js",
    "labels.js",
    "timeline.js",
    "terms.js",
    "panel.js",
    "plots.js",
    "picking.js",
    "picked.js",
    "address.js",
    "main.js",
)
"""Parts of the script, in the order in which they use each other."""


def page_of(recording: Recording, beside: Recording | None = None) -> str:
    """The whole page; beside: another run, drawn into the same world and the same plots."""
    script = "\n".join(_part(name) for name in SCRIPTS)
    style = _part("page.css")
    policy = (
        f"default-src 'none'; script-src {_source(script)}; style-src {_source(style)}; "
        "base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "title": html.escape(f"{recording.mission['name']} - clearway replay"),
        "style": style,
        "data": base64.b64encode(pack(recording)).decode(),
        "beside": "" if beside is None else base64.b64encode(pack(beside)).decode(),
        "script": script,
    }
    # All at once: a mission may be called as a place of the page is.
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], _part("page.html"))


def _part(name: str) -> str:
    return files("clearway.view.replay").joinpath("page", name).read_text(encoding="utf-8")


def _source(text: str) -> str:
    """The policy's name of an inline text: its hash."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
