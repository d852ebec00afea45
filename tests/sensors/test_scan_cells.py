"""What a scan says of the cells, in one compiled call, is what its steps alone come to."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.compiled import read_only
from clearway.base.frames import world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.sensors import BeamPattern
from clearway.sensors.beams.binning import cell_tables, count_beams
from clearway.sensors.cells.return_block import Filters
from clearway.sensors.cells.returns import bin_returns
from clearway.sensors.cells.scan_cells import (
    PlacedScan,
    compute_hit_share,
    detect_cells,
    hindrance_of,
)

GRID = AvoidanceGrid.uniform()
PATTERN = BeamPattern.per_cell(GRID, 4, elevations_per_cell=3, max_range_m=12.0)


@given(st.integers(0, 2**32 - 1), st.integers(0, 2_000), st.booleans())
@settings(max_examples=30, deadline=None)
def test_a_scan_in_one_call_is_its_steps(seed: int, count: int, has_ground: bool) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(0.0, 5.0, (count, 3))
    points[: count // 50] = np.nan
    filters = Filters(
        read_only(world_from_body(rng.uniform(-0.3, 0.3, 3))),
        read_only(rng.uniform(-0.3, 0.3, 3)),
        read_only(np.zeros(3)),
        read_only(np.array([0.0, 0.0, 1.0])),
        -1.0 if has_ground else -np.inf,
        0.3,
        12.0,
        0.2,
        0.01,
    )
    beams = count_beams(GRID, PATTERN, filters.rotation)
    scan = PlacedScan(read_only(points), filters, cell_tables(GRID), beams, GRID.layers)
    found = detect_cells(scan)
    binned = bin_returns(read_only(points), filters, cell_tables(GRID))
    hindrance, visibility = hindrance_of(binned.hindering, binned.blocked, beams, GRID.layers)
    steps = (
        binned.hits,
        binned.squared_ranges_m2,
        binned.counts,
        compute_hit_share(binned.hits, beams),
        hindrance,
        visibility,
    )
    for name, one, other in zip(found._fields, found, steps, strict=True):
        np.testing.assert_array_equal(one, other, err_msg=name)
