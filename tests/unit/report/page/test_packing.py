"""Arrays in a page: packed and unpacked."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.page.packing import pack_arrays, quantise, unpack_arrays


def test_arrays_come_back() -> None:
    arrays = {
        "states": np.array([[0, 1, 2]], dtype=np.uint8),
        "times": np.array([0.5, 1.5], dtype=np.float32),
        "points": np.array([[-3, 4], [5, 6]], dtype=np.int16),
    }
    made = pack_arrays(arrays)
    assert all(own["at"] % 4 == 0 for own in made["arrays"].values())
    found = unpack_arrays(made)
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)


def test_a_type_that_browsers_lack_is_refused() -> None:
    with pytest.raises(AssertionError, match="times has the type f8"):
        pack_arrays({"times": np.array([1.0])})


def test_quantised_numbers_are_off_by_half_a_unit_at_most() -> None:
    values = np.linspace(-3.0, 7.0, 11)
    whole, unit = quantise(values)
    assert np.abs(whole * unit - values).max() <= 0.5 * unit
    assert unit == pytest.approx(7.0 / 32000)
    assert quantise(np.zeros(3))[1] == 1.0
