"""The loops over a sweep, against the same by bins and boxes one at a time."""

import numpy as np
import pytest

from clearway.base.state import State
from clearway.sensors import BeamPattern, Lidar
from clearway.sensors.beams.raster import beam_raster, directions_of, find_bin, nearest_returns
from clearway.sensors.memory.doubt import (
    HITS_MISSED,
    SAME,
    DoubtRule,
    _beyond,
    _measure_turn,
    doubts,
)
from clearway.sensors.memory.remembered import MOST_LEVELS, Pitch, level_at, merge_boxes
from clearway.sensors.memory.swept_boxes import boxes_of_returns, match_boxes_seen
from clearway.sensors.passing.passed_points import (
    REACH_OF_BEAM,
    goes_on,
    in_sensor,
    place_returns,
    sensor_at,
)
from clearway.sensors.passing.width import ALIKE, Widths, _note_sizes, returns_with_size

PATTERN = BeamPattern.rotating(np.linspace(-30.0, 30.0, 21), 3.0, max_range_m=30.0)
LIDAR = Lidar("all round", PATTERN, sigma_m=0.02)
RASTER = beam_raster(PATTERN)
SENSOR = sensor_at(LIDAR, State(np.zeros(3)), 0.06)


def sweep(seed):
    """Returns of a wall, of leaves, beside the pattern, and what is no return."""
    rng = np.random.default_rng(seed)
    beams = PATTERN.directions[rng.random(PATTERN.beams) < 0.8]
    ranges = np.where(beams[:, 0] > 0.3, 6.0 / np.maximum(beams[:, 0], 0.3), 4.0)
    ranges = np.where(rng.random(len(beams)) < 0.1, rng.uniform(1.0, 9.0, len(beams)), ranges)
    odd = [[np.nan, 1.0, 1.0], [np.inf, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]
    return np.concatenate([beams * ranges[:, None] * rng.uniform(0.99, 1.01), odd])


def bins_one_by_one(points):
    rows = RASTER.low.shape[1]
    found = []
    for x, y, z in points:
        distance = np.sqrt(x * x + y * y + z * z)
        column = row = -1
        if distance < np.inf:
            column, row = find_bin(
                x,
                y,
                z / (distance + 1e-300),
                RASTER.low,
                RASTER.per_column,
                RASTER.per_row,
                RASTER.bottom,
            )
        found.append(column * rows + row if row >= 0 else -1)
    return np.array(found)


def test_bins_of_all_returns_are_those_of_each():
    points = sweep(0)
    directions = directions_of(points, RASTER)
    assert np.array_equal(directions.bin, bins_one_by_one(points))
    nearest = np.full(RASTER.low.size, np.inf)
    for at, distance in zip(directions.bin, np.sqrt((points**2).sum(axis=1)), strict=True):
        if at >= 0:
            nearest[at] = min(nearest[at], distance)
    assert np.array_equal(directions.nearest_m.ravel(), nearest)


def sizes_one_by_one(points, nearest):
    """How thick what each return hit is, as the docstrings of `sensors.passing.width` have it."""
    columns, rows = nearest.shape

    def in_block(c, r):
        for a in (c - 1, c + 1):
            for b in (r - 1, r + 1):
                if 0 <= b < rows:
                    four = nearest[[c, c, a % columns, a % columns], [r, b, r, b]]
                    if four.max() < np.inf and np.ptp(four) <= ALIKE * four.min():
                        return True
        return False

    def adjoins(c, r):
        for a in range(c - 1, c + 2):
            for b in range(max(r - 1, 0), min(r + 2, rows)):
                alike = abs(nearest[a % columns, b] - nearest[c, r]) <= ALIKE * nearest[c, r]
                if alike and (a, b) != (c, r) and in_block(a % columns, b):
                    return True
        return False

    sizes = []
    for point, at in zip(points, bins_one_by_one(points), strict=True):
        away, size = np.sqrt(np.sum(point**2)), 0.0
        if at >= 0:
            c, r = divmod(at, rows)
            near = away <= (1.0 + ALIKE) * nearest[c, r]
            size = away * PATTERN.spacing_rad if near and (in_block(c, r) or adjoins(c, r)) else 0.0
        sizes.append(size)
    return np.array(sizes)


def leaves(seed):
    """Returns anywhere, several in a direction: hardly any is in a block, or beside one."""
    return np.random.default_rng(seed).uniform(-8.0, 8.0, (3000, 3))


@pytest.mark.parametrize("points", [sweep(1), leaves(2), np.concatenate([sweep(3), leaves(4)])])
def test_widths_of_all_returns_are_those_of_each(points):
    directions = directions_of(points, RASTER)
    nearest = directions.nearest_m
    seen = returns_with_size(points, SENSOR, 15.0, -np.inf, directions, 0.0)
    placed = place_returns(points, SENSOR, 15.0, -np.inf)
    assert np.array_equal(seen.points_m, placed.points_m)
    expected = sizes_one_by_one(points[placed.source], nearest)
    assert 0 < np.count_nonzero(expected) < len(expected)
    assert seen.size_m == pytest.approx(expected, rel=1e-12)


def test_a_return_at_the_sensor_itself_is_kept_where_no_size_is_declared():
    """Nothing is counted per bin then: what lies behind the empty counts is not looked at."""
    placed, here = np.zeros((1, 3)), np.zeros(1)
    bins, nearest = np.zeros(1, dtype=np.int32), np.full((8, 4), np.inf)
    nearest[0, 0] = 0.0
    nothing = np.zeros((8, 4), dtype=np.uint8)
    ones = np.ones((8, 4), dtype=np.int32)
    radii, sizes, source = np.empty(1), np.empty(1), np.zeros(1, dtype=np.int64)
    widths = Widths(nearest, nothing, nothing, ones[:0, :0], 0.01, 0.0)
    assert _note_sizes(placed, here, source, bins, widths, radii, sizes) == 1


def boxes(seed, count, low, high):
    points = np.random.default_rng(seed).uniform(low, high, (count, 3))
    radii = np.full(count, 0.01)
    return points, boxes_of_returns(points, radii, radii, np.zeros(3), Pitch(0.12, np.inf), 0.0)


def test_a_sweep_of_many_voxels_has_one_box_for_each():
    """More than the table of voxels begins with room for."""
    points, found = boxes(2, 20_000, -2.0, 2.0)
    voxels, of = np.unique(np.floor(points / 0.12), axis=0, return_inverse=True)
    low, high = np.full((len(voxels), 3), np.inf), np.full((len(voxels), 3), -np.inf)
    np.minimum.at(low, of.ravel(), points)
    np.maximum.at(high, of.ravel(), points)
    assert len(found.doubt) == len(voxels) > 4_096
    ours = np.lexsort(np.floor(found.low_m / 0.12).T[::-1])
    assert np.array_equal(found.low_m[ours], low)
    assert np.array_equal(found.high_m[ours], high)


@pytest.mark.parametrize("fine_m", [0.3, 2.6, np.inf])
def test_pitches_double_with_the_distance(fine_m):
    for distance_m in (0.0, 0.3, 0.3000001, 2.6, 5.2, 5.3, 41.0, 500.0, 1e9):
        doubled = np.ceil(np.log2(distance_m / fine_m)) if distance_m > fine_m else 0
        assert level_at(distance_m, fine_m) == min(doubled, MOST_LEVELS)


def test_what_is_hit_again_holds_the_old_box_whatever_was_doubted():
    _, old = boxes(3, 300, -1.0, 1.0)
    _, new = boxes(4, 300, -0.5, 1.5)
    again = match_boxes_seen(old, new, 0.12)
    for n, number in enumerate(again):
        same = np.all(np.floor(new.low_m / 0.12) == np.floor(old.low_m[n] / 0.12), axis=1)
        assert number == (np.flatnonzero(same)[0] if same.any() else -1)
    doubt = np.where(np.arange(len(again)) % 3 == 0, 1.0, 0.25)
    both, kept = merge_boxes(old, doubt, new, again)
    assert kept == np.count_nonzero((again < 0) & (doubt < 1.0))
    assert np.array_equal(both.low_m[:kept], old.low_m[(again < 0) & (doubt < 1.0)])
    seen_twice = np.zeros(len(new.doubt), dtype=bool)
    seen_twice[again[again >= 0]] = True
    assert np.array_equal(both.sweeps[kept:], np.where(seen_twice, 2, 1))
    first = np.flatnonzero(again >= 0)
    low = np.minimum(new.low_m[again[first]], old.low_m[first])
    assert np.array_equal(both.low_m[kept:][again[first]], low)


def test_what_is_hit_again_is_not_asked_for_unless_it_is_lone():
    _, old = boxes(5, 200, 2.0, 6.0)
    old.size_m[::2] = 0.0
    nothing = np.full(RASTER.low.shape, np.inf)
    rule = DoubtRule(0.12, np.inf, 2.0, 1.0, False)

    def doubted(again):
        return doubts(old, again, nothing, SENSOR, SENSOR, RASTER, rule)

    fresh = doubted(np.full(len(old.doubt), -1))
    hit = doubted(np.arange(len(old.doubt)))
    assert np.count_nonzero(fresh)
    assert np.array_equal(hit, np.where(old.size_m == 0.0, fresh, old.doubt))


def said_against(old, n, nearest, sensor, before, rule):
    """What a sweep says against a box that it has not hit again, whatever is known of others."""
    middle = 0.5 * (old.low_m[n] + old.high_m[n])
    x, y, z = in_sensor(*middle, sensor)
    distance, size = np.sqrt(x * x + y * y + z * z), old.size_m[n]
    apart = 2.0 * sensor.half_spacing * distance
    lone = size == 0.0 and old.sweeps[n] == 1
    surely = apart <= SAME * max(size, rule.smallest_m)
    surely |= bool(lone and rule.rains and REACH_OF_BEAM * apart <= rule.voxel_m)
    beyond = _beyond(old, n, distance, sensor, rule)
    if not (surely or size == 0.0):
        return 0.0
    if not goes_on(x, y, z, distance, beyond, nearest, sensor, RASTER):
        return 0.0
    if surely:
        return 1.0 / rule.passes_to_clear
    turned = _measure_turn(*middle, x, y, z, distance, before) / (2.0 * sensor.half_spacing)
    return rule.smallest_m / apart * min(1.0, turned) / HITS_MISSED


@pytest.mark.parametrize("rains", [False, True])
def test_many_boxes_are_doubted_as_each_of_them_is(rains):
    rng = np.random.default_rng(6)
    _, old = boxes(6, 3000, -9.0, 9.0)
    old.size_m[:] = rng.choice([0.0, 0.05, 0.8], len(old.doubt))
    old.sweeps[:] = rng.integers(1, 3, len(old.doubt))
    points = sweep(1)
    nearest = nearest_returns(points[np.isfinite(points).all(axis=1)], RASTER)
    sensor = sensor_at(LIDAR, State([0.3, -0.2, 0.1], [0.2, -0.4, 1.0]), 0.06)
    rule = DoubtRule(0.12, 6.0, 2.0, 0.05, rains)
    fresh = np.full(len(old.doubt), -1)
    found = doubts(old, fresh, nearest, sensor, SENSOR, RASTER, rule) - old.doubt
    alone = [said_against(old, n, nearest, sensor, SENSOR, rule) for n in range(len(fresh))]
    assert np.array_equal(found, alone)
    assert 20 < np.count_nonzero(found) < len(found) // 2
    assert len(np.unique(found)) > 10
