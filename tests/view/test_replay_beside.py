"""The page of a run in a browser, nightly: views, plots, the tube, the ground, two runs at once."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")

from tools.browser import Browser, chromium

from clearway.view.replay.page import page_of
from clearway.view.replay.reading import read_run
from clearway.view.replay.writing import write_mcap
from flown_missions import flown

pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """The flight of clearway with a tube about its plans and hills beneath it, and another one."""
    folder, short = tmp_path_factory.mktemp("runs"), flown()
    write_mcap(short.run, short.setup, "", folder / "a.mcap")
    write_mcap(short.setup.fly_with("potential-field"), short.setup, "", folder / "b.mcap")
    first = read_run(folder / "a.mcap")
    decisions = tuple(
        one | {"tube_m": np.linspace(0.0, 0.8, len(one["path_m"])).tolist()}
        for one in first.decisions
    )
    heights = [int(300.0 * np.sin(n)) - 600 for n in range(64)]
    terrain = {
        "corner_m": [-10, -15],
        "step_m": 5.0,
        "rows": 8,
        "columns": 8,
        "heights_cm": heights,
    }
    mission = first.mission | {"terrain": terrain}
    return replace(first, decisions=decisions, mission=mission), read_run(folder / "b.mcap")


@pytest.fixture(scope="module")
def address(recordings, tmp_path_factory):
    if chromium() is None:
        pytest.skip("no Chromium to look at the page with")
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(page_of(*recordings))
    return path.as_uri()


@pytest.fixture(scope="module")
def browser(address, tmp_path_factory):  # noqa: ARG001, without a page none is started
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


def at(browser, address, place):
    browser.open(f"{address}#{place}")
    assert browser.complaints() == []
    return browser.told()


def projected(browser, place):
    """Where a place of the world is on the canvas, as shares from -1 to 1."""
    x, y, _, w = browser.evaluate(
        "(() => { const { camera, canvas } = player;"
        "  const matrix = camera.projection(canvas.clientWidth / canvas.clientHeight);"
        f"  return transformed(matrix, {list(place)}); }})()"
    )
    return x / w, y / w


def test_from_the_top_nothing_leans_and_y_is_up(browser, address):
    at(browser, address, "t=6&view=top")
    x, y, z = browser.evaluate("player.run.stateAt(6).position")
    low, high = projected(browser, (x, y, z - 3)), projected(browser, (x, y, z + 3))
    assert np.abs(np.subtract(high, low)).max() < 0.01
    foot, ahead = projected(browser, (x, y, z)), projected(browser, (x, y + 2, z))
    assert abs(ahead[0] - foot[0]) < 1e-3
    assert ahead[1] > foot[1] + 0.02


def test_all_of_it_is_beside_the_cards(browser, address, recordings):
    at(browser, address, "t=0&view=all")
    share = (
        "document.getElementById('cards').getBoundingClientRect().right / player.canvas.clientWidth"
    )
    free_from = 2.0 * browser.evaluate(share) - 1.0
    for state in recordings[0].states[::100]:
        x, y = projected(browser, state["position_m"])
        assert min(free_from, -0.2) < x < 1.0
        assert abs(y) < 1.0


def test_plots_have_the_numbers_of_the_decision_under_the_pointer(browser, address, recordings):
    at(browser, address, "t=0&plots=1")
    left, top, width, height = browser.evaluate(
        "(({ left, top, width, height }) => [left, top, width, height])"
        "(document.getElementById('plots').getBoundingClientRect())"
    )
    assert height > 40
    line = browser.evaluate("document.getElementById('timeline').getBoundingClientRect().left")
    assert line == left
    x = left + 0.4 * width
    browser.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=top + 10)
    browser.wait("!document.getElementById('readout').hidden")
    first = recordings[0]
    time_s = first.states[0]["time_s"] + 0.4 * first.states[-1]["time_s"]
    made = [one for one in first.decisions if one["time_s"] <= time_s][-1]
    text = browser.evaluate("document.getElementById('readout').innerText")
    assert made["mode"] in text
    told = dict(browser.evaluate(f"player.plots.numbersAt({time_s})"))
    assert float(told["cost"].split()[0]) == pytest.approx(made["cost_m"], abs=0.06)
    assert float(told["decision time"].split()[0]) == pytest.approx(made["elapsed_ms"], rel=0.02)
    spoken = browser.evaluate("document.getElementById('timeline').getAttribute('aria-valuetext')")
    assert "cost" in spoken


def test_tube_and_ground_are_drawn(browser, address):
    at(browser, address, "t=6&view=all")
    with_all = browser.screenshot().astype(int)
    assert browser.evaluate("player.evidence.tube.count") > 100
    assert browser.evaluate("player.scenery.terrain.count") == 6 * 49
    browser.evaluate(
        "player.evidence.tube = null; player.scenery.terrain = null; player.stale = true"
    )
    browser.wait("!player.stale")
    assert (np.abs(browser.screenshot() - with_all).max(axis=2) > 16).mean() > 0.02


def test_two_runs_share_world_time_and_plots(browser, address, recordings):
    at(browser, address, "t=6")
    panel = browser.evaluate("document.getElementById('panel').innerText")
    assert "Beside: short <one>" in panel
    assert "potential-field" in panel
    own = next(one for one in recordings[1].states if one["time_s"] >= 6.0 - 1e-6)
    there = browser.evaluate("player.ghost.run.stateAt(player.ghost.timeAt(6)).position")
    np.testing.assert_allclose(there, own["position_m"], atol=0.05)
    browser.press("x")
    browser.wait("window.player?.run.mission.planner === 'potential-field' && player.ghost")
    browser.wait("document.documentElement.dataset.ready")
    assert "planner potential-field" in browser.evaluate(
        "document.getElementById('panel').innerText"
    )


@pytest.mark.parametrize("vehicle", ["plane", "copter"])
def test_vehicles_are_drawn_as_what_they_are(browser, recordings, tmp_path, vehicle):
    mission = recordings[0].mission | {"vehicle": vehicle}
    page = tmp_path / "page.html"
    page.write_text(page_of(replace(recordings[0], mission=mission)))
    at(browser, page.as_uri(), "t=6")
    # Four rotors have twice the corners of a fuselage with wings.
    corners = browser.evaluate("player.scenery.craft.count")
    assert (corners > 2500) == (vehicle == "copter")


def test_runs_of_before_are_shown_without_what_they_do_not_tell(browser, recordings, tmp_path):
    new = ("vehicle", "terrain", "origin_geodetic", "begins_unix_s")
    mission = {name: value for name, value in recordings[0].mission.items() if name not in new}
    sets = tuple(
        {name: value for name, value in one.items() if not name.startswith("movement")}
        for one in recordings[0].reach_sets
    )
    page = tmp_path / "page.html"
    page.write_text(page_of(replace(recordings[0], mission=mission, reach_sets=sets)))
    at(browser, page.as_uri(), "t=6&pick=trajectories")
    browser.press(".")
    browser.wait("document.documentElement.dataset.picked.startsWith('trajectory:')")
    assert "movements" in browser.evaluate("document.getElementById('picked').innerText")
