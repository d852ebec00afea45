"""Campaigns: journal, engines and tables; through the command where a user would."""

from __future__ import annotations

import json
import random
import re
import signal
import subprocess
import sys
import time
import tomllib
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from campaign_for_tests import SMALL
from clearway.base.errors import InputError
from clearway.base.intervals import Interval, bootstrap_mean
from clearway.cli.campaign_replay import replay_flight
from clearway.cli.campaign_table import summarize_campaign
from clearway.studies import campaigns
from clearway.studies.campaigns.engines import make_process_engine, on_cluster
from clearway.studies.campaigns.file import read_campaign
from clearway.studies.campaigns.journal import open_journal
from clearway.studies.campaigns.pages import full_form, mean_in_words, short_form, write_pages
from clearway.studies.campaigns.results import read_results, write_results
from clearway.studies.campaigns.row import FlightRow, without_timings
from clearway.studies.campaigns.run import run_campaign
from clearway.studies.campaigns.summary import Rate, failures, seconds, standings
from clearway.studies.campaigns.task import fly_task, tasks_of
from in_process import clearway
from own_process import CLEARWAY
from repository import REPOSITORY

FLIGHTS = 2 * 3 * 4 + 2 * 2


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign file."""
    path = tmp_path_factory.mktemp("campaign") / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def uninterrupted(small: Path) -> list[FlightRow]:
    """Its rows, flown in one go in this process."""
    out = small.parent / "whole"
    run_campaign(read_campaign(str(small)), out, make_process_engine(1))
    rows, _ = read_results(out / "results.parquet")
    assert len(rows) == FLIGHTS
    return rows


run = partial(clearway, "campaign")


def same(one: list[FlightRow], other: list[FlightRow]) -> bool:
    return [without_timings(row) for row in one] == [without_timings(row) for row in other]


def lines_of(journal: Path) -> int:
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def wait_for(condition: Any, seconds: float = 300.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def killed_after_more(campaign: Path, workers: int, journal: Path, delay_s: float) -> None:
    """Fly, kill the process some time after its first row, and see its workers end."""
    head = max(1, lines_of(journal))
    options = ("--out", str(journal.parent), "--workers", str(workers))
    command = [*CLEARWAY, "campaign", str(campaign), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as sitting:
        wait_for(lambda: lines_of(journal) > head or sitting.poll() is not None)
        helpers = children_of(sitting.pid)
        time.sleep(delay_s)
        sitting.send_signal(signal.SIGKILL)
    assert sitting.returncode == -signal.SIGKILL
    assert bool(helpers) == (workers > 1)
    wait_for(lambda: not any(is_alive(helper) for helper in helpers))


def children_of(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def is_alive(pid: int) -> bool:
    try:
        return " Z " not in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False


# Killed and gone on with -------------------------------------------------------------------


@pytest.mark.nightly
@pytest.mark.parametrize(
    "sittings", [(1,), pytest.param((2, 1, 2), marks=pytest.mark.nightly)], ids=["once", "often"]
)
def test_killed_again_and_again_nothing_is_lost_and_nothing_is_double(
    small: Path, uninterrupted: list[FlightRow], tmp_path: Path, sittings: tuple[int, ...]
) -> None:
    out = tmp_path / "out"
    journal, moments = out / "journal.jsonl", random.Random(6)
    for workers in sittings:
        known = lines_of(journal)
        killed_after_more(small, workers, journal, moments.uniform(0.0, 0.3))
        assert lines_of(journal) > known
    assert not (out / "results.parquet").exists()
    known = lines_of(journal) - 1
    flown = run_campaign(read_campaign(str(small)), out, make_process_engine(1))
    assert FLIGHTS - known <= flown.flown_now <= FLIGHTS - known + 1
    rows, _ = read_results(out / "results.parquet")
    assert same(rows, uninterrupted)
    assert same(list(flown.rows), uninterrupted)
    assert not journal.exists()


@pytest.mark.nightly
def test_a_journal_torn_anywhere_keeps_its_whole_lines(
    uninterrupted: list[FlightRow], tmp_path: Path
) -> None:
    path, settings, rows = tmp_path / "journal.jsonl", {"version": "1"}, uninterrupted[:3]
    with open_journal(path, settings, FlightRow) as journal:
        for row in rows:
            journal.append(row)
    whole = path.read_bytes()
    ends = [n + 1 for n, byte in enumerate(whole) if byte == ord("\n")]
    near = {end + by for end in ends for by in (-1, 0, 1)} - {len(whole) + 1}
    for cut in sorted(near | set(range(0, len(whole), 211))):
        path.write_bytes(whole[:cut])
        kept = sum(end <= cut for end in ends[1:])
        with open_journal(path, settings, FlightRow) as journal:
            assert journal.rows == rows[:kept]
            for row in rows[kept:]:
                journal.append(row)
        assert path.read_bytes() == whole


def test_only_one_campaign_at_a_time_writes_a_journal(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with (
        open_journal(path, {}, FlightRow),
        pytest.raises(InputError, match="another campaign"),
        open_journal(path, {}, FlightRow),
    ):
        pass


def test_changed_settings_are_told_from_the_same_in_other_words(
    uninterrupted: list[FlightRow], tmp_path: Path
) -> None:
    settings = {"campaign": "small", "version": uninterrupted[0].version}
    write_results(tmp_path / "results.parquet", uninterrupted, settings)
    same_file, other_file = tmp_path / "same.toml", tmp_path / "other.toml"
    same_file.write_text("# Another comment.\n" + SMALL.replace("seeds = 4", "seeds   =  4"))
    other_file.write_text(SMALL.replace("dropout = 0.5", "dropout = 0.4"))
    flown = run_campaign(read_campaign(str(same_file)), tmp_path, make_process_engine(1))
    assert flown.flown_now == 0
    assert same(list(flown.rows), uninterrupted)
    with pytest.raises(InputError, match="other settings of balls-60"):
        run_campaign(read_campaign(str(other_file)), tmp_path, make_process_engine(1))
    other_file.write_text(SMALL.replace('name = "small"', 'name = "large"'))
    with pytest.raises(InputError, match="campaign 'small' there, 'large' now"):
        run_campaign(read_campaign(str(other_file)), tmp_path, make_process_engine(1))


@pytest.mark.nightly
def test_more_seeds_and_planners_leave_what_was_flown(
    small: Path, uninterrupted: list[FlightRow], tmp_path: Path
) -> None:
    planners = '"clearway", "straight", "potential-field"'
    assert planners in SMALL
    fewer = SMALL.replace(planners, '"potential-field", "straight"').replace(
        "seeds = 4", "seeds = 1"
    )
    (tmp_path / "fewer.toml").write_text(fewer)
    flown = run_campaign(
        read_campaign(str(tmp_path / "fewer.toml")), tmp_path, make_process_engine(1)
    )
    assert flown.flown_now == 2 * 2 + 2
    flown = run_campaign(read_campaign(str(small)), tmp_path, make_process_engine(1))
    assert flown.flown_now == FLIGHTS - 6
    differs = {"replay"}
    assert [
        {name: value for name, value in without_timings(row).items() if name not in differs}
        for row in flown.rows
    ] == [
        {name: value for name, value in without_timings(row).items() if name not in differs}
        for row in uninterrupted
    ]
    again = run_campaign(
        read_campaign(str(tmp_path / "fewer.toml")), tmp_path, make_process_engine(1)
    )
    assert (again.flown_now, len(again.rows)) == (0, FLIGHTS)


def test_part_of_a_campaign_can_be_flown_first(small: Path, tmp_path: Path) -> None:
    campaign = read_campaign(str(small))
    first = run_campaign(campaign, tmp_path, make_process_engine(1), "several/straight/[01]")
    assert [row.key for row in first.rows] == ["several/straight/0", "several/straight/1"]
    second = run_campaign(campaign, tmp_path, make_process_engine(1), "several/*/0")
    assert second.flown_now == 2
    assert [row.key for row in second.rows] == [
        "several/clearway/0",
        "several/straight/0",
        "several/straight/1",
        "several/potential-field/0",
    ]


# Other engines -----------------------------------------------------------------------------


@pytest.mark.nightly
def test_a_cluster_that_loses_a_worker_gives_the_same_rows(
    small: Path, uninterrupted: list[FlightRow], tmp_path: Path
) -> None:
    contact = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started: list[subprocess.Popen[bytes]] = []

    def start(module: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{module}", *options]
        process = subprocess.Popen([*command, "--no-dashboard", "--host", "127.0.0.1"], **quiet)  # type: ignore[call-overload]
        started.append(process)
        return process

    try:
        start("dask_scheduler", "--port", "0", "--scheduler-file", str(contact))
        wait_for(lambda: contact.exists() and contact.read_text().strip().endswith("}"))
        address = json.loads(contact.read_text())["address"]
        workers = [start("dask_worker", address, "--nthreads", "1", "--no-nanny") for _ in range(2)]
        done: list[FlightRow] = []
        for row in on_cluster(address)(tasks_of(read_campaign(str(small)))):
            done.append(row)
            if len(done) == FLIGHTS // 4:
                workers[0].kill()
        assert workers[0].wait() == -signal.SIGKILL
        assert workers[1].poll() is None
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
    order = [row.key for row in uninterrupted]
    assert same(sorted(done, key=lambda row: order.index(row.key)), uninterrupted)


def test_a_row_is_flown_again_with_pictures_and_ends_the_same(
    uninterrupted: list[FlightRow], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    row = next(row for row in uninterrupted if row.crashed)
    program, *arguments = row.replay.split()
    assert program == "clearway"
    results = tmp_path / "results.parquet"
    write_results(results, [row], {})
    again = run(*arguments[1:], "--out", tmp_path, "--json", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    result = json.loads(again.stdout)
    assert (result["compared"], result["differs_in"]) == (True, [])
    folder = tmp_path / "replays" / row.key.replace("/", "-")
    assert {"flight.png", "track.csv", "mission.toml"} <= {each.name for each in folder.iterdir()}
    write_results(results, [replace(row, track_id="other")], {})
    with pytest.raises(SystemExit, match="1"):
        replay_flight(read_campaign(arguments[1]), row.key, tmp_path, as_json=False)
    assert "NOT end as its row says: track_id" in capsys.readouterr().err


def test_a_planner_that_raises_is_a_flight_that_failed(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def falls(*_: object, **_named: object) -> None:
        raise ZeroDivisionError("over zero")

    monkeypatch.setattr("clearway.missions.setup.simulate", falls)
    row = fly_task(tasks_of(read_campaign(str(small)))[0])
    assert (row.outcome, row.why) == ("failed", "ZeroDivisionError: over zero")
    assert row.lost_margin
    assert not row.safe


# Tables ------------------------------------------------------------------------------------


def test_standings_count_what_rows_say(uninterrupted: list[FlightRow]) -> None:
    plain = uninterrupted[0]
    outcomes = ["safe", "safe", "margin lost", "crashed", "not reached", "refused"]
    rows = [
        replace(
            plain,
            seed=seed,
            outcome=outcome,
            reached=outcome in ("safe", "margin lost"),
            crashed=outcome == "crashed",
            nearest_m=None if outcome == "refused" else float(seed),
            path_m=11.0 + seed,
            straight_m=10.0,
        )
        for seed, outcome in enumerate(outcomes)
    ]
    (standing,) = standings(rows)
    assert standing.safe == Rate(2, 6)
    assert standing.reached == Rate(3, 6)
    assert standing.crashed == Rate(1, 6)
    assert standing.lost_margin == Rate(2, 6)
    assert standing.not_flown == 1
    assert (standing.nearest_min_m, standing.nearest_median_m) == (0.0, 2.0)
    assert standing.path_ratio.value == pytest.approx(1.2)
    assert 1.1 <= standing.path_ratio.low <= 1.2 <= standing.path_ratio.high <= 1.3
    better = [replace(row, planner="other", outcome="safe", crashed=False) for row in rows]
    told = {each.measure: (each.own, each.others) for each in seconds(rows + better)}
    assert told == {
        "reached with margin": (2, {"other": 6}),
        "crashes": (1, {"other": 0}),
        "margin losses": (2, {"other": 0}),
    }
    # Who flew fewer cases is held against the same ones.
    (crashes,) = (each for each in seconds(rows + better[3:]) if each.measure == "crashes")
    assert (crashes.own, crashes.others, crashes.flights) == (1, {"other": 0}, 3)


def test_bootstrap_of_a_normal_sample_is_the_textbook_interval() -> None:
    sample = np.random.default_rng(0).normal(3.0, 2.0, 1_000)
    low, high = bootstrap_mean(sample)
    half = 1.96 * sample.std() / np.sqrt(1_000)
    assert low == pytest.approx(sample.mean() - half, abs=0.15 * half)
    assert high == pytest.approx(sample.mean() + half, abs=0.15 * half)
    assert bootstrap_mean([2.0, 2.0]) == (2.0, 2.0)
    assert np.isnan(bootstrap_mean([])).all()
    assert np.isnan(bootstrap_mean([2.0])).all(), "one value has no interval"
    assert mean_in_words(Interval(360.2, np.nan, np.nan), 1) == "360.2 (one)"


def test_who_cannot_know_is_neither_beaten_nor_a_failure(uninterrupted: list[FlightRow]) -> None:
    plain = replace(
        uninterrupted[0], planner="first", outcome="crashed", crashed=True, crashed_s=3.0
    )
    blind = replace(plain, planner="blind", hidden="what traffic reports")
    rows = [plain, blind, replace(plain, planner="third", outcome="safe", crashed=False)]
    assert [row.planner for row in failures(rows)] == ["first"]
    assert all(set(each.others) == {"third"} for each in seconds(rows))
    settings = {"campaign": "c", "version": "v"}
    told = {each["planner"]: each for each in summarize_campaign(rows, settings, {})["table"]}
    assert told["first"]["crashed"]["flights"] == 1
    assert (told["blind"]["crashed"], told["blind"]["safe"]) == (None, None)
    assert told["blind"]["time_s"]["mean"] == told["first"]["time_s"]["mean"]
    page = full_form(rows, settings, {})
    assert re.search(r"^\| blind \| n/a \| n/a \| n/a \| n/a \| ", page, re.MULTILINE)
    assert "- n/a: blind cannot know what traffic reports" in page
    short = short_form(rows, settings, {})
    assert re.search(r"\| 0 / 1 \| n/a \| 1 / 0 \|$", short, re.MULTILINE)


def test_planners_that_flew_less_often_say_so_in_the_short_table(
    uninterrupted: list[FlightRow],
) -> None:
    rows = [row for row in uninterrupted if row.planner == "clearway" or row.seed < 3]
    short = short_form(rows, {"campaign": "c", "version": "0"}, {})
    cells = re.search(r"^\| several \| 4 \|(.*)\|$", short, re.MULTILINE)
    assert cells is not None
    first, *others = [cell.strip() for cell in cells[1].split("|")]
    assert re.fullmatch(r"\d / \d", first)
    assert others
    assert all(re.fullmatch(r"\d / \d of 3|n/a", cell) for cell in others)


def test_results_come_back_from_parquet_as_they_went_in(
    uninterrupted: list[FlightRow], tmp_path: Path
) -> None:
    write_results(tmp_path / "r.parquet", uninterrupted, {"campaign": "ä"})
    rows, settings = read_results(tmp_path / "r.parquet")
    assert [asdict(row) for row in rows] == [asdict(row) for row in uninterrupted]
    assert settings == {"campaign": "ä"}
    assert [each.name for each in tmp_path.iterdir()] == ["r.parquet"]


def test_tables_are_put_between_the_marks_of_a_page(
    small: Path, uninterrupted: list[FlightRow], tmp_path: Path
) -> None:
    page = tmp_path / "page.md"
    marks = "".join(
        f"{name}\n<!-- {name}:begin -->\nold\n<!-- {name}:end -->\n"
        for name in ("campaign", "campaign-short")
    )
    page.write_text(f"before\n{marks}after\n")
    results = small.parent / "whole" / "results.parquet"
    done = run("--summary", results, "--docs", page, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = page.read_text()
    rows, settings = read_results(results)
    assert write_pages(page, rows, settings, {}) == ["campaign", "campaign-short"]
    assert page.read_text() == text
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    short = re.search(r"^\| several \| 4 \| (\d) / (\d) \|", text, re.MULTILINE)
    assert short is not None
    flown = [row for row in uninterrupted if row.key.startswith("several/clearway/")]
    assert (int(short[1]), int(short[2])) == (sum(row.safe for row in flown), 0)
    assert len(re.findall(r"^### several$", text, re.MULTILINE)) == 1
    failed = {each["key"] for each in json.loads(done.stdout)["failures"]}
    assert failed == {row.key for row in uninterrupted if not row.safe}
    assert "several/straight/0" in failed


def test_files_of_the_standard_campaign_are_looked_for_where_they_stand() -> None:
    folder = Path(campaigns.__file__).parent
    tables = tomllib.loads((folder / "standard.toml").read_text())["family"]
    named = [path for each in tables for path in each.get("parameters", {}).values()]
    files = [folder / path for path in named if isinstance(path, str) and "/" in path]
    shared = REPOSITORY.parent / "shared"
    assert len(files) == 5
    for file in files:
        there = file.resolve()
        assert there.is_file() or there.is_relative_to(shared)


# Bad input ---------------------------------------------------------------------------------


def test_bad_requests_end_with_2_and_leave_nothing(
    small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "r.parquet").write_text("no parquet")
    for arguments, said in (
        (("swamp",), "quick, rain, standard"),
        ((small, "--replay", "several/best/0"), "several/clearway/0"),
    ):
        done = run(*arguments, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (2, ""), done.stderr
        assert said in done.stderr
        assert "Traceback" not in done.stderr
    assert [each.name for each in tmp_path.iterdir()] == ["r.parquet"]
    with pytest.raises(InputError, match="no Parquet file"):
        read_results(tmp_path / "r.parquet")
    monkeypatch.setattr("clearway.studies.campaigns.engines.ANSWERS_WITHIN_S", 0.5)
    with pytest.raises(InputError, match="no scheduler answers"):
        list(on_cluster("tcp://127.0.0.1:1")(tasks_of(read_campaign(str(small)))))
