"""Stimuli against what a homogeneous strain makes of them; filters and spectra against sines."""

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.afferents.signals import (
    STIMULI,
    BandwidthWarning,
    filter_band,
    mesh_bandwidth,
    receptor_stimuli,
    record_bandwidth,
    spectrum,
    warn_beyond,
)
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide

PLACES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "SA-I", (1e-3, 0.0), "bulk"))


def uniform(strain, components):
    """Return a history of two times at which one receptor strains."""
    strain = np.asarray(strain, dtype=float)
    stacked = np.stack([np.zeros_like(strain), strain])[:, None]
    motion = np.zeros((2, 1, 3 if len(components) == 6 else 2))
    return xr.Dataset(
        {
            "strain": (("time", "site", "stress_component"), stacked),
            "stress": (("time", "site", "stress_component"), 1e4 * stacked),
            "strain_energy_density": (("time", "site"), 5.0 * np.abs(stacked[:, :, 0])),
            "velocity": (("time", "site", "component"), motion),
            "acceleration": (("time", "site", "component"), motion + 3.0),
        },
        {"time": [0.0, 0.5], "site": ["FA-I-01"], "site_kind": ("site", ["FA-I"]), "stress_component": components},
    )


PLANE, SPACE = ["xx", "yy", "zz", "xy"], ["xx", "yy", "zz", "xy", "yz", "xz"]


@pytest.mark.parametrize(
    ("strain", "components", "equivalent", "largest", "smallest"),
    [
        ([0.2, -0.1, -0.1, 0.0], PLANE, 0.2, 0.2, -0.1),
        ([0.0, 0.0, 0.0, 0.1], PLANE, 0.2 / np.sqrt(3.0), 0.1, -0.1),
        ([0.0, 0.0, 0.0, 0.0, 0.1, 0.0], SPACE, 0.2 / np.sqrt(3.0), 0.1, -0.1),
        ([0.0, 0.0, 0.0, 0.0, 0.0, 0.1], SPACE, 0.2 / np.sqrt(3.0), 0.1, -0.1),
        ([0.1, 0.1, 0.1, 0.0, 0.0, 0.0], SPACE, 0.0, 0.1, 0.1),
        ([0.2, -0.1, np.nan, 0.0], PLANE, np.nan, np.nan, np.nan),
    ],
)
def test_strains_of_known_tensors_and_their_rates(strain, components, equivalent, largest, smallest):
    stimuli = receptor_stimuli(uniform(strain, components))
    found = stimuli.isel(time=-1, site=0)
    assert float(found.equivalent_strain) == pytest.approx(equivalent, abs=1e-15, nan_ok=True)
    assert float(found.largest_strain) == pytest.approx(largest, nan_ok=True)
    assert float(found.smallest_strain) == pytest.approx(smallest, nan_ok=True)
    assert float(found.pressure) == pytest.approx(-1e4 * np.mean(strain[:3]), nan_ok=True)
    np.testing.assert_allclose(stimuli.equivalent_strain_rate, equivalent / 0.5, atol=1e-15)
    assert stimuli.equivalent_strain_rate.attrs["units"] == "1/s"


def test_every_stimulus_of_a_simulation_has_units_and_is_finite():
    found = receptor_stimuli(fs.simulate(push_and_slide(record=fs.Recording(PLACES))))
    assert set(found.data_vars) == {*STIMULI, *(f"{name}_rate" for name in STIMULI)}
    for name, variable in found.data_vars.items():
        assert np.isfinite(variable.values).all(), name
        assert variable.attrs["units"]
        assert variable.sizes == {"time": found.sizes["time"], "site": 2}


def test_missing_receptors_and_missing_strain_are_said():
    history = uniform([0.2, -0.1, -0.1, 0.0], PLANE)
    message = r"^history: has no receptor of the types SA-II, needs one; record receptors$"
    with pytest.raises(fs.ResultError, match=message):
        receptor_stimuli(history, ("SA-II",))
    with pytest.raises(fs.InputError, match=r"kinds: 'PC' is not known, needs some of .*FA-II.*; write FA-II"):
        receptor_stimuli(history, ("SA-I", "PC"))
    with pytest.raises(fs.InputError, match="history: got 'results', needs a history, which simulate returns"):
        fs.spikes_of("results", fs.human_afferents())  # type: ignore[arg-type]
    with pytest.raises(fs.ResultError, match="run the study again"):
        receptor_stimuli(history.drop_vars("strain"))


TIMES = np.arange(4000) * 1e-3


def sines(*parts, offset=0.0):
    values = np.full(TIMES.size, offset)
    for frequency, size in parts:
        values += size * np.sin(2.0 * np.pi * frequency * TIMES)
    return xr.DataArray(
        np.stack([values, 2.0 * values], axis=1), {"time": TIMES}, ("time", "site"), attrs={"units": "m"}
    )


def test_a_band_keeps_what_is_in_it_from_the_start_and_looks_back_only():
    found = filter_band(sines((2.0, 1.0), (30.0, 0.5), (300.0, 1.0)), 10.0, 80.0).values[2000:]
    assert np.abs(found[:, 0]).max() == pytest.approx(0.5, rel=0.05)
    np.testing.assert_allclose(found[:, 1], 2.0 * found[:, 0], atol=1e-12)
    constant = sines(offset=3.0)
    np.testing.assert_allclose(filter_band(constant, high=20.0).values[:, 0], 3.0, rtol=1e-9)
    np.testing.assert_allclose(filter_band(constant, low=20.0), 0.0, atol=1e-9)
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
def test_impossible_bands_and_unequal_steps_are_refused(low, high, message):
    with pytest.raises(fs.InputError, match=message):
        filter_band(sines((5.0, 1.0)), low, high)
    with pytest.raises(fs.InputError, match="interpolate"):
        spectrum(xr.DataArray(np.zeros(3), {"time": [0.0, 1.0, 3.0]}, ("time",)))


def records(step):
    return xr.Dataset(coords={"time": np.arange(11) * step})


@pytest.mark.parametrize(("dim", "edge"), [(2, 1e-3), (3, 2e-3)])
def test_mesh_carries_waves_of_ten_edges(dim, edge):
    mesh = box("Q4" if dim == 2 else "H8", *[np.linspace(0.0, 4e-3, round(4e-3 / edge) + 1)] * dim)
    material = fs.Elastic(youngs_modulus=30e3, poisson_ratio=0.49, density=1000.0)
    formulation = "plane_strain" if dim == 2 else "solid"
    model = fs.Model(mesh, {"bulk": material}, formulation, fs.QuasiStatic(1e-3, 1e-3))
    speed = np.sqrt(30e3 / 3.0 / 1000.0)
    assert mesh_bandwidth(model)["bulk"] == pytest.approx(speed / (10.0 * edge))


def test_records_resolve_a_twentieth_of_their_rate_and_a_question_beyond_is_warned_of():
    assert record_bandwidth(records(2.5e-3)) == pytest.approx(20.0)
    assert record_bandwidth(xr.Dataset(coords={"time": [0.0]})) == 0.0
    assert record_bandwidth(xr.Dataset(coords={"time": [0.0, 1e-3, 1.1e-2]})) == pytest.approx(5.0)
    message = r"the question reaches 50 Hz, and the records resolve 20 Hz; a step of 1 ms"
    with pytest.warns(BandwidthWarning, match=message):
        warn_beyond(records(2.5e-3), 50.0, "the question")
    with pytest.warns(BandwidthWarning, match=r"324 Hz, .* a step of 0\.15 ms would do"):
        warn_beyond(records(2.5e-3), 324.0, "the model of FA-II")
    warn_beyond(records(2.5e-3), 19.0, "the question")
