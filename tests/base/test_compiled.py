"""Arrays of the kind that loops take."""

import numpy as np

from clearway.base.compiled import plain


def test_arrays_of_one_kind_are_handed_on_as_they_are() -> None:
    whole = np.zeros(4)
    assert plain(whole) is whole
    fixed = np.ones(4)
    fixed.setflags(write=False)
    for other in (fixed, np.ones(8)[::2], np.ones(4, dtype=np.float32)):
        assert plain(other).flags.carray
        np.testing.assert_array_equal(plain(other), np.ones(4))
        assert plain(other).dtype == np.float64
