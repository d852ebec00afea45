"""`python -m benchmarks`: its table, its options, and that other ways give the same results."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from repository import REPOSITORY


def bench(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "benchmarks", *arguments],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.nightly
def test_the_table_states_the_machine_and_holds_results_against_references(tmp_path: Path) -> None:
    # Each of these asserts that NumPy comes to the same result before it is timed.
    patterns = ("tree, *", "map, near", "hits, 7,000")
    only = [word for pattern in patterns for word in ("--only", pattern)]
    done = bench("--quick", *only, "--markdown", str(tmp_path / "table.md"))
    assert done.returncode == 0, done.stderr
    assert "numpy" in done.stdout
    table = (tmp_path / "table.md").read_text()
    head, rule, *rows = [line for line in table.splitlines() if line.startswith("|")]
    assert head.count("|") == rule.count("|") == 10
    assert len(rows) == 4
    assert all("x as fast as NumPy" in row for row in rows)
    assert "Measured on" in table


def test_the_readme_takes_a_full_run() -> None:
    before = (REPOSITORY / "docs" / "results" / "speed.md").read_bytes()
    for page in ("--readme", "--first-page"):
        done = bench("--quick", page)
        assert done.returncode == 2
        assert "full run" in done.stderr
    assert (REPOSITORY / "docs" / "results" / "speed.md").read_bytes() == before


def test_of_several_runs_the_one_in_the_middle_is_shown_with_its_neighbours(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("above\n<!-- speed:begin -->\nold\n<!-- speed:end -->\nbelow\n")
    code = (
        "import sys; from pathlib import Path\n"
        "from benchmarks.table import Benchmark, Results, Row, middle_of, replace_first_page_form\n"
        "rows = [Row('a decision', f'{n} ms', measured=n) for n in (10.0, 9.0, 30.0, 8.0, 11.0)]\n"
        "shown = Benchmark('a', lambda quick: rows[0], first_page=True)\n"
        "hidden = Benchmark('b', lambda quick: rows[0], headline=True)\n"
        "found = [(shown, middle_of(rows)), (hidden, Row('not shown', '1 ms'))]\n"
        "replace_first_page_form(Path(sys.argv[1]), Results(found, 'one machine'))\n"
    )
    subprocess.run([sys.executable, "-c", code, str(readme)], cwd=REPOSITORY, check=True)
    text = readme.read_text()
    assert "| a decision | 10.0 ms | 8.0 ms to 30.0 ms in 5 runs |" in text
    assert "Measured on one machine." in text
    assert "old" not in text
    assert "not shown" not in text


def test_what_has_become_slower_is_told_and_fails_nothing(tmp_path: Path) -> None:
    (tmp_path / "kept.toml").write_text('"slow" = 2.0\n"as it was" = 20.0\n')
    code = (
        "import sys; from pathlib import Path\n"
        "from benchmarks import ratios\n"
        "short, long = (lambda: sum(range(50))), (lambda: sum(range(1_000)))\n"
        "ratios.pairs = lambda: {'slow': (long, short), 'as it was': (long, short)}\n"
        "ratios.KEPT, ratios.ROUND_S = Path(sys.argv.pop(1)), 0.002\n"
        "ratios.main()\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "kept.toml")]
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=True)
    warnings = [line for line in done.stdout.splitlines() if line.startswith("warning")]
    assert len(warnings) == 1
    assert warnings[0].startswith("warning: slow: ")


def test_ratios_are_kept_of_all_that_is_measured() -> None:
    code = (
        "import tomllib\n"
        "from benchmarks.ratios import KEPT, pairs\n"
        "assert set(tomllib.loads(KEPT.read_text())) == set(pairs())\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, check=True)


def test_an_unknown_name_says_what_there_is() -> None:
    done = bench("--only", "nothing like it")
    assert done.returncode == 1
    assert "ball worlds, fresh" in done.stderr


def test_the_short_form_replaces_what_is_between_the_marks(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("above\n<!-- bench:begin -->\nold\n<!-- bench:end -->\nbelow\n")
    code = (
        "import sys; from pathlib import Path\n"
        "from benchmarks.table import Benchmark, Results, Row, Target, replace_short_form\n"
        "row = Row('flights', '20 of 20', 'nearest 0.8 m', Target('all', True))\n"
        "shown = Benchmark('a', lambda quick: row, headline=True)\n"
        "hidden = Benchmark('b', lambda quick: row)\n"
        "rows = [(shown, row), (hidden, Row('not shown', '1 ms'))]\n"
        "replace_short_form(Path(sys.argv[1]), Results(rows, 'one machine'))\n"
    )
    subprocess.run([sys.executable, "-c", code, str(readme)], cwd=REPOSITORY, check=True)
    text = readme.read_text()
    assert text.startswith("above\n<!-- bench:begin -->\n| what |")
    assert text.endswith("<!-- bench:end -->\nbelow\n")
    assert "| flights | 20 of 20 | nearest 0.8 m | all: met |" in text
    assert "Measured on one machine." in text
    assert "old" not in text
    assert "not shown" not in text


@pytest.mark.nightly
def test_every_benchmark_has_a_row(tmp_path: Path) -> None:
    done = bench("--quick", "--markdown", str(tmp_path / "table.md"))
    assert done.returncode == 0, done.stderr[-2000:]


def test_what_was_slowed_down_is_measured_again_but_not_for_ever() -> None:
    code = (
        "from benchmarks.pace import CALM, Pace\n"
        "from benchmarks.table import Row\n"
        "pace, rows, slower = Pace(), [], iter([9.0, 1.0, 1.0, 8.0, 9.0, 7.0, 1.1, 1.0])\n"
        "pace._calm = pace.look = lambda: next(slower)\n"
        "def measure():\n"
        "    rows.append(Row('a decision', str(len(rows))))\n"
        "    return rows[-1]\n"
        "found = pace.calmest(measure, 3)\n"
        "assert (found.result, found.pace, len(rows)) == ('1', 8.0, 3), found\n"
        "assert pace.calmest(measure, 3).pace == 1.1 <= CALM and len(rows) == 4\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
