"""Arrays of the kind that loops take."""

import os
import subprocess
import sys

import numpy as np

from clearway.base.compiled import make_plain_array


def test_arrays_of_one_kind_are_handed_on_as_they_are() -> None:
    whole = np.zeros(4)
    assert make_plain_array(whole) is whole
    fixed = np.ones(4)
    fixed.setflags(write=False)
    for other in (fixed, np.ones(8)[::2], np.ones(4, dtype=np.float32)):
        assert make_plain_array(other).flags.carray
        np.testing.assert_array_equal(make_plain_array(other), np.ones(4))
        assert make_plain_array(other).dtype == np.float64


ROWS_WITHOUT_RETURNS = """
import numpy as np
from clearway.sensors.passing.width import blocks_of
blocks_of(np.full((4, 3), np.inf))
"""


def test_loops_in_plain_python_warn_of_no_arithmetic_as_the_core_does_not() -> None:
    """Directions without a return are infinitely far: their differences are not numbers."""
    subprocess.run(
        [sys.executable, "-W", "error", "-c", ROWS_WITHOUT_RETURNS],
        env={**os.environ, "CLEARWAY_CORE": "python"},
        check=True,
    )
