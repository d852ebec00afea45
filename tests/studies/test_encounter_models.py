"""All public encounter models: read, and sampled as their counts say; skipped without their files.

The laws are computed here from the text of each file, by their own reader of its sections.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chisquare

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS
from clearway.studies.encounter_model import (
    read_encounter_model,
    sample_initial,
    sample_tracks,
    step_bins,
)
from clearway.studies.encounter_model.model_file import parse_encounter_model

NAMES = (
    "balloon_v1", "fai1_v1", "haa_v1", "paraglider_v1", "skydiving_v1",
    "uncor_1200exclude_fwme_v1p2", "uncor_1200only_fwse_v1p2", "uncor_allcode_rotorcraft_v1",
)  # fmt: skip


@pytest.fixture(params=NAMES)
def path(request, data_dir) -> Path:
    file = data_dir / "daa" / "em-models" / f"{request.param}.txt"
    if not file.is_file():
        pytest.skip(f"needs data: no {file.name} in the data folder")
    return file


def sections(path):
    """Lines of each section."""
    found, lines = {}, []
    for line in path.read_text().splitlines():
        if line.startswith("#"):
            lines = found.setdefault(line[1:].strip(), [])
        elif line.strip():
            lines.append(line.strip())
    return found


def numbers(lines):
    return np.array([[float(part) for part in line.split()] for line in lines])


def tables(graph, sizes, counts, members):
    """Parents and shares [configurations, bins] of nodes, in the order of the file."""
    at, found = 0, {}
    for node in members:
        parents = np.flatnonzero(graph[:, node])
        length = int(sizes[node] * np.prod(sizes[parents]))
        table = counts[at : at + length].reshape(-1, int(sizes[node]))
        found[node] = parents, table
        at += length
    assert at == len(counts)
    return found


def configuration(states, parents, sizes):
    """[n] the row of states [n, variables]; the first parent varies fastest."""
    strides = np.cumprod([1, *sizes[parents][:-1]])[: len(parents)]
    return (states[:, parents] * strides).sum(axis=1).astype(int)


def agree(seen, shares, name):
    """Whether counts [bins] follow shares [bins]; what has none is never seen."""
    assert not seen[shares == 0.0].any(), name
    expected = shares * seen.sum()
    often = expected >= 5.0
    if often.sum() > 1:
        scaled = expected[often] * seen[often].sum() / expected[often].sum()
        assert chisquare(seen[often], scaled).pvalue > 1e-4, name


def test_marginals_are_those_of_the_file(path):
    told = sections(path)
    graph, sizes = numbers(told["G_initial"]), numbers(told["r_initial"])[0].astype(int)
    nodes = tables(graph, sizes, numbers(told["N_initial"])[0], range(len(sizes)))
    # The joint distribution over all bins, an axis for each variable.
    joint = np.ones([1] * len(sizes))
    for node, (parents, counts) in nodes.items():
        total = counts.sum(axis=1, keepdims=True)
        shares = np.divide(counts, total, out=np.zeros_like(counts), where=total > 0.0)
        axes = [*parents, node]
        spread = shares.T.reshape([sizes[node], *sizes[parents][::-1]]).transpose()
        shape = [sizes[n] if n in axes else 1 for n in range(len(sizes))]
        order = np.argsort(axes)
        joint = joint * spread.transpose(order).reshape(shape)
    assert joint.sum() == pytest.approx(1.0)
    bins = sample_initial(read_encounter_model(path), 40_000, np.random.default_rng(1))
    for node in range(len(sizes)):
        others = tuple(n for n in range(len(sizes)) if n != node)
        seen = np.bincount(bins[:, node], minlength=sizes[node])
        agree(seen, joint.sum(axis=others), told["labels_initial"][0].split(",")[node])


def test_a_second_on_every_rate_follows_its_parents_those_of_the_same_second_too(path):
    told, model = sections(path), read_encounter_model(path)
    graph, sizes = numbers(told["G_transition"]), numbers(told["r_transition"])[0].astype(int)
    count = len(numbers(told["r_initial"])[0])
    members = range(count, len(sizes))
    nodes = tables(graph, sizes, numbers(told["N_transition"])[0], members)
    labels = [part.strip().strip('"') for part in told["labels_transition"][0].split(",")]
    now_at = {node: labels.index(labels[node].replace("(t+1)", "(t)")) for node in members}
    rng = np.random.default_rng(2)
    now = sample_initial(model, 30_000, rng)
    after = step_bins(model, now, rng)
    states = np.column_stack([now, *(after[:, now_at[node]] for node in members)])
    for node, (parents, counts) in nodes.items():
        rows = configuration(states, parents, sizes)
        total = counts.sum(axis=1)
        told_of = total[rows] > 0.0
        np.testing.assert_array_equal(states[~told_of, node], now[~told_of, now_at[node]])
        # Expected and seen over all configurations that occur, bin by bin.
        shares = counts / np.maximum(total, 1.0)[:, None]
        expected = shares[rows[told_of]]
        seen = np.bincount(states[told_of, node], minlength=sizes[node])
        spread = np.sqrt((expected * (1.0 - expected)).sum(axis=0))
        assert np.all(np.abs(seen - expected.sum(axis=0)) <= 4.5 * spread + 1e-9), labels[node]
        # And the most frequent configuration alone.
        often = np.bincount(rows[told_of]).argmax()
        held = states[told_of & (rows == often), node]
        agree(np.bincount(held, minlength=sizes[node]), shares[often], labels[node])


def test_tracks_stay_within_the_scales_of_the_file(path):
    model = read_encounter_model(path)
    tracks = sample_tracks(model, 200, 60, np.random.default_rng(3))
    lowest, highest = model.span("L")
    heights = tracks.position_m[:, :, 2] / FOOT_M
    assert heights.min() >= lowest - 1e-6
    assert heights[:, 0].max() <= highest
    climbs = tracks.values[:, :, model.index(r"\dot h")]
    low, high = model.span(r"\dot h")
    assert low <= climbs.min() < climbs.max() <= high
    level = np.hypot(*tracks.velocity_mps[:, :, :2].reshape(-1, 2).T)
    if model.drifts:
        assert not level.any()
    else:
        assert level.max() <= model.span("v")[1] * 0.51445
        assert level.max() > 0.0


def test_a_damaged_file_is_named_by_section_and_line(path):
    lines = path.read_text().splitlines()
    at = lines.index("# N_transition") + 1
    lines[at] = lines[at].rstrip() + " many"
    with pytest.raises(InputError, match=rf"section N_transition, line {at + 1}"):
        parse_encounter_model("\n".join(lines), path.name)
    del lines[at]
    with pytest.raises(InputError, match="section N_transition: is missing or empty"):
        parse_encounter_model("\n".join(lines), path.name)


def test_air_ambulances_brake_before_landing_and_turn_to_both_sides(data_dir):
    """What tells that the labels of turn and acceleration stand for each other in this file."""
    file = data_dir / "daa" / "em-models" / "haa_v1.txt"
    if not file.is_file():
        pytest.skip("needs data: no haa_v1.txt in the data folder")
    model = read_encounter_model(file)
    bins = sample_initial(model, 60_000, np.random.default_rng(4))
    at = {name: bins[:, model.index(name)] for name in ("d_f", "d_s", r"\dot v", r"\dot \psi")}
    landing = (at["d_f"] == 0) & (at["d_s"] == 2)
    leaving = (at["d_f"] == 2) & (at["d_s"] == 0)
    for name, lopsided in ((r"\dot v", 0.6), (r"\dot \psi", 0.35)):
        middle = model.variables[model.index(name)].bins // 2
        slows, grows = at[name][landing] < middle, at[name][leaving] > middle
        if name == r"\dot v":
            assert slows.mean() > lopsided
            assert grows.mean() > lopsided
        else:
            assert slows.mean() < lopsided
            assert grows.mean() < lopsided
    # Its climbs are in feet a second: 25 of them are 1500 ft/min.
    assert model.climb_mps == FOOT_M != FOOT_PER_MINUTE_MPS
