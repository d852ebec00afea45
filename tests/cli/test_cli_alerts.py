"""`clearway alerts`: a recording through volumes, told, drawn and refused."""

from __future__ import annotations

import json

import pytest

from in_process import clearway as run_here

HEAD = (
    "NAME, lat, lon, alt, trk, gs, vs, time\n"
    "[none], [deg], [deg], [ft], [deg], [knot], [fpm], [s]\n"
)


@pytest.fixture
def recording(tmp_path):  # type: ignore[no-untyped-def]
    """Two that meet head on at 60 s, 100 kt each, over the equator."""
    rows = []
    for second in range(120):
        away = (second - 60) * 100.0 / 3600.0 / 60.0
        rows.append(f"Own, 0.0, {away:.7f}, 3000, 90, 100, 0, {second}")
        rows.append(f"Other, 0.0, {-away:.7f}, 3000, 270, 100, 0, {second}")
    path = tmp_path / "met.daa"
    path.write_text(HEAD + "\n".join(rows) + "\n")
    return path


def test_alerts_come_in_order_and_are_drawn(recording, tmp_path) -> None:  # type: ignore[no-untyped-def]
    done = run_here("alerts", recording, "--own", "Own", "--json", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    first = {}
    for change in told["changes"]:
        first.setdefault(change["level"], change["time_s"])
    # 2250 ft are met 6.7 s before the closest point, at 60 s; alerts look 55 s and 25 s ahead.
    warned = min(first[level] for level in ("warning", "recovery") if level in first)
    assert warned == pytest.approx(60.0 - 5.9 - 25.0, abs=1.5)
    assert told["changes"][-1]["level"] == "none"
    bands = [row["bands"] for row in told["seconds"] if row["bands"]]
    assert bands
    assert {"heading_deg", "climb_mps", "speed_mps", "saturated"} <= set(bands[0])
    assert (tmp_path / "out" / "alerts.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "out" / "alerts.json").read_text())["own"] == "Own"


def test_who_is_not_there_and_what_is_no_set_is_named(recording, tmp_path) -> None:  # type: ignore[no-untyped-def]
    done = run_here("alerts", recording, "--own", "Nobody", cwd=tmp_path)
    assert done.returncode == 2
    assert "Other" in done.stderr
    done = run_here("alerts", recording, "--volumes", "mine", cwd=tmp_path)
    assert done.returncode == 2
    assert "do-365" in done.stderr
