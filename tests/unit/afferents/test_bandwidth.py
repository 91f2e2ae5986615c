"""What steps and meshes resolve."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.afferents.signals import BandwidthWarning, mesh_bandwidth, record_bandwidth, warn_beyond
from fingerslip.verification.meshes import box


def records(step):
    return xr.Dataset(coords={"time": np.arange(11) * step})


def test_records_resolve_a_twentieth_of_their_rate():
    assert record_bandwidth(records(2.5e-3)) == pytest.approx(20.0)
    assert record_bandwidth(xr.Dataset(coords={"time": [0.0]})) == 0.0


def test_the_longest_step_counts():
    assert record_bandwidth(xr.Dataset(coords={"time": [0.0, 1e-3, 1.1e-2]})) == pytest.approx(5.0)


@pytest.mark.parametrize(("dim", "edge"), [(2, 1e-3), (3, 2e-3)])
def test_mesh_carries_waves_of_ten_edges(dim, edge):
    axes = [np.linspace(0.0, 4e-3, round(4e-3 / edge) + 1)] * dim
    material = fs.Elastic(youngs_modulus=30e3, poisson_ratio=0.49, density=1000.0)
    formulation = "plane_strain" if dim == 2 else "solid"
    mesh = box("Q4" if dim == 2 else "H8", *axes)
    region = next(iter(mesh.subdomains))
    model = fs.Model(mesh, {region: material}, formulation, fs.QuasiStatic(1e-3, 1e-3))
    speed = np.sqrt(30e3 / 3.0 / 1000.0)
    assert mesh_bandwidth(model)[region] == pytest.approx(speed / (10.0 * edge))


def test_a_question_beyond_the_records_is_warned_of():
    with pytest.warns(
        BandwidthWarning, match=r"the question reaches 50 Hz, and the records resolve 20 Hz; a step of 0.001 s"
    ):
        warn_beyond(records(2.5e-3), 50.0, "the question")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_beyond(records(2.5e-3), 19.0, "the question")
