"""`clearway fly` with run.mcap and Parquet, `clearway replay`: through the real entry point."""

import http.client
import json
import re
import signal
import socket
import subprocess

import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")

from clearway.io.toml_writing import dump_toml
from clearway.view.replay.writing import write_mcap
from flown_missions import SHORT, flown
from in_process import clearway as run_here
from own_process import CLEARWAY
from own_process import run_clearway as run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run folder as `clearway fly` leaves it."""
    folder = tmp_path_factory.mktemp("run")
    short = flown()
    write_mcap(short.run, short.setup, dump_toml(short.file.effective()), folder / "run.mcap")
    return folder


def test_a_flight_leaves_its_recording_and_tables(tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "short.toml").write_text(SHORT)
    done = run_here("fly", "short.toml", "--no-plots", "--parquet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"run.mcap", "decisions.parquet", "track.parquet", "intruders.parquet"} <= names
    page = run_here("replay", "out", "--html", "page.html", cwd=tmp_path)
    assert page.returncode == 0, page.stderr
    assert (tmp_path / "page.html").stat().st_size > 50_000


@pytest.mark.nightly
def test_a_flight_goes_without_the_extras_and_says_which(tmp_path):
    late = SHORT + "\n[simulation]\ntime_limit_s = 2\n"
    (tmp_path / "short.toml").write_text(late)
    options = ("fly", "short.toml", "--no-plots", "--json", "--out", "out")
    done = run(*options, cwd=tmp_path, absent="foxglove")
    assert done.returncode == 1, done.stderr
    assert json.loads(done.stdout)["reached"] is False
    lines = [line for line in done.stderr.splitlines() if "clearway[foxglove]" in line]
    assert len(lines) == 1
    assert (tmp_path / "out" / "decisions.jsonl").is_file()
    assert not (tmp_path / "out" / "run.mcap").exists()
    done = run(*options, "--parquet", cwd=tmp_path, absent="pyarrow.parquet")
    assert done.returncode == 2
    assert "clearway[parquet]" in done.stderr
    done = run_here("replay", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert "no run.mcap" in done.stderr


def test_reading_without_the_extra_says_which(folder, tmp_path):
    done = run("replay", folder, "--html", "page.html", cwd=tmp_path, absent="mcap.reader")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].endswith("pip install 'clearway[foxglove]'")
    assert not (tmp_path / "page.html").exists()


def test_the_page_is_whole_and_asks_for_nothing(folder, tmp_path):
    done = run("replay", folder, "--html", tmp_path / "page.html", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told, text = json.loads(done.stdout), (tmp_path / "page.html").read_text()
    assert told["decisions"] == len(flown().run.decisions)
    assert told["intruders"] == 1
    assert told["page_bytes"] == (tmp_path / "page.html").stat().st_size
    assert not re.findall(r"https?://|//[a-z]+\.[a-z]+/|@import|\bimport\(|<link|<img|src=", text)
    assert "default-src 'none'" in text
    assert "unsafe" not in text
    assert "{{" not in text
    assert "<title>short &lt;one&gt; - clearway replay</title>" in text
    assert "short <one>" not in text


def test_replay_reads_the_file_itself_too(folder, tmp_path):
    done = run_here("replay", folder / "run.mcap", "--html", "p.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def served(folder, tmp_path, *options):
    process = subprocess.Popen(
        [*CLEARWAY, "replay", str(folder), "--no-browser", "--json", *options],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Whoever began the tests in a shell's background has it ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    return process, json.loads(process.stdout.readline())


def test_the_page_is_served_on_this_computer_alone(folder, tmp_path):
    process, told = served(folder, tmp_path, "--port", "0")
    try:
        address = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/", told["url"])
        port = int(address[1])

        def answer(path, host=f"127.0.0.1:{port}"):
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
            connection.request("GET", path, headers={"Host": host})
            response = connection.getresponse()
            return response.status, response.read()

        status, page = answer("/")
        assert status == 200
        assert len(page) == told["page_bytes"]
        assert answer("/", f"localhost:{port}")[0] == 200
        assert answer("/run.mcap")[0] == 404
        assert answer("/../../etc/passwd")[0] == 404
        assert answer("/", "elsewhere.example")[0] == 403
        with socket.socket() as other, pytest.raises(OSError, match="refused"):
            other.connect(("127.0.0.2", port))
    finally:
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=120)
    assert process.returncode == 0, messages
    assert "Traceback" not in messages


def test_a_port_in_use_is_said(folder, tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = run_here("replay", folder, "--no-browser", "--port", port, cwd=tmp_path)
    assert done.returncode == 2
    assert f"--port {port}: in use on 127.0.0.1" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("case", ["absent", "text", "truncated"])
def test_bad_runs_are_refused_and_nothing_is_written(folder, tmp_path, case):
    path = tmp_path / "run.mcap"
    if case == "text":
        path.write_text("a,b,c\n")
    elif case == "truncated":
        path.write_bytes((folder / "run.mcap").read_bytes()[:5000])
    done = run_here("replay", path, "--html", "page.html", cwd=tmp_path)
    assert done.returncode == 2
    assert "run.mcap: " in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "page.html").exists()


def test_a_page_that_cannot_be_written_is_said(folder, tmp_path):
    (tmp_path / "file").write_text("")
    done = run_here("replay", folder, "--html", "file/page.html", cwd=tmp_path)
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
