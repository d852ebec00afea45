"""The page of a run in a real browser: drawn, moved through time, recoloured, without requests."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")

from benchmarks.replay import flown as ten_minutes_flown
from tools.browser import WINDOW, Browser, chromium

from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.view.replay.page import page_of
from clearway.view.replay.reading import read_run
from clearway.view.replay.writing import write_mcap
from flown_missions import flown


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    write_mcap(flown().run, flown().setup, "", path)
    return read_run(path)


@pytest.fixture(scope="module")
def address(recording, tmp_path_factory):
    if chromium() is None:
        pytest.skip("no Chromium to look at the page with")
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(page_of(recording))
    return path.as_uri()


@pytest.fixture(scope="module")
def browser(address, tmp_path_factory):  # noqa: ARG001, without a page none is started
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


def scenes_of(browser):
    """What is on the screen, and how much differs from it after something is done."""
    before = browser.screenshot()

    def changed(action, expected="1"):
        action()
        browser.wait(expected)
        after = browser.screenshot()
        return float((np.abs(after.astype(int) - before).max(axis=2) > 24).mean())

    return before, changed


def at(browser, address, place):
    browser.open(f"{address}#{place}")
    return browser.told()


def test_the_flight_is_drawn_without_errors_or_requests(browser, address):
    told = at(browser, address, "t=6")
    assert "error" not in told
    assert browser.complaints() == []
    assert {one.partition("#")[0] for one in browser.requests()} == {address}
    picture = browser.screenshot()
    assert picture.shape == (*WINDOW[::-1], 3)
    view = picture[:480, :560].reshape(-1, 3)
    assert len(np.unique(view, axis=0)) > 500
    assert (np.abs(view.astype(int) - view[0]).max(axis=1) > 24).mean() > 0.05


def test_the_panel_tells_the_decision_as_the_log_does(browser, address, recording):
    for number in (0, len(recording.decisions) // 2):
        decision = recording.decisions[number]
        told = at(browser, address, f"t={decision['time_s'] + 0.01:.3f}")
        assert told["decision"] == str(number)
        text = browser.evaluate("document.getElementById('panel').innerText")
        assert f"Decision {number + 1} of {len(recording.decisions)}" in text
        assert decision["mode"] in text
        assert decision["why_now"] in text
        assert f"{decision['rating']:.3f}" in text
        reasons = "; ".join(decision["explanation"].split("; ")[2:])
        assert " ".join(reasons.split()) in " ".join(text.split())
    assert "short <one>" in text


def test_another_time_is_another_picture_and_the_address_keeps_it(browser, address):
    at(browser, address, "t=4")
    _, changed = scenes_of(browser)
    assert changed(lambda: None) < 0.001
    moved = changed(
        lambda: browser.evaluate("location.hash = 't=9.5'"),
        "document.documentElement.dataset.time === '9.50'",
    )
    assert moved > 0.05
    browser.press("Home")
    browser.wait("location.hash.startsWith('#t=0.00')")


def test_cells_are_coloured_by_any_rating(browser, address, recording):
    decision = next(n for n, cells in enumerate(recording.cells) if max(cells["intruder"]) > 0.5)
    time_s = recording.decisions[decision]["time_s"]
    choices = browser.evaluate("COLOURINGS.map(({ key }) => key)")
    assert {"obstacle", "visibility", "reachability", "intruder"} <= set(choices)
    assert {f"rating_{name}" for name in ("total", "printed", "visible", "evidence")} <= set(
        choices
    )
    place = f"t={time_s:.2f}&which=all&reach=0&points=0&colouring="
    at(browser, address, place + "none")
    assert browser.told()["cells"] == "0"
    seen = [browser.screenshot()]
    for choice in choices:
        browser.evaluate(f"player.set('colouring', '{choice}')")
        browser.wait("!player.stale")
        assert browser.told()["cells"] == str(len(recording.cells[0]["obstacle"]))
        seen.append(browser.screenshot())
        legend = browser.evaluate("document.getElementById('legend').innerText")
        title = browser.evaluate(f"COLOURINGS.find(({{ key }}) => key === '{choice}').title")
        assert title in legend
    first = seen[0].astype(int)
    for picture in seen[1:]:
        assert (np.abs(picture - first).max(axis=2) > 24).mean() > 0.03


def test_the_page_unpacks_the_very_numbers_of_the_file(browser, address, recording):
    at(browser, address, "t=0")
    number = len(recording.cells) // 2
    for name in ("obstacle", "rating_visible", "reachability"):
        values = browser.evaluate(f"[...player.run.cellValues({number}, '{name}')]")
        expected = 255.0 * np.array(recording.cells[number][name])
        np.testing.assert_allclose(values, expected, atol=0.51)
    flags = f"(_, cell) => player.run.cellFlag({number}, cell, 'coated')"
    coated = browser.evaluate(f"Array.from({{ length: player.run.cells }}, {flags})")
    assert coated == recording.cells[number]["coated"]
    path = browser.evaluate(f"player.run.pathOf({number})")
    np.testing.assert_allclose(path, recording.decisions[number]["path_m"], atol=1e-3)
    state = recording.states[100]
    shown = browser.evaluate(f"player.run.stateAt({state['time_s']})")
    np.testing.assert_allclose(shown["position"], state["position_m"], atol=0.01)
    np.testing.assert_allclose(shown["attitude"], state["attitude_rad"], atol=0.02)
    message = recording.intruders[len(recording.intruders) // 2]
    there = browser.evaluate(f"player.run.intruderAt(0, {message['time_s']})")
    np.testing.assert_allclose(there["position"], message["intruders"][0]["position_m"], atol=1e-3)
    distances = browser.evaluate(f"player.run.distancesAt({state['time_s']})")
    expected = [state["obstacle_distance_m"], state["intruder_distance_m"]]
    for shown_m, true_m in zip(distances, expected, strict=True):
        assert shown_m == (true_m if true_m is None else pytest.approx(true_m, abs=0.02))


def test_silence_is_no_track(browser, recording, tmp_path):
    times = [message["time_s"] for message in recording.intruders]
    start, end = times[len(times) // 3], times[2 * len(times) // 3]
    heard = [one for one in recording.intruders if not start < one["time_s"] < end]
    (tmp_path / "page.html").write_text(page_of(replace(recording, intruders=tuple(heard))))
    at(browser, (tmp_path / "page.html").as_uri(), "t=0")
    there = browser.evaluate(
        f"[{start - 1}, {(start + end) / 2}, {end + 0.5}].map((t) => player.run.intruderAt(0, t))"
    )
    assert [one is not None for one in there] == [True, False, True]
    assert browser.evaluate(f"player.run.intruderAt(0, {times[0] - 0.5})") is None


def test_seen_points_have_the_decisions_that_knew_them(browser, address, recording):
    at(browser, address, "t=0")
    spans = np.array(browser.evaluate("[...player.run.blocks.seen_span]")).reshape(-1, 2)
    places = np.array(browser.evaluate("[...player.run.points('seen')]")).reshape(-1, 3)
    voxel = recording.mission["voxel_m"]
    for number in range(0, len(recording.decisions), 5):
        known = recording.points_m[number]
        shown = places[(spans[:, 0] <= number) & (number <= spans[:, 1])]
        if len(known):
            apart = np.abs(known[:, None] - shown[None]).max(axis=2).min(axis=1)
            assert apart.max() < 0.02 * voxel + 2e-3


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("ArrowRight", lambda decision: decision + 1),
        ("ArrowLeft", lambda decision: decision - 1),
        ("Home", lambda decision: 0),  # noqa: ARG005
    ],
)
def test_arrows_go_from_decision_to_decision(browser, address, recording, key, expected):
    at(browser, address, f"t={recording.decisions[3]['time_s']:.2f}")
    browser.press(key)
    browser.wait(f"document.documentElement.dataset.decision === '{expected(3)}'")


def play_for_a_while(browser):
    start = browser.evaluate("player.time")
    browser.press(" ", "Space")
    browser.wait(f"player.time > {start} + 0.5")
    browser.press(" ", "Space")


@pytest.mark.parametrize(
    "view", ["chase", *(pytest.param(one, marks=pytest.mark.nightly) for one in ("top", "side"))]
)
def test_obstacles_and_ground_stay_after_every_step_scrub_and_pause(browser, address, view):
    at(browser, address, f"t=2&view={view}&colouring=none")
    steps = {
        "opened": lambda: None,
        "on": lambda: browser.press("ArrowRight"),
        "on again": lambda: browser.press("ArrowRight"),
        "back": lambda: browser.press("ArrowLeft"),
        "scrubbed": lambda: browser.evaluate("player.seek(7.3)"),
        "coloured": lambda: browser.press("c"),
        "played and paused": lambda: play_for_a_while(browser),
        "to the end": lambda: browser.press("End"),
        "to the start": lambda: browser.press("Home"),
    }
    # What draws obstacles, and what draws the ground, leaves its pixels in the picture.
    parts = {
        "obstacles": ("player.set('obstacles', false)", "player.set('obstacles', true)"),
        "ground": (
            "player.scenery.kept = player.scenery.ground; player.scenery.ground = { count: 0 };"
            "player.stale = true",
            "player.scenery.ground = player.scenery.kept; player.stale = true",
        ),
    }
    for done, step in steps.items():
        step()
        browser.wait("!player.stale")
        for part, (hide, show) in parts.items():
            _, changed = scenes_of(browser)
            hidden = changed(lambda hide=hide: browser.evaluate(hide), "!player.stale")
            assert hidden > 0.0005, f"no {part} once {done}"
            browser.evaluate(show)
            browser.wait("!player.stale")
        assert browser.evaluate("player.renderer.gl.getError()") == 0, done
        assert browser.complaints() == [], done


def test_keys_play_colour_and_skip(browser, address, recording):
    at(browser, address, "t=0&colouring=obstacle")
    browser.press(" ", "Space")
    browser.wait("player.time > 0.2")
    browser.press(" ", "Space")
    assert browser.evaluate("player.playing") is False
    browser.press("c")
    browser.wait("player.show.colouring === 'visibility'")
    browser.press("n")
    avoiding = [n for n, one in enumerate(recording.decisions) if one["mode"] == "avoidance"]
    number = int(browser.wait("document.documentElement.dataset.decision"))
    assert number in avoiding
    browser.press("End")
    browser.wait("player.time === player.run.end")


def test_the_slider_seeks_and_the_mouse_turns_and_shifts_the_view(browser, address):
    at(browser, address, "t=2")
    left, top, width, height = browser.evaluate(
        "(({ left, top, width, height }) => [left, top, width, height])"
        "(document.getElementById('timeline').getBoundingClientRect())"
    )
    middle = top + height / 2
    browser.drag((left + 0.2 * width, middle), (left + 0.5 * width, middle))
    browser.wait("Math.abs(player.time / player.run.end - 0.5) < 0.02")
    yaw = browser.evaluate("player.camera.yaw")
    browser.drag((400, 300), (300, 300))
    assert browser.evaluate("player.camera.yaw") - yaw == pytest.approx(0.6, abs=0.01)
    assert browser.evaluate("player.show.follow") is True
    browser.evaluate("player.camera.shift(50, 0, 600)")
    assert browser.evaluate("player.show.follow") is False


def test_two_fingers_zoom(browser, address):
    at(browser, address, "t=2")
    before = browser.evaluate("player.camera.distance")
    for kind, apart in (("touchStart", 40), ("touchMove", 60), ("touchMove", 90)):
        places = [{"x": 300 - apart, "y": 300, "id": 0}, {"x": 300 + apart, "y": 300, "id": 1}]
        browser.send("Input.dispatchTouchEvent", type=kind, touchPoints=places)
    browser.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    browser.wait(f"player.camera.distance < 0.8 * {before}")


def centre_of(browser):
    """Pixels of the middle of the nearest shown cell, in the window."""
    return browser.evaluate(
        """(() => {
          const { evidence, camera, canvas } = player, [cell] = player.picker.ofKind("cells");
          const { centres } = evidence.grids[player.show.which];
          const place = transformed(evidence.model, centres[cell.index]);
          const matrix = camera.projection(canvas.clientWidth / canvas.clientHeight);
          const [x, y, , w] = transformed(matrix, place);
          const { left, top } = canvas.getBoundingClientRect();
          return [left + (x / w + 1) / 2 * canvas.clientWidth,
            top + (1 - y / w) / 2 * canvas.clientHeight, cell.index];
        })()"""
    )


def picked_text(browser):
    return browser.evaluate("document.getElementById('picked').innerText")


def test_a_click_shows_what_the_file_says_of_a_cell(browser, address, recording):
    number = next(n for n, cells in enumerate(recording.cells) if max(cells["obstacle"]) > 0.8)
    time_s = recording.decisions[number]["time_s"]
    at(browser, address, f"t={time_s:.2f}&view=top&pick=cells&colouring=obstacle")
    x, y, nearest = centre_of(browser)
    browser.drag((x, y), (x, y))
    browser.wait("document.documentElement.dataset.picked.startsWith('cell:')")
    cell = int(browser.told()["picked"].partition(":")[2])
    shown = browser.evaluate("player.evidence.shown")
    assert cell in shown
    assert nearest in shown
    text = picked_text(browser)
    assert f"Cell {cell}" in text
    for name in ("obstacle", "visibility", "detected", "map", "intruder", "rating_total"):
        value = round(255.0 * recording.cells[number][name][cell]) / 255.0
        assert f"{value:.3f}" in text, name
    browser.drag((x, y), (x + 80, y))  # A drag picks nothing else.
    assert browser.told()["picked"] == f"cell:{cell}"
    browser.press("Escape")
    browser.wait("document.documentElement.dataset.picked === ''")
    assert browser.complaints() == []


def test_keys_pick_and_tell_why_a_trajectory_was_not_taken(browser, address, recording):
    number = next(n for n, one in enumerate(recording.decisions) if one["ruled_out"])
    made, reach = recording.decisions[number], recording.reach[number]
    at(browser, address, f"t={made['time_s']:.2f}&pick=trajectories&picked=")
    browser.press(".")
    browser.wait(f"document.documentElement.dataset.picked === 'trajectory:{reach['chosen']}'")
    assert "Taken" in picked_text(browser)
    assert made["explanation"].split("; ")[0] in picked_text(browser)
    tree = next(
        one for one in recording.reach_sets if one["start_pitch_rad"] == reach["start_pitch_rad"]
    )
    other = made["ruled_out"][0]
    node = next(
        n for n in np.flatnonzero(tree["complete"]) if flown_by(tree, n) == other["movements"]
    )
    browser.evaluate(f"player.picker.choose({{ kind: 'trajectory', index: {node} }})")
    browser.wait(f"document.documentElement.dataset.picked === 'trajectory:{node}'")
    assert f"Ruled out by {other['cause']}" in picked_text(browser)
    for kind, words in (("obstacles", "margin asked"), ("intruders", "closing")):
        browser.evaluate(f"player.set('pick', '{kind}')")
        browser.evaluate(f"player.seek({recording.intruders[5]['time_s']})")
        browser.press(".")
        browser.wait(f"document.documentElement.dataset.picked.startsWith('{kind[:-1]}:')")
        assert words in picked_text(browser)


def flown_by(tree, node):
    names = []
    while node >= 0:
        names.insert(0, tree["movement_names"][tree["movement"][node]])
        node = tree["parent"][node]
    return names


def test_everything_can_be_reached_by_keys(browser, address):
    at(browser, address, "t=2")
    browser.evaluate("document.activeElement.blur()")
    wanted = {
        "view",
        "colouring",
        "which",
        "pick",
        "play",
        "timeline",
        "plots-switch",
        "panel-switch",
    }
    reached = set()
    for _ in range(40):
        browser.press("Tab")
        reached.add(browser.evaluate("document.activeElement.id"))
    assert wanted <= reached
    controls = "[...document.querySelectorAll('button, select, input, canvas[tabindex]')]"
    named = "(one) => one.getAttribute('aria-label') || one.innerText || one.closest('label')"
    assert browser.evaluate(f"{controls}.every({named})")
    assert browser.evaluate("document.documentElement.lang") == "en"


def _nearest_mover_m(decision):
    places = [np.array(one["position_m"]) for one in decision["movers"]]
    own = np.array(decision["position_m"])
    return min((float(np.linalg.norm(place - own)) for place in places), default=np.inf)


@pytest.mark.parametrize(
    "switch", ["reach", "plan", "wayout", "points", "intruders", "obstacles", "names"]
)
def test_every_switch_takes_something_away(browser, address, recording, switch):
    with_way_out = [one for one in recording.decisions[:-1] if one["way_out_m"]]
    decision = min(with_way_out, key=_nearest_mover_m)
    at(browser, address, f"t={decision['time_s'] + 0.01:.2f}&colouring=none")
    _, changed = scenes_of(browser)
    box = list(browser.evaluate("SWITCHES.map(([name]) => name)")).index(switch)
    gone = changed(
        lambda: browser.evaluate(f"document.querySelectorAll('#switches input')[{box}].click()"),
        f"player.show.{switch} === false && !player.stale",
    )
    assert gone > 0.0005


def test_a_damaged_page_says_that_it_cannot_be_shown(browser, recording, tmp_path):
    page = page_of(recording)
    start = page.index('id="run">') + 2000
    spoilt = page[:start] + "A" * 400 + page[start + 400 :]
    (tmp_path / "page.html").write_text(spoilt)
    browser.open((tmp_path / "page.html").as_uri())
    assert "error" in browser.told()
    assert "cannot be shown" in browser.evaluate("document.getElementById('message').innerText")


@pytest.mark.nightly
def test_a_run_without_cells_is_shown_too(browser, tmp_path):
    path = tmp_path / "run.mcap"
    write_mcap(flown().setup.fly_with("straight"), flown().setup, "", path)
    (tmp_path / "page.html").write_text(page_of(read_run(path)))
    told = at(browser, (tmp_path / "page.html").as_uri(), "t=5")
    assert "error" not in told
    assert browser.complaints() == []
    assert browser.evaluate("document.getElementById('colouring').disabled") is True
    assert len(np.unique(browser.screenshot()[:480, :560].reshape(-1, 3), axis=0)) > 300


@pytest.mark.nightly
def test_the_page_of_ten_minutes_is_small(browser, tmp_path):
    setup, run = ten_minutes_flown()
    assert run.metrics.time_s > 600.0
    write_mcap(run, setup, "", tmp_path / "run.mcap")
    page = page_of(read_run(tmp_path))
    assert len(page.encode()) < 2e6  # 10 MB are allowed.
    assert (tmp_path / "run.mcap").stat().st_size < 10e6
    (tmp_path / "page.html").write_text(page)
    told = at(browser, (tmp_path / "page.html").as_uri(), "t=600")
    assert told["time"] == "600.00"
    assert browser.complaints() == []


def test_on_a_narrow_screen_the_time_line_has_the_whole_width(browser, address):
    size = {"deviceScaleFactor": 1, "mobile": False}
    browser.send("Emulation.setDeviceMetricsOverride", width=400, height=760, **size)
    try:
        at(browser, address, "t=6")
        place = "document.getElementById('timeline').getBoundingClientRect()"
        assert browser.evaluate(f"{place}.width") > 350
        assert browser.evaluate("document.documentElement.scrollWidth") <= 400
    finally:
        width, height = WINDOW
        browser.send("Emulation.setDeviceMetricsOverride", width=width, height=height, **size)


def test_a_copter_shows_its_speed_sight_and_escape(tmp_path):
    if chromium() is None:
        pytest.skip("no Chromium to look at the page with")
    setup = prepare(read_mission("copter-columns").with_values("simulation", time_limit_s=8.2))
    write_mcap(setup.fly(), setup, "", tmp_path / "run.mcap")
    recording = read_run(tmp_path / "run.mcap")
    made = recording.decisions[9]
    page = tmp_path / "copter.html"
    page.write_text(page_of(recording))
    with Browser(tmp_path / "profile") as browser:
        browser.open(f"{page.as_uri()}#t={made['time_s'] + 0.01}")
        assert browser.complaints() == []
        legend = browser.evaluate("document.getElementById('legend').innerText")
        assert {"Flown: speed", "10.0 m/s", "escape, to rest", "observed free space"} <= set(
            legend.splitlines()
        )
        panel = browser.evaluate("document.getElementById('panel').innerText")
        speed = made["speed"]
        speeds = [speed["now_mps"], speed["next_mps"], speed["greatest_mps"]]
        assert ", ".join(f"{each:.1f}" for each in speeds) + " m/s" in panel
        assert made["speed"]["why"][1:] in panel
        assert f"{made['sight']['ahead_m']:.1f} m" in panel
        speeds = [speed_from(recording, at) for at in (0, len(recording.states) - 2)]
        assert speeds[0] < 1.0 < 7.0 < speeds[1]
        told = "[0, player.run.blocks.state_s.length - 2].map((at) => speedFrom(player.run, at))"
        np.testing.assert_allclose(browser.evaluate(told), speeds, atol=0.6)
        _, changed = scenes_of(browser)
        assert (
            changed(lambda: browser.evaluate("player.set('sight', false)"), "!player.stale") > 0.02
        )
        assert "sight=0" in browser.evaluate("location.hash")


def speed_from(recording, at):
    """Speed between a state and the next one."""
    one, then = recording.states[at], recording.states[at + 1]
    moved = np.subtract(then["position_m"], one["position_m"])
    return float(np.linalg.norm(moved)) / (then["time_s"] - one["time_s"])


def test_a_plane_has_neither_sight_nor_speeds_to_show(browser, address):
    at(browser, address, "t=6")
    assert browser.evaluate("SWITCHES.some(([name]) => name === 'sight')") is False
    legend = browser.evaluate("document.getElementById('legend').innerText")
    assert "Flown: speed" not in legend
    assert "flown" in legend.splitlines()
