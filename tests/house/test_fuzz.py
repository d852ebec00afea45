"""A few damaged files of every format, the same each time; `make fuzz` tries as many as wanted."""

import pytest
from tools.fuzz.judge import Outcome, faults
from tools.fuzz.mutate import mutated
from tools.fuzz.run import Case, tried, whole_files
from tools.fuzz.seeds import FORMATS

EACH, EACH_APART = 3, 1
"""By day; a night run damages more of each, `make fuzz` as many as wanted."""
AT_NIGHT = 6


@pytest.mark.parametrize("name", FORMATS)
def test_damaged_files(name):
    damage(name, range(EACH_APART if FORMATS[name].apart else EACH))


@pytest.mark.nightly
@pytest.mark.parametrize("name", [name for name, one in FORMATS.items() if not one.apart])
def test_more_damaged_files(name):
    damage(name, range(EACH, AT_NIGHT))


def damage(name, numbers):
    whole = whole_files(name)
    if not whole:
        pytest.skip("needs data: no whole file of this format")
    for number in numbers:
        case = Case(name, 0, number, whole)
        outcome, found = tried(name, case.data)
        assert not found, (number, outcome)


def test_the_same_number_is_the_same_file():
    whole = whole_files("sbs")
    assert Case("sbs", 3, 7, whole).data == Case("sbs", 3, 7, whole).data
    assert len({Case("sbs", 3, number, whole).data for number in range(50)}) > 40


def test_files_are_changed_but_not_blown_up():
    from random import Random

    whole = whole_files("geojson")[0]
    made = [mutated(whole, Random(seed), (whole,)) for seed in range(300)]
    assert sum(one != whole for one in made) > 280
    assert max(map(len, made)) <= 4_000_000


@pytest.mark.parametrize(
    ("outcome", "what"),
    [
        (Outcome(1, "", "", raised="ValueError at a.py:1: x"), "raised"),
        (Outcome(-6, "", ""), "status -6"),
        (Outcome(70, "", "x: an error inside clearway (ValueError: x)"), "traceback"),
        (Outcome(0, "", "", ("RuntimeWarning at a.py:1: overflow",)), "warning"),
        (Outcome(0, "\x1b[31m", ""), "control characters in output"),
        (Outcome(2, "", "a.csv: " + "x" * 500), "message of 1 lines, 507 characters"),
        (Outcome(2, "", "bad"), "names no file"),
    ],
)
def test_what_is_wrong_is_seen(outcome, what):
    assert any(what in fault for fault in faults(outcome, ("a.csv",)))


def test_what_is_right_is_let_pass():
    assert not faults(Outcome(2, "", "a.csv: line 1: bad"), ("a.csv",))
    assert not faults(Outcome(0, "ok", "preparing reach sets and sensors"), ("a.csv",))
