"""Maxima, distances and prominences are those of SciPy, which tests may import."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import find_peaks

from fingerslip.slip.maxima import far_apart, local_maxima, prominences

# Few levels make level stretches and equal maxima.
SIGNALS = st.one_of(
    st.lists(st.integers(0, 5).map(float), min_size=0, max_size=60),
    st.lists(st.floats(-1e3, 1e3), min_size=0, max_size=60, unique=True),
)


@given(SIGNALS)
def test_maxima_and_prominences_are_those_of_scipy(values: list[float]) -> None:
    signal = np.array(values, dtype=float)
    expected, properties = find_peaks(signal, prominence=0.0)
    found = local_maxima(signal)
    assert found.tolist() == expected.tolist()
    assert prominences(signal, found).tolist() == properties["prominences"].tolist()


@given(SIGNALS, st.integers(1, 20))
def test_maxima_that_are_far_apart_are_those_of_scipy(values: list[float], distance: int) -> None:
    signal = np.array(values, dtype=float)
    expected, _ = find_peaks(signal, distance=distance)
    assert far_apart(signal, local_maxima(signal), distance).tolist() == expected.tolist()


@pytest.mark.parametrize("size", [0, 1, 2])
def test_short_signals_have_no_maximum(size: int) -> None:
    assert local_maxima(np.arange(size, dtype=float)).size == 0
    assert prominences(np.arange(size, dtype=float), np.empty(0, dtype=np.intp)).size == 0
