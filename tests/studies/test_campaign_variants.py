"""Planners of a campaign with settings of their own: a column each, or a refusal."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.base.errors import InputError
from clearway.studies.campaigns.engines import make_process_engine
from clearway.studies.campaigns.file import read_campaign
from clearway.studies.campaigns.pages import full_form, short_form
from clearway.studies.campaigns.run import run_campaign
from in_process import clearway

VARIED = """
name = "varied"
planners = ["clearway", "bolder", "straight"]

[variants.bolder]
planner = "clearway"
changes.safety = { escape = "known" }
changes.simulation = { time_limit_s = 4.0 }

[[family]]
family = "forest"
changes.simulation = { time_limit_s = 3.0 }
changes.safety = { margin_m = 0.5 }
"""


def test_a_variant_flies_with_settings_of_its_own_and_is_a_column(tmp_path: Path) -> None:
    file, out = tmp_path / "varied.toml", tmp_path / "out"
    file.write_text(VARIED)
    campaign = read_campaign(str(file))
    rows = run_campaign(campaign, out, make_process_engine(1)).rows
    assert [row.planner for row in rows] == ["clearway", "bolder", "straight"]
    plain, bolder, straight = rows
    assert (plain.escape, bolder.escape) == ("strict", "known")
    assert (plain.time_s, bolder.time_s) == pytest.approx((3.0, 4.0))
    assert plain.margin_m == bolder.margin_m == 0.5
    assert plain.settings_id == straight.settings_id != bolder.settings_id
    told = '- bolder: with safety.escape = "known", simulation.time_limit_s = 4.0\n'
    for form in (short_form, full_form):
        assert told in form(rows, {"campaign": "varied", "version": "0"}, {})
    # It is flown again by its key, and what was flown is kept.
    again = run_campaign(campaign, out, make_process_engine(1))
    assert (again.flown_now, len(again.rows)) == (0, 3)
    assert "--replay forest/bolder/0" in bolder.replay
    flown = clearway("campaign", file, "--replay", "forest/bolder/0", "--out", out)
    assert flown.exit_code == 0, flown.stderr
    assert "it ends as its row says, to the last bit" in flown.stderr
    file.write_text(VARIED.replace('"known"', '"off"'))
    with pytest.raises(InputError, match="other settings of forest"):
        run_campaign(read_campaign(str(file)), out, make_process_engine(1))


@pytest.mark.parametrize(
    ("written", "instead", "said"),
    [
        ("[variants.bolder]", "[variants.vfh]", "there is a planner called vfh already"),
        ('planner = "clearway"', 'planner = "clearwya"', "did you mean 'clearway'"),
        ('"bolder", "straight"', '"bolder", "bravest"', "planner 'bravest'"),
        ("changes.simulation = { time_limit_s = 4.0 }", "changes.sim = {}", "changes.sim"),
        ("[variants.bolder]", '[variants."a/b"]', "a/b"),
    ],
)
def test_variants_that_cannot_be_are_refused(
    tmp_path: Path, written: str, instead: str, said: str
) -> None:
    file = tmp_path / "varied.toml"
    assert written in VARIED
    file.write_text(VARIED.replace(written, instead))
    with pytest.raises(InputError, match=said):
        read_campaign(str(file))
