"""Stimuli at receptors against what a homogeneous strain makes of them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.afferents.signals import STIMULI, receptor_stimuli
from problems.pushed import push_and_slide

SITES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "SA-I", (1e-3, 0.0), "bulk"))


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
    ],
)
def test_strains_of_known_tensors(strain, components, equivalent, largest, smallest):
    found = receptor_stimuli(uniform(strain, components)).isel(time=-1, site=0)
    assert float(found.equivalent_strain) == pytest.approx(equivalent, abs=1e-15)
    assert float(found.largest_strain) == pytest.approx(largest)
    assert float(found.smallest_strain) == pytest.approx(smallest)
    assert float(found.pressure) == pytest.approx(-1e4 * np.mean(strain[:3]))


def test_rates_are_differences_over_time():
    found = receptor_stimuli(uniform([0.2, -0.1, -0.1, 0.0], PLANE))
    np.testing.assert_allclose(found.equivalent_strain_rate, 0.4)
    assert found.equivalent_strain_rate.attrs["units"] == "1/s"


def test_every_stimulus_of_a_simulation_has_units_and_is_finite():
    found = receptor_stimuli(fs.simulate(push_and_slide(record=fs.Recording(SITES))))
    assert set(found.data_vars) == {*STIMULI, *(f"{name}_rate" for name in STIMULI)}
    for name, variable in found.data_vars.items():
        assert np.isfinite(variable.values).all(), name
        assert variable.attrs["units"]
        assert variable.sizes == {"time": found.sizes["time"], "site": 2}


def test_missing_receptors_and_missing_strain_are_said():
    history = uniform([0.2, -0.1, -0.1, 0.0], PLANE)
    with pytest.raises(
        fs.ResultError, match=r"^history: has no receptor of the types SA-II, needs one; record receptors$"
    ):
        receptor_stimuli(history, ("SA-II",))
    with pytest.raises(fs.ResultError, match="run the study again"):
        receptor_stimuli(history.drop_vars("strain"))


def test_a_strain_that_is_not_known_has_no_principal_strain():
    found = receptor_stimuli(uniform([0.2, -0.1, np.nan, 0.0], PLANE)).isel(time=-1, site=0)
    assert np.isnan(found[["equivalent_strain", "largest_strain", "smallest_strain"]].to_array()).all()
