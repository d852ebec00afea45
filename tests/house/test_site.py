"""The site has every page; every dependency has a licence; addresses are filled in in one place."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import quote, unquote

import pytest
from tools.addresses import filled_in
from tools.browser import Browser, chromium
from tools.transcripts import without_times

from repository import REPOSITORY

DOCS = REPOSITORY / "docs"
ADDRESSES = "pyproject.toml"
"""Where an owner fills in the project's addresses; `make addresses` takes them on."""
SEARCHED = {
    "escape": "safety.html",
    "guarantee": "safety.html",
    "copter": "tutorials/own-drone.html",
    "inflation": "concepts.html",
    "glossary": "concepts.html",
    "PX4": "px4.html",
    "ArduPilot": "tutorials/live.html",
    "install": "install.html",
}
"""What strangers search for, and the page that answers it."""


def test_every_page_is_in_the_navigation_and_there() -> None:
    listed = re.findall(r"^ +- [^:\n]+: (\S+\.md)$", (REPOSITORY / "mkdocs.yml").read_text(), re.M)
    pages = {page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")}
    assert set(listed) == pages
    assert len(listed) == len(set(listed))


def test_every_dependency_has_its_licence_told() -> None:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"].values()
    named = [*project["dependencies"], *(one for extra in extras for one in extra)]
    wanted = {re.split(r"[^\w.-]", one, maxsplit=1)[0].lower() for one in named}
    rows = re.findall(
        r"^\| ([\w.-]+) \| [^|]+ \| ([^|]+) \|", (DOCS / "licences.md").read_text(), re.M
    )
    told = dict(rows[1:])
    assert set(told) - {"---"} == wanted, "run python -m tools.licences --write"
    assert [name for name, licence in told.items() if "GNU General Public" in licence] == []


def test_addresses_are_those_of_one_file() -> None:
    texts = filled_in()
    there = {name: (REPOSITORY / name).read_text(encoding="utf-8") for name in texts}
    assert there == texts, "run make addresses"


def test_an_owner_fills_addresses_in_once(tmp_path: Path) -> None:
    project = tomllib.loads((REPOSITORY / ADDRESSES).read_text())["project"]
    for name in (ADDRESSES, *filled_in()):
        text = (REPOSITORY / name).read_text(encoding="utf-8")
        if name == ADDRESSES:
            for which, address in project["urls"].items():
                text = text.replace(address, f"https://{which.lower()}.owner.example/here")
        (tmp_path / name).write_text(text)
    written = filled_in(tmp_path)
    assert "git clone https://repository.owner.example/here clearway\n" in written["README.md"]
    told = "\n".join(written.values())
    assert [one for one in project["urls"].values() if one in told] == []


def test_addresses_stand_where_they_are_taken_to() -> None:
    tracked = subprocess.run(
        ["git", "ls-files"], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    if tracked.returncode:
        pytest.skip("no checkout")
    files = [REPOSITORY / name for name in tracked.stdout.splitlines()]
    urls = tomllib.loads((REPOSITORY / ADDRESSES).read_text())["project"]["urls"]
    found = {
        path.relative_to(REPOSITORY).as_posix()
        for path in files
        if path.suffix in (".md", ".py", ".toml", ".yml", ".cff")
        and path.is_file()
        and any(address in path.read_text(encoding="utf-8") for address in urls.values())
    }
    assert found == {ADDRESSES, *filled_in()}


def test_the_clone_lines_of_the_readme_bring_a_checkout(tmp_path: Path) -> None:
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    block = next(
        one for one in re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S) if "git clone" in one
    )
    clone, enter, *targets = [line.split("#")[0].split() for line in block.splitlines()]
    address = tomllib.loads((REPOSITORY / ADDRESSES).read_text())["project"]["urls"]["Repository"]
    words = [str(REPOSITORY) if word == address else word for word in clone]
    done = subprocess.run([*words[:2], "--depth=1", *words[2:]], cwd=tmp_path, capture_output=True)
    if done.returncode and not (REPOSITORY / ".git").exists():
        pytest.skip("no checkout")
    assert done.returncode == 0, done.stderr
    assert enter[0] == "cd"
    made = [words for words in targets if words[0] == "make"]
    assert len(made) == 2
    for words in made:
        subprocess.run([words[0], "-n", *words[1:]], cwd=tmp_path / enter[1], check=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built strictly."""
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("built") / "site"
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.mark.nightly
def test_the_site_builds_without_a_warning(site: Path) -> None:
    assert (site / "tutorials" / "own-scan.html").is_file()
    assert broken_links(site) == []


@pytest.mark.nightly
def test_a_search_finds_the_right_page_first(site: Path, tmp_path: Path) -> None:
    if chromium() is None:
        pytest.skip("no Chromium")
    found = {}
    with served(site) as address, Browser(tmp_path / "profile") as browser:
        for words in SEARCHED:
            browser.send("Page.navigate", url="about:blank")
            browser.send("Page.navigate", url=f"{address}/index.html?q={quote(words)}")
            first = browser.wait("document.querySelector('.md-search-result__item > a')?.href")
            found[words] = first.partition("?")[0].removeprefix(f"{address}/")
    assert found == SEARCHED


@pytest.mark.nightly
def test_results_are_out_of_the_search(site: Path) -> None:
    index = json.loads((site / "search" / "search_index.json").read_text())
    found = {one["location"] for one in index["docs"]}
    assert "safety.html" in found
    assert [one for one in found if one.startswith("results/")] == []


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a folder, served on this machine alone."""
    handler = partial(QuietHandler, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class QuietHandler(SimpleHTTPRequestHandler):
    """Serve files without a line for each."""

    def log_message(self, *_: object) -> None:
        """Print nothing."""


def broken_links(site: Path) -> list[str]:
    """Links within a site that lead to no page, or to no place of one."""
    pages = {page: page.read_text() for page in site.rglob("*.html") if page.name != "404.html"}
    places = {
        page: set(re.findall(r' (?:id|name)="([^"]+)"', text)) for page, text in pages.items()
    }
    broken = []
    for page, text in pages.items():
        for link in re.findall(r' (?:href|src)="([^"]+)"', text):
            target, _, place = html.unescape(link).partition("#")
            if re.match(r"[a-z]+:|//", target):
                continue
            there = (page.parent / unquote(target.split("?")[0])).resolve() if target else page
            there = there / "index.html" if there.is_dir() else there
            if not there.exists() or (place and place not in places.get(there, {place})):
                broken.append(f"{page.relative_to(site)}: {link}")
    return broken


def test_transcripts_have_no_times_of_computing() -> None:
    table = "  planner   reached   p50 ms  p99 ms\n\n  x   1/1   7.44   20.06\n"
    told = without_times(table.replace("\n\n", "\n") + "\nnearest 1.20 2.30\n")
    assert told.splitlines()[1].split() == ["x", "1/1", "...", "..."]
    assert told.splitlines()[-1] == "nearest 1.20 2.30"
