"""Filters and spectra against sines."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.afferents.signals import filter_band, spectrum

TIMES = np.arange(4000) * 1e-3


def sines(*parts, offset=0.0):
    values = np.full(TIMES.size, offset)
    for frequency, size in parts:
        values += size * np.sin(2.0 * np.pi * frequency * TIMES)
    return xr.DataArray(
        np.stack([values, 2.0 * values], axis=1), {"time": TIMES}, ("time", "site"), attrs={"units": "m"}
    )


def test_a_band_keeps_what_is_in_it():
    found = filter_band(sines((2.0, 1.0), (30.0, 0.5), (300.0, 1.0)), 10.0, 80.0).values[2000:]
    assert np.abs(found[:, 0]).max() == pytest.approx(0.5, rel=0.05)
    np.testing.assert_allclose(found[:, 1], 2.0 * found[:, 0], atol=1e-12)


def test_a_constant_passes_a_low_pass_from_the_start_and_nothing_of_it_a_high_pass():
    constant = sines(offset=3.0)
    np.testing.assert_allclose(filter_band(constant, high=20.0).values[:, 0], 3.0, rtol=1e-9)
    np.testing.assert_allclose(filter_band(constant, low=20.0), 0.0, atol=1e-9)


def test_filters_look_back_only():
    values = sines((5.0, 1.0))
    later = values.copy(data=np.where(TIMES[:, None] > 2.0, 7.0, values))
    before = TIMES <= 2.0
    np.testing.assert_array_equal(
        filter_band(values, high=30.0).values[before], filter_band(later, high=30.0).values[before]
    )


def test_the_spectrum_has_the_power_of_a_sine_at_its_frequency():
    found = spectrum(sines((50.0, 2.0)))
    density = found.isel(site=0)
    assert float(density.frequency[density.values.argmax()]) == pytest.approx(50.0, abs=0.25)
    assert float(density.integrate("frequency")) == pytest.approx(2.0, rel=1e-3)  # half of the amplitude squared
    assert found.attrs["units"] == "(m)^2/Hz"


@pytest.mark.parametrize(
    ("low", "high", "message"), [(0.0, None, "above 0"), (None, 600.0, "below 500"), (9.0, 8.0, "below high")]
)
def test_impossible_bands_are_refused(low, high, message):
    with pytest.raises(fs.InputError, match=message):
        filter_band(sines((5.0, 1.0)), low, high)


def test_unequal_steps_are_refused():
    with pytest.raises(fs.InputError, match="interpolate"):
        spectrum(xr.DataArray(np.zeros(3), {"time": [0.0, 1.0, 3.0]}, ("time",)))
