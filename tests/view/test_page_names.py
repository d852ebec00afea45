"""The page of a run whose mission is called as parts of the page are."""

import base64
import html
import re
from dataclasses import replace

import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")

from clearway.view.replay.packing import pack
from clearway.view.replay.page import page_of
from clearway.view.replay.reading import read_run
from clearway.view.replay.writing import write_mcap
from flown_missions import flown


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    write_mcap(flown().run, flown().setup, "", path)
    return read_run(path)


@pytest.mark.parametrize(
    "name",
    ["{{data}}", "{{script}}{{policy}}", "{{no such}}", "{{title}}", "</title><script>alert(1)",
     "</script><!--", "\\1 \\g<0>", '"; default-src *'],
)  # fmt: skip
def test_a_mission_may_be_called_anything(recording, name):
    called = replace(recording, mission={**recording.mission, "name": name})
    page = page_of(called)
    title = html.escape(f"{name} - clearway replay")
    assert re.findall(r"<title>(.*?)</title>", page) == [title]
    (data,) = re.findall(r'id="run">(.*?)</script>', page)
    assert base64.b64decode(data, validate=True) == pack(called)
    plain = page_of(recording)
    (before,) = re.findall(r'id="run">(.*?)</script>', plain)
    was = html.escape(f"{recording.mission['name']} - clearway replay")
    assert page.replace(data, "").replace(title, "") == plain.replace(before, "").replace(was, "")
