"""Arrays of the kind that loops take."""

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
